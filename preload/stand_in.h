// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/broadphase.h"
#include "cullet/preload/public_trees.h"
#include "cullet/preload/settings.h"
#include "cullet/preload/summary.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>

#include <memory>

namespace cullet::preload
{
/// A btDbvtBroadphase of the same size whose virtual functions call a cullet::Broadphase.
///
/// It is created in memory that the program has allocated for Bullet's type. Its public fields have the values that
/// Bullet's constructor stores: m_paircache is the pair cache in use, the trees are empty unless the program needs them
/// (see PublicTrees), and no code reads the others.
class StandIn final : public btDbvtBroadphase
{
public:
    /// The data that does not fit into Bullet's type.
    struct Parts
    {
        Parts(btOverlappingPairCache* cache, const Settings& settings, bool needsTrees)
            : broadphase(cache, settings.broadphase), fillsTrees(settings.fillsTrees.value_or(needsTrees))
        {
        }
        Broadphase broadphase;
        BroadphaseCounts counts;
        bool fillsTrees;
        std::unique_ptr<PublicTrees> trees;
        bool hasWarned = false;
    };

    explicit StandIn(std::unique_ptr<Parts> parts);
    ~StandIn() override;
    StandIn(const StandIn&) = delete;
    StandIn& operator=(const StandIn&) = delete;

    btBroadphaseProxy* createProxy(const btVector3& aabbMin, const btVector3& aabbMax, int shapeType,
                                   void* userPtr, int collisionFilterGroup, int collisionFilterMask,
                                   btDispatcher* dispatcher) override;
    void destroyProxy(btBroadphaseProxy* proxy, btDispatcher* dispatcher) override;
    void setAabb(btBroadphaseProxy* proxy, const btVector3& aabbMin, const btVector3& aabbMax,
                 btDispatcher* dispatcher) override;
    void getAabb(btBroadphaseProxy* proxy, btVector3& aabbMin, btVector3& aabbMax) const override;
    void rayTest(const btVector3& rayFrom, const btVector3& rayTo, btBroadphaseRayCallback& rayCallback,
                 const btVector3& aabbMin, const btVector3& aabbMax) override;
    void aabbTest(const btVector3& aabbMin, const btVector3& aabbMax,
                  btBroadphaseAabbCallback& callback) override;
    void calculateOverlappingPairs(btDispatcher* dispatcher) override;
    btOverlappingPairCache* getOverlappingPairCache() override;
    const btOverlappingPairCache* getOverlappingPairCache() const override;
    void getBroadphaseAabb(btVector3& aabbMin, btVector3& aabbMax) const override;
    void printStats() override;
    void resetPool(btDispatcher* dispatcher) override;

private:
    Parts& parts() const;
    void warnOfForeignCache();
};

static_assert(sizeof(StandIn) == sizeof(btDbvtBroadphase), "the program has taken no more memory");
static_assert(alignof(StandIn) == alignof(btDbvtBroadphase), "the program has aligned its memory for Bullet");
}  // namespace cullet::preload
