// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/preload/worlds.h"

#include "cullet/preload/message.h"
#include "cullet/preload/settings.h"
#include "cullet/preload/world_stand_in.h"

#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>

#include <algorithm>
#include <cinttypes>
#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <set>
#include <string>
#include <unordered_map>

namespace cullet::preload
{
namespace
{
using world_layers::StepParts;

/// All stand-ins of worlds.
struct Worlds
{
    std::mutex mutex;
    std::unordered_map<const void*, std::unique_ptr<StepParts>> living;
    std::set<std::string> kept;  ///< what was said to keep Bullet's world
    std::uint64_t total = 0;
    std::uint64_t mostBoxes = 0, mostBodies = 0;  ///< of those that ended, in their last step
};

/// Never destroyed: the program may destroy its worlds after this library's statics.
Worlds& worlds()
{
    static auto& result = *new Worlds;
    return result;
}

void count(const StepParts& parts, std::uint64_t& mostBoxes, std::uint64_t& mostBodies)
{
    mostBoxes = std::max(mostBoxes, parts.boxes.stats().parallelBoxes);
    mostBodies = std::max(mostBodies, parts.bodies.stats().parallelBodies);
}

void beginWorld(const void* memory)
{
    auto parts = std::make_unique<StepParts>();
    Worlds& all = worlds();
    const std::lock_guard<std::mutex> lock(all.mutex);
    all.living[memory] = std::move(parts);
    ++all.total;
}

template <class Base, class Solver>
void make(void* memory, const WorldArguments& arguments)
{
    using StandIn = WorldStandIn<Base>;
    static_assert(sizeof(StandIn) == sizeof(Base), "the program has taken no more memory");
    static_assert(alignof(StandIn) == alignof(Base), "the program has aligned its memory for Bullet");
    ::new (memory) StandIn(static_cast<btDispatcher*>(arguments.dispatcher),
                           static_cast<btBroadphaseInterface*>(arguments.broadphase),
                           static_cast<Solver*>(arguments.solver),
                           static_cast<btCollisionConfiguration*>(arguments.configuration));
}

bool isStandIn(const void* memory)
{
    Worlds& all = worlds();
    const std::lock_guard<std::mutex> lock(all.mutex);
    return all.living.count(memory) != 0;
}
}  // namespace

StepParts& stepPartsOf(const btCollisionWorld& world)
{
    Worlds& all = worlds();
    const std::lock_guard<std::mutex> lock(all.mutex);
    return *all.living.find(&world)->second;
}

void endWorld(const btCollisionWorld& world)
{
    Worlds& all = worlds();
    const std::lock_guard<std::mutex> lock(all.mutex);
    const auto found = all.living.find(&world);
    count(*found->second, all.mostBoxes, all.mostBodies);
    all.living.erase(found);
}

bool constructWorld(WorldClass kind, void* memory, const WorldArguments& arguments)
{
    if (!settings().replacesWorld)
        return false;
    try
    {
        beginWorld(memory);
    }
    catch (const std::exception& problem)
    {
        printLine("no world (%s); Bullet's own is used", problem.what());
        return false;
    }
    switch (kind)
    {
        case WorldClass::Discrete:
            make<btDiscreteDynamicsWorld, btConstraintSolver>(memory, arguments);
            break;
        case WorldClass::Simple:
            make<btSimpleDynamicsWorld, btConstraintSolver>(memory, arguments);
            break;
        case WorldClass::MultiBody:
            make<btMultiBodyDynamicsWorld, btMultiBodyConstraintSolver>(memory, arguments);
            break;
    }
    return true;
}

bool destroyWorld(void* memory, WorldFunction how)
{
    if (!settings().replacesWorld || !isStandIn(memory))
        return false;
    auto* world = static_cast<btDynamicsWorld*>(memory);
    if (how == WorldFunction::Delete)
        delete world;
    else
        world->~btDynamicsWorld();
    return true;
}

void keepWorld(const char* what)
{
    if (!settings().replacesWorld)
        return;
    Worlds& all = worlds();
    const std::lock_guard<std::mutex> lock(all.mutex);
    if (all.kept.insert(what).second)
        printLine("CULLET_WORLD=1: %s keeps Bullet's own world", what);
}

void writeWorlds()
{
    if (!settings().replacesWorld)
        return;
    Worlds& all = worlds();
    const std::lock_guard<std::mutex> lock(all.mutex);
    std::uint64_t mostBoxes = all.mostBoxes, mostBodies = all.mostBodies;
    for (const auto& [memory, parts] : all.living)
        count(*parts, mostBoxes, mostBodies);
    printLine("worlds: %" PRIu64 "; at most %" PRIu64 " boxes and %" PRIu64
              " bodies of a last step in parallel loops",
              all.total, mostBoxes, mostBodies);
}
}  // namespace cullet::preload
