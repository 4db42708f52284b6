// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_cache/pair_cache.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <btBulletCollisionCommon.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
/// Counts the calls of a ghost pair callback; the balance is the number of pairs.
struct CountingGhosts final : btOverlappingPairCallback
{
    btBroadphasePair* addOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b) override
    {
        EXPECT_LT(a->m_uniqueId, b->m_uniqueId);
        ++addedCount;
        return nullptr;
    }
    void* removeOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b, btDispatcher*) override
    {
        EXPECT_LT(a->m_uniqueId, b->m_uniqueId);
        ++removedCount;
        return nullptr;
    }
    void removeOverlappingPairsContainingProxy(btBroadphaseProxy*, btDispatcher*) override
    {
        ADD_FAILURE() << "Bullet's callback asserts that nobody calls this";
    }
    int addedCount = 0;
    int removedCount = 0;
};

/// Removes pairs like an application, through the cache's own traversal.
struct RemoveAll final : btOverlapCallback
{
    bool processOverlap(btBroadphasePair&) override { return true; }
};

/// A narrow phase with real algorithms, so that removal errors cause leaks or crashes.
struct NarrowPhase
{
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
};

struct Spheres
{
    explicit Spheres(int count) : shape(btScalar(0.5))
    {
        for (int i = 0; i < count; ++i)
        {
            objects.push_back(std::make_unique<btCollisionObject>());
            objects.back()->setCollisionShape(&shape);
        }
    }
    btSphereShape shape;
    std::vector<std::unique_ptr<btCollisionObject>> objects;
};

template <class Cache>
class BroadphaseStockCache : public testing::Test
{
};
using StockCaches = testing::Types<btHashedOverlappingPairCache, btSortedOverlappingPairCache, PairCache>;
TYPED_TEST_SUITE(BroadphaseStockCache, StockCaches);

TYPED_TEST(BroadphaseStockCache, ReceivesPairsAndOutlivesBroadphase)
{
    TypeParam cache;
    {
        Broadphase broadphase(&cache, bruteOptions());
        EXPECT_EQ(broadphase.getOverlappingPairCache(), &cache);
        std::vector<btBroadphaseProxy*> proxies;
        for (int i = 0; i < 20; ++i)
            proxies.push_back(addCube(broadphase, vec(0.9 * i, 0, 0)));
        EXPECT_EQ(updatedPairs(broadphase).size(), 19u);
        moveCube(broadphase, proxies[10], vec(0, 50, 0));
        EXPECT_EQ(updatedPairs(broadphase).size(), 17u);
        broadphase.destroyProxy(proxies[5], nullptr);
        EXPECT_EQ(pairsOf(broadphase).size(), 15u);
        moveCube(broadphase, proxies[10], vec(9, 0, 0));
        EXPECT_EQ(updatedPairs(broadphase).size(), 17u);
        EXPECT_EQ(broadphase.stats().restartsTotal, 0u);
        for (btBroadphaseProxy* proxy : proxies)
        {
            if (proxy != proxies[5])
                broadphase.destroyProxy(proxy, nullptr);
        }
    }
    EXPECT_EQ(static_cast<btOverlappingPairCache&>(cache).getNumOverlappingPairs(), 0);
}

TYPED_TEST(BroadphaseStockCache, ReportsEachTransitionToGhostCallbackOnce)
{
    TypeParam cache;
    CountingGhosts ghosts;
    btOverlappingPairCache& base = cache;
    base.setInternalGhostPairCallback(&ghosts);
    Broadphase broadphase(&cache, bruteOptions());
    btBroadphaseProxy* a = addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* b = addCube(broadphase, vec(0.5, 0, 0));
    addCube(broadphase, vec(-0.5, 0, 0));
    for (int i = 0; i < 3; ++i)
        broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(ghosts.addedCount, 3);
    moveCube(broadphase, b, vec(9, 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(ghosts.removedCount, 2);
    broadphase.destroyProxy(a, nullptr);
    EXPECT_EQ(ghosts.removedCount, 3);
    EXPECT_EQ(ghosts.addedCount, 3);
    EXPECT_EQ(base.getNumOverlappingPairs(), 0);
}

TYPED_TEST(BroadphaseStockCache, RemovesPairsWithAlgorithmsWithAndWithoutDispatcher)
{
    NarrowPhase narrow;
    Spheres spheres(3);
    TypeParam cache;
    Broadphase broadphase(&cache, bruteOptions());
    btOverlappingPairCache& base = cache;
    std::vector<btBroadphaseProxy*> proxies;
    for (int i = 0; i < 3; ++i)
    {
        proxies.push_back(addCube(broadphase, vec(0.4 * i, 0, 0), 0.5, 1, kAllGroups,
                                  spheres.objects[std::size_t(i)].get()));
        spheres.objects[std::size_t(i)]->setBroadphaseHandle(proxies.back());
    }
    broadphase.calculateOverlappingPairs(&narrow.dispatcher);
    narrow.dispatcher.dispatchAllCollisionPairs(&base, btDispatcherInfo(), &narrow.dispatcher);
    ASSERT_EQ(narrow.dispatcher.getNumManifolds(), 3);
    moveCube(broadphase, proxies[2], vec(9, 0, 0));
    broadphase.calculateOverlappingPairs(&narrow.dispatcher);
    EXPECT_EQ(base.getNumOverlappingPairs(), 1);
    EXPECT_EQ(narrow.dispatcher.getNumManifolds(), 1) << "the algorithms of removed pairs are destroyed";
    moveCube(broadphase, proxies[1], vec(0, 9, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(base.getNumOverlappingPairs(), 0);
    for (btBroadphaseProxy* proxy : proxies)
        broadphase.destroyProxy(proxy, nullptr);
}

TYPED_TEST(BroadphaseStockCache, RegainsUserRemovedPairOnceItsBoxMovesEnough)
{
    TypeParam cache;
    btOverlappingPairCache& base = cache;
    Broadphase broadphase(&cache, bruteOptions());
    addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* b = addCube(broadphase, vec(0.5, 0, 0));
    addCube(broadphase, vec(0, 50, 0));
    addCube(broadphase, vec(0, 50.5, 0));
    ASSERT_EQ(updatedPairs(broadphase).size(), 2u);
    RemoveAll removeAll;
    base.processAllOverlappingPairs(&removeAll, nullptr);
    ASSERT_EQ(base.getNumOverlappingPairs(), 0);
    for (int i = 0; i < 3; ++i)
        EXPECT_EQ(updatedPairs(broadphase), Pairs{});
    EXPECT_EQ(broadphase.stats().pendingPairs, 2u);
    moveCube(broadphase, b, vec(0.52, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase), Pairs{}) << "not far enough";
    moveCube(broadphase, b, vec(0.7, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}}));
    moveCube(broadphase, b, vec(9, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase), Pairs{});
}

TYPED_TEST(BroadphaseStockCache, KeepsUserRemovedPairOutWhileOtherPairsAreAdded)
{
    TypeParam cache;
    btOverlappingPairCache& base = cache;
    Broadphase broadphase(&cache, bruteOptions());
    addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* b = addCube(broadphase, vec(0.5, 0, 0));
    btBroadphaseProxy* comer = addCube(broadphase, vec(0, 50, 0));
    ASSERT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}}));
    RemoveAll removeAll;
    base.processAllOverlappingPairs(&removeAll, nullptr);
    // Another pair is added in the same update.
    moveCube(broadphase, comer, vec(-0.7, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 3}}));
    for (int step = 1; step <= 4; ++step)
    {
        moveCube(broadphase, b, vec(0.5 + 0.001 * step, 0, 0));
        EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 3}})) << step;
    }
    moveCube(broadphase, b, vec(0.7, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}, {1, 3}}));
}

TYPED_TEST(BroadphaseStockCache, RegainsUserRemovedPairOfTeleportedBodyInUpdate)
{
    TypeParam cache;
    btOverlappingPairCache& base = cache;
    Broadphase broadphase(&cache, bruteOptions());
    btBroadphaseProxy* ground = addCube(broadphase, vec(0, 0, 0), 50);
    btBroadphaseProxy* ball = addCube(broadphase, vec(0, 50.5, 0));
    ASSERT_TRUE((updatedPairs(broadphase), hasPair(broadphase, ground, ball)));
    for (int jump = 1; jump <= 4; ++jump)
    {
        base.removeOverlappingPair(ground, ball, nullptr);
        moveCube(broadphase, ball, vec(10 * jump, 50.5, 0));
        EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}})) << jump;
    }
}

TYPED_TEST(BroadphaseStockCache, LosesPairThatUserRemovedAndReaddedWhenBoxesSeparate)
{
    TypeParam cache;
    btOverlappingPairCache& base = cache;
    Broadphase broadphase(&cache, bruteOptions());
    btBroadphaseProxy* a = addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* b = addCube(broadphase, vec(0.5, 0, 0));
    ASSERT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}}));
    RemoveAll removeAll;
    base.processAllOverlappingPairs(&removeAll, nullptr);
    ASSERT_EQ(updatedPairs(broadphase), Pairs{});
    base.addOverlappingPair(a, b);
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}}));
    moveCube(broadphase, b, vec(9, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase), Pairs{});
}

TYPED_TEST(BroadphaseStockCache, LosesUserAddedPairWhenItsBoxesAreApart)
{
    TypeParam cache;
    btOverlappingPairCache& base = cache;
    Broadphase broadphase(&cache, bruteOptions());
    btBroadphaseProxy* a = addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* b = addCube(broadphase, vec(9, 0, 0));
    btBroadphaseProxy* c = addCube(broadphase, vec(0.5, 0, 0));
    ASSERT_EQ(updatedPairs(broadphase), (Pairs{{1, 3}}));
    base.addOverlappingPair(a, b);
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 3}}));
    EXPECT_TRUE(hasPair(broadphase, a, c));
}

TEST(BroadphaseCaches, DetectUserRemovalWhenUserAddsAsManyPairs)
{
    Broadphase broadphase(bruteOptions());
    btOverlappingPairCache& cache = *broadphase.getOverlappingPairCache();
    btBroadphaseProxy* a = addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* b = addCube(broadphase, vec(0.5, 0, 0));
    btBroadphaseProxy* c = addCube(broadphase, vec(50, 0, 0));
    btBroadphaseProxy* d = addCube(broadphase, vec(80, 0, 0));
    ASSERT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}}));
    cache.removeOverlappingPair(a, b, nullptr);
    cache.addOverlappingPair(c, d);
    EXPECT_EQ(updatedPairs(broadphase), Pairs{}) << "one was taken out, the other one's boxes are apart";
    moveCube(broadphase, b, vec(-0.5, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}}));
}

TEST(BroadphaseCaches, DetectPairRemovedByCallbackDuringUpdate)
{
    struct Remover final : btOverlappingPairCallback
    {
        btBroadphasePair* addOverlappingPair(btBroadphaseProxy*, btBroadphaseProxy*) override
        {
            if (a != nullptr)
                cache->removeOverlappingPair(a, b, nullptr);
            a = nullptr;
            return nullptr;
        }
        void* removeOverlappingPair(btBroadphaseProxy*, btBroadphaseProxy*, btDispatcher*) override
        {
            return nullptr;
        }
        void removeOverlappingPairsContainingProxy(btBroadphaseProxy*, btDispatcher*) override {}
        btOverlappingPairCache* cache = nullptr;
        btBroadphaseProxy *a = nullptr, *b = nullptr;
    } remover;
    Broadphase broadphase(bruteOptions());
    remover.cache = broadphase.getOverlappingPairCache();
    btBroadphaseProxy* a = addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* b = addCube(broadphase, vec(0.5, 0, 0));
    btBroadphaseProxy* c = addCube(broadphase, vec(50, 0, 0));
    addCube(broadphase, vec(60, 0, 0));
    ASSERT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}}));
    remover.cache->setInternalGhostPairCallback(&remover);
    remover.a = a;
    remover.b = b;
    moveCube(broadphase, c, vec(60.5, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{3, 4}}));
    moveCube(broadphase, b, vec(-0.5, 0, 0));
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}, {3, 4}}));
    remover.cache->setInternalGhostPairCallback(nullptr);
}

TEST(BroadphaseCaches, HoldNoPairsInCacheOrBackendForNullPairCache)
{
    btNullPairCache cache;
    Broadphase broadphase(&cache, bruteOptions());
    std::vector<btBroadphaseProxy*> proxies;
    for (int i = 0; i < 100; ++i)
        proxies.push_back(addCube(broadphase, vec(0.1 * i, 0, 0)));
    for (int step = 0; step < 5; ++step)
    {
        moveCube(broadphase, proxies[0], vec(step, 0, 0));
        broadphase.calculateOverlappingPairs(nullptr);
    }
    EXPECT_EQ(broadphase.stats().pairs, 0u);
    EXPECT_EQ(broadphase.stats().pendingPairs, 0u);
    EXPECT_EQ(broadphase.stats().backend.pairs, 0u);
    EXPECT_EQ(boxHits(broadphase, vec(-1, -1, -1), vec(99, 1, 1)).size(), 100u);
    for (btBroadphaseProxy* proxy : proxies)
        broadphase.destroyProxy(proxy, nullptr);
}

TEST(BroadphaseCaches, ServeWorldFromExternalHashedCache)
{
    NarrowPhase narrow;
    btHashedOverlappingPairCache cache;
    Broadphase broadphase(&cache);
    Spheres spheres(10);
    {
        btCollisionWorld world(&narrow.dispatcher, &broadphase, &narrow.configuration);
        EXPECT_EQ(world.getPairCache(), &cache);
        for (std::size_t i = 0; i < spheres.objects.size(); ++i)
        {
            spheres.objects[i]->getWorldTransform().setOrigin(vec(0.8 * double(i), 0, 0));
            world.addCollisionObject(spheres.objects[i].get());
        }
        world.performDiscreteCollisionDetection();
        EXPECT_EQ(cache.getNumOverlappingPairs(), 9);
        EXPECT_EQ(narrow.dispatcher.getNumManifolds(), 9);
    }
    EXPECT_EQ(cache.getNumOverlappingPairs(), 0);
    EXPECT_EQ(narrow.dispatcher.getNumManifolds(), 0);
}
}  // namespace
}  // namespace cullet::test
