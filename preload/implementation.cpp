// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/preload/implementation.h"

#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/isa_gjk.h"
#include "cullet/preload/message.h"
#include "cullet/preload/settings.h"
#include "cullet/preload/solvers.h"
#include "cullet/preload/stand_in.h"
#include "cullet/preload/summary.h"
#include "cullet/preload/worlds.h"

#include <BulletCollision/CollisionDispatch/btCollisionConfiguration.h>

#include <atomic>
#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <set>
#include <string>
#include <utility>

namespace cullet::preload
{
namespace
{
/// Whether the broad phase is only used as a tree for queries: in btAxisSweep3, or in programs that traverse it.
bool isQueryTree(btOverlappingPairCache* cache)
{
    return dynamicCast<btNullPairCache>(cache) != nullptr;
}

bool construct(void* memory, void* pairCache, bool needsTrees)
{
    auto* cache = static_cast<btOverlappingPairCache*>(pairCache);
    if (!settings().replacesBroadphase || isQueryTree(cache))
        return false;
    try
    {
        auto parts = std::make_unique<StandIn::Parts>(cache, settings(), needsTrees);
        new (memory) StandIn(std::move(parts));
        return true;
    }
    catch (const std::exception& problem)
    {
        printLine("no broad phase (%s); Bullet's own is used", problem.what());
        return false;
    }
}

/// Whether hulls have Bullet's algorithm, not one of the program.
bool hasStockAlgorithm(btCollisionDispatcher& dispatcher)
{
    auto* function = dispatcher.getCollisionConfiguration()->getCollisionAlgorithmCreateFunc(
        CONVEX_HULL_SHAPE_PROXYTYPE, CONVEX_HULL_SHAPE_PROXYTYPE);
    return dynamicCast<btConvexConvexAlgorithm::CreateFunc>(function) != nullptr;
}

void adopt(void* memory)
{
    auto& dispatcher = *static_cast<btCollisionDispatcher*>(memory);
    if (!settings().replacesNarrowPhase)
        return;
    try
    {
        if (!hasStockAlgorithm(dispatcher))
        {
            printLine("the program has a convex algorithm of its own, which stays");
            return;
        }
        beforeRegistration(dispatcher);
        afterRegistration(dispatcher, registerIsaGjk(dispatcher, settings().narrowPhase));
    }
    catch (const std::exception& problem)
    {
        printLine("no ISA-GJK (%s); Bullet's own algorithm is used", problem.what());
    }
}

bool constructDynamics(DynamicsClass kind, void* memory, const WorldArguments& arguments)
{
    return kind == DynamicsClass::Solver ? constructSolver(memory) : constructWorld(kind, memory, arguments);
}

bool destroyDynamics(DynamicsClass kind, void* memory, DynamicsFunction how)
{
    return kind == DynamicsClass::Solver ? destroySolver(memory, how) : destroyWorld(memory, how);
}

void keepDynamics(DynamicsClass kind, const char* what)
{
    const bool isSolver = kind == DynamicsClass::Solver;
    if (isSolver ? !settings().solver.has_value() : !settings().replacesWorld)
        return;
    static auto& mutex = *new std::mutex;
    static auto& said = *new std::set<std::pair<bool, std::string>>;
    const std::lock_guard<std::mutex> lock(mutex);
    if (said.emplace(isSolver, what).second)
        printLine("%s: %s keeps Bullet's own %s", isSolver ? "CULLET_SOLVER" : "CULLET_WORLD=1", what,
                  isSolver ? "solver" : "world");
}

void summarise()
{
    if (!settings().hasSummary)
        return;
    writeSummary();
    writeWorlds();
    writeSolvers();
}

constexpr Implementation kImplementation{construct,       adopt,        constructDynamics,
                                         destroyDynamics, keepDynamics, summarise};
}  // namespace
}  // namespace cullet::preload

extern "C" __attribute__((visibility("default"))) const cullet::preload::Implementation*
cullet_preload_implementation()
{
    return &cullet::preload::kImplementation;
}
