// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/preload/stand_in.h"

#include "cullet/preload/message.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <utility>

namespace cullet::preload
{
StandIn::StandIn(std::unique_ptr<Parts> parts) : btDbvtBroadphase(parts->broadphase.getOverlappingPairCache())
{
    begin(parts->counts, parts->broadphase);
    if (parts->fillsTrees)
        parts->trees = std::make_unique<PublicTrees>(m_sets[DYNAMIC_SET]);
    // The spare node of a tree that stays empty: only the tree itself would read this pointer.
    m_sets[FIXED_SET].m_free = reinterpret_cast<btDbvtNode*>(parts.release());
}

StandIn::~StandIn()
{
    const std::unique_ptr<Parts> own(&parts());
    m_sets[FIXED_SET].m_free = nullptr;
    end(own->counts);
}

StandIn::Parts& StandIn::parts() const
{
    return *reinterpret_cast<Parts*>(m_sets[FIXED_SET].m_free);
}

btBroadphaseProxy* StandIn::createProxy(const btVector3& aabbMin, const btVector3& aabbMax, int shapeType,
                                        void* userPtr, int collisionFilterGroup, int collisionFilterMask,
                                        btDispatcher* dispatcher)
{
    btBroadphaseProxy* proxy = parts().broadphase.createProxy(
        aabbMin, aabbMax, shapeType, userPtr, collisionFilterGroup, collisionFilterMask, dispatcher);
    if (parts().trees)
        parts().trees->insert(*proxy);
    BroadphaseCounts& counts = parts().counts;
    counts.mostBodies = std::max(counts.mostBodies, ++counts.bodies);
    return proxy;
}

void StandIn::destroyProxy(btBroadphaseProxy* proxy, btDispatcher* dispatcher)
{
    if (parts().trees)
        parts().trees->remove(*proxy);
    --parts().counts.bodies;
    parts().broadphase.destroyProxy(proxy, dispatcher);
}

void StandIn::setAabb(btBroadphaseProxy* proxy, const btVector3& aabbMin, const btVector3& aabbMax,
                      btDispatcher* dispatcher)
{
    parts().broadphase.setAabb(proxy, aabbMin, aabbMax, dispatcher);
    if (parts().trees)
        parts().trees->update(*proxy);
}

void StandIn::getAabb(btBroadphaseProxy* proxy, btVector3& aabbMin, btVector3& aabbMax) const
{
    parts().broadphase.getAabb(proxy, aabbMin, aabbMax);
}

void StandIn::rayTest(const btVector3& rayFrom, const btVector3& rayTo, btBroadphaseRayCallback& rayCallback,
                      const btVector3& aabbMin, const btVector3& aabbMax)
{
    parts().counts.queries.fetch_add(1, std::memory_order_relaxed);
    parts().broadphase.rayTest(rayFrom, rayTo, rayCallback, aabbMin, aabbMax);
}

void StandIn::aabbTest(const btVector3& aabbMin, const btVector3& aabbMax, btBroadphaseAabbCallback& callback)
{
    parts().counts.queries.fetch_add(1, std::memory_order_relaxed);
    parts().broadphase.aabbTest(aabbMin, aabbMax, callback);
}

void StandIn::calculateOverlappingPairs(btDispatcher* dispatcher)
{
    using Clock = std::chrono::steady_clock;
    Parts& own = parts();
    if (m_paircache != own.broadphase.getOverlappingPairCache())
        warnOfForeignCache();
    const Clock::time_point start = settings().hasSummary ? Clock::now() : Clock::time_point();
    own.broadphase.calculateOverlappingPairs(dispatcher);
    if (!settings().hasSummary)
        return;
    BroadphaseCounts& counts = own.counts;
    counts.updateSeconds += std::chrono::duration<double>(Clock::now() - start).count();
    ++counts.updates;
    counts.mostPairs = std::max<std::uint64_t>(
        counts.mostPairs, own.broadphase.getOverlappingPairCache()->getNumOverlappingPairs());
}

void StandIn::warnOfForeignCache()
{
    if (!std::exchange(parts().hasWarned, true))
        printLine(
            "the program has put another pair cache into btDbvtBroadphase::m_paircache; pairs do not go "
            "there, "
            "set CULLET_BACKEND=dbvt");
}

btOverlappingPairCache* StandIn::getOverlappingPairCache()
{
    return parts().broadphase.getOverlappingPairCache();
}

const btOverlappingPairCache* StandIn::getOverlappingPairCache() const
{
    return parts().broadphase.getOverlappingPairCache();
}

void StandIn::getBroadphaseAabb(btVector3& aabbMin, btVector3& aabbMax) const
{
    parts().broadphase.getBroadphaseAabb(aabbMin, aabbMax);
}

void StandIn::printStats()
{
    parts().broadphase.printStats();
}

void StandIn::resetPool(btDispatcher* dispatcher)
{
    parts().broadphase.resetPool(dispatcher);
}
}  // namespace cullet::preload
