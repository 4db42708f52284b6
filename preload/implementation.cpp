// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/preload/implementation.h"

#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/isa_gjk.h"
#include "cullet/preload/message.h"
#include "cullet/preload/settings.h"
#include "cullet/preload/stand_in.h"
#include "cullet/preload/summary.h"
#include "cullet/preload/worlds.h"

#include <BulletCollision/CollisionDispatch/btCollisionConfiguration.h>

#include <atomic>
#include <exception>
#include <memory>
#include <new>

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

void summarise()
{
    if (!settings().hasSummary)
        return;
    writeSummary();
    writeWorlds();
}

constexpr Implementation kImplementation{construct,    adopt,     constructWorld,
                                         destroyWorld, keepWorld, summarise};
}  // namespace
}  // namespace cullet::preload

extern "C" __attribute__((visibility("default"))) const cullet::preload::Implementation*
cullet_preload_implementation()
{
    return &cullet::preload::kImplementation;
}
