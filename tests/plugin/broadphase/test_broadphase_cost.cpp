// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Operations that must cost nothing or little, measured by counts, which are the same on every machine.
#include "cullet/broad/proxy_table.h"
#include "cullet/plugin/pair_cache/pair_cache.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/pair_cache/pair_cache_support.h"
#include "cullet/tests/plugin/pair_sync/fake_backends.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace cullet::test
{
namespace
{
TEST(BroadphaseCost, PassesNoUnchangedBoxToBackend)
{
    Traffic traffic;
    Broadphase broadphase(std::make_unique<CountingBackend>(traffic, makeGridBackend()));
    std::vector<btBroadphaseProxy*> statics;
    for (int i = 0; i < 20000; ++i)
        statics.push_back(addCube(broadphase, vec(3 * (i % 200), 0, 3 * (i / 200)), 0.5, 2, 1));
    std::vector<btBroadphaseProxy*> movers;
    for (int i = 0; i < 20; ++i)
        movers.push_back(addCube(broadphase, vec(3 * i, 0.9, 0)));
    broadphase.calculateOverlappingPairs(nullptr);
    const std::uint64_t before = traffic.dirtyRows;
    for (int step = 0; step < 10; ++step)
    {
        for (int i = 0; i < 20000; ++i)
            moveCube(broadphase, statics[std::size_t(i)], vec(3 * (i % 200), 0, 3 * (i / 200)));
        for (int i = 0; i < 20; ++i)
            moveCube(broadphase, movers[std::size_t(i)], vec(3 * i + 0.01 * (step + 1), 0.9, 0));
        ASSERT_EQ(updatedPairs(broadphase).size(), 20u);
    }
    EXPECT_EQ(traffic.dirtyRows - before, 200u);
    EXPECT_EQ(traffic.restarts, 0u);
}

TEST(BroadphaseCost, TouchesNoRowInUpdateWithoutChanges)
{
    Traffic traffic;
    Broadphase broadphase(std::make_unique<CountingBackend>(traffic));
    for (int i = 0; i < 100; ++i)
        addCube(broadphase, vec(0.9 * i, 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(traffic.dirtyRows, 100u);
    for (int i = 0; i < 10; ++i)
        broadphase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(traffic.dirtyRows, 100u);
    EXPECT_TRUE(traffic.hadFilters);
}

/// Lets all pairs pass.
struct AllowAll : btOverlapFilterCallback
{
    bool needBroadphaseCollision(btBroadphaseProxy*, btBroadphaseProxy*) const override { return true; }
};

TEST(BroadphaseCost, SearchesNoPairWhereBodiesOfOneSpotMoveApart)
{
    AllowAll filter;
    GhostLog ghosts;
    FakeDispatcher dispatcher;
    for (const int bodies : {60, 300, 900})
    {
        for (const int callbacks : {0, 1, 2, 3, 4})
        {
            SCOPED_TRACE(testing::Message() << bodies << " bodies, callbacks " << callbacks);
            PairCache cache;
            cache.setOverlapFilterCallback((callbacks & 1) != 0 ? &filter : nullptr);
            cache.setInternalGhostPairCallback((callbacks & 2) != 0 ? &ghosts : nullptr);
            Broadphase broadphase(&cache);
            std::vector<btBroadphaseProxy*> proxies;
            for (int i = 0; i < bodies; ++i)
                proxies.push_back(addCube(broadphase, vec(0, 0, 0)));
            broadphase.calculateOverlappingPairs(&dispatcher);
            const int pairs = bodies * (bodies - 1) / 2;
            ASSERT_EQ(cache.getNumOverlappingPairs(), pairs);
            // Room for all is made in few steps, and for none besides.
            EXPECT_LE(cache.stats().rehashes, 7u);
            EXPECT_LE(cache.bytes(), 60 * std::uint64_t(pairs) + 8192);
            for (int i = callbacks == 4 ? 0 : pairs; i < pairs; ++i)
                cache.getOverlappingPairArray()[i].m_algorithm = dispatcher.makeAlgorithm();
            for (int i = 0; i < bodies; ++i)
                moveCube(broadphase, proxies[std::size_t(i)], vec(3 * i, 0, 0));
            broadphase.calculateOverlappingPairs(&dispatcher);
            const PairCacheStats stats = cache.stats();
            EXPECT_EQ(stats.pairs, 0u);
            EXPECT_EQ(stats.searched, 0u);
            // Each callback sees the array in which the last pair has taken the place of a removed one.
            EXPECT_LE(stats.moved, callbacks < 2 ? 0u : std::uint64_t(pairs) / 2);
        }
    }
    EXPECT_EQ(ghosts.added.size(), 2u * (1770 + 44850 + 404550));
    EXPECT_EQ(ghosts.removed, ghosts.added);
    EXPECT_EQ(dispatcher.madeCount, 1770 + 44850 + 404550);
    EXPECT_EQ(dispatcher.freedCount, dispatcher.madeCount);
}

TEST(BroadphaseCost, ReservesLittleForPairsThatCallbackRefusesAfterOthers)
{
    /// Lets all pairs of the first ten bodies pass.
    struct AllowFirst : btOverlapFilterCallback
    {
        bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy*) const override
        {
            return a->m_uniqueId <= 10;
        }
    };
    AllowFirst filter;
    PairCache cache;
    cache.setOverlapFilterCallback(&filter);
    Broadphase broadphase(&cache);
    for (int i = 0; i < 400; ++i)
        addCube(broadphase, vec(0, 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    ASSERT_EQ(cache.getNumOverlappingPairs(), 3945);
    EXPECT_LE(cache.bytes(), 8 * 60u * 3945u);
}

TEST(BroadphaseCost, VisitsOnlyOwnPairsOfRemovedBodies)
{
    Broadphase broadphase;
    std::vector<btBroadphaseProxy*> proxies;
    for (int i = 0; i < 20000; ++i)
        proxies.push_back(addCube(broadphase, vec(0.9 * (i % 200), 0.9 * (i / 200), 0)));
    broadphase.calculateOverlappingPairs(nullptr);
    auto* cache = dynamic_cast<PairCache*>(broadphase.getOverlappingPairCache());
    ASSERT_NE(cache, nullptr);
    const int pairsBefore = cache->getNumOverlappingPairs();
    ASSERT_GT(pairsBefore, 70000);
    const std::uint64_t visitedBefore = cache->stats().visited;
    for (int i = 0; i < 20000; i += 10)
        broadphase.destroyProxy(proxies[std::size_t(i)], nullptr);
    const auto removedCount = std::uint64_t(pairsBefore - cache->getNumOverlappingPairs());
    EXPECT_GT(removedCount, 10000u);
    EXPECT_LE(cache->stats().visited - visitedBefore, removedCount + 2000);
    broadphase.calculateOverlappingPairs(nullptr);
}

TEST(BroadphaseCost, BoundsMemoryWithoutUpdatesWhileBodiesAreReplaced)
{
    Broadphase broadphase(bruteOptions());
    std::vector<btBroadphaseProxy*> proxies;
    for (int i = 0; i < 2000; ++i)
        proxies.push_back(addCube(broadphase, vec(2 * i, 0, 0)));
    std::uint64_t bytes = 0;
    for (int round = 0; round < 60; ++round)
    {
        for (int i = 0; i < 2000; ++i)
        {
            broadphase.destroyProxy(proxies[std::size_t(i)], nullptr);
            proxies[std::size_t(i)] = addCube(broadphase, vec(2 * i, 0, 0));
        }
        ASSERT_EQ(boxHits(broadphase, vec(-9, -9, -9), vec(2, 9, 9)).size(), 2u);
        if (round != 5)
            continue;
        // With the tree, which is built eventually.
        while (broadphase.stats().queryTreeBuildsTotal == 0)
            boxHits(broadphase, vec(-9, -9, -9), vec(2, 9, 9));
        bytes = broadphase.stats().bytes;
    }
    EXPECT_LE(broadphase.table().size(), 6000u);
    EXPECT_LE(broadphase.stats().bytes, bytes + bytes / 10);
    EXPECT_EQ(broadphase.stats().updatesTotal, 0u);
    // Then the world is stepped after all.
    moveCube(broadphase, proxies[0], vec(2, 0.5, 0));
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{makePair(idOf(proxies[0]), idOf(proxies[1]))}));
}

TEST(BroadphaseCost, UsesAtMostHalfMoreMemoryThanDbvtInWorldOf100Bodies)
{
    BroadphaseOptions options;
    options.backend = BackendChoice::Grid;
    Broadphase broadphase(options);
    for (int i = 0; i < 100; ++i)
        addCube(broadphase, vec(3.0 * i, 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    const BroadphaseStats stats = broadphase.stats();
    EXPECT_GT(stats.backend.bytes, 0u);
    EXPECT_LE(double(stats.bytes + stats.backend.bytes), 1.5 * double(kDbvtBytesPerBody) * 100);
}

TEST(BroadphaseCost, UsesNoMoreMemoryPerBodyThanDbvt)
{
    Broadphase broadphase(bruteOptions());
    for (int i = 0; i < 100000; ++i)
        addCube(broadphase, vec(3.0 * i, 0, 0));
    EXPECT_LE(double(broadphase.stats().bytes) / 100000, double(kDbvtBytesPerBody));
}
}  // namespace
}  // namespace cullet::test
