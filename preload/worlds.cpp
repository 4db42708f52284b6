// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/preload/worlds.h"

#include "cullet/preload/kept_beside.h"
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

namespace cullet::preload
{
namespace
{
using world_layers::StepParts;

/// All stand-ins of worlds.
struct Worlds
{
    KeptBeside<StepParts> parts;
    std::mutex mutex;                             ///< of the counts
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
}  // namespace

StepParts& stepPartsOf(const btCollisionWorld& world)
{
    return worlds().parts.of(&world);
}

void endWorld(const btCollisionWorld& world)
{
    Worlds& all = worlds();
    {
        const std::lock_guard<std::mutex> lock(all.mutex);
        count(all.parts.of(&world), all.mostBoxes, all.mostBodies);
    }
    all.parts.remove(&world);
}

bool constructWorld(DynamicsClass kind, void* memory, const WorldArguments& arguments)
{
    if (!settings().replacesWorld)
        return false;
    try
    {
        worlds().parts.add(memory, std::make_shared<StepParts>());
    }
    catch (const std::exception& problem)
    {
        printLine("no world (%s); Bullet's own is used", problem.what());
        return false;
    }
    switch (kind)
    {
        case DynamicsClass::Discrete:
            make<btDiscreteDynamicsWorld, btConstraintSolver>(memory, arguments);
            break;
        case DynamicsClass::Simple:
            make<btSimpleDynamicsWorld, btConstraintSolver>(memory, arguments);
            break;
        case DynamicsClass::MultiBody:
            make<btMultiBodyDynamicsWorld, btMultiBodyConstraintSolver>(memory, arguments);
            break;
        case DynamicsClass::Solver:
            break;
    }
    return true;
}

bool destroyWorld(void* memory, DynamicsFunction how)
{
    if (!settings().replacesWorld || !worlds().parts.has(memory))
        return false;
    destroyAs<btDynamicsWorld>(memory, how == DynamicsFunction::Delete);
    return true;
}

void writeWorlds()
{
    if (!settings().replacesWorld)
        return;
    Worlds& all = worlds();
    const std::lock_guard<std::mutex> lock(all.mutex);
    std::uint64_t mostBoxes = all.mostBoxes, mostBodies = all.mostBodies;
    all.parts.forEach([&](const void*, const StepParts& parts) { count(parts, mostBoxes, mostBodies); });
    printLine("worlds: %" PRIu64 "; at most %" PRIu64 " boxes and %" PRIu64
              " bodies of a last step in parallel loops",
              all.parts.total(), mostBoxes, mostBodies);
}
}  // namespace cullet::preload
