// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_cache/pair_cache.h"
#include "cullet/tests/plugin/pair_cache/pair_cache_support.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>

namespace cullet::test
{
namespace
{
/// Pairs of each proxy with the next `perProxy` ones.
void addNeighbours(PairCache& cache, Proxies& proxies, std::size_t perProxy)
{
    for (std::size_t i = 0; i < proxies.size(); ++i)
        for (std::size_t k = 1; k <= perProxy && i + k < proxies.size(); ++k)
            cache.addPairUnfiltered(proxies[i], proxies[i + k]);
}

void expectShortProbes(const PairCache& cache, std::uint64_t pairs)
{
    const PairCacheStats stats = cache.stats();
    EXPECT_GE(stats.pairs, pairs);
    EXPECT_LE(stats.load, 0.7);
    EXPECT_LE(stats.longestProbe, 16u);
    EXPECT_LE(stats.meanProbe, 1.1);
}

TEST(PairCacheCost, KeepsProbesShortForIdsInSteps)
{
    for (const int shift : {0, 1, 4, 8, 12, 16})
    {
        SCOPED_TRACE(testing::Message() << "step 2^" << shift);
        PairCache cache;
        Proxies proxies;
        for (int i = 1; i <= 30000; ++i)
            proxies.add(i << shift);
        addNeighbours(cache, proxies, 5);
        expectShortProbes(cache, 149000);
    }
}

TEST(PairCacheCost, KeepsProbesShortForHubAndForGridOfIds)
{
    PairCache hub;
    Proxies proxies(120000);
    for (std::size_t i = 1; i < proxies.size(); ++i)
        hub.addPairUnfiltered(proxies[0], proxies[i]);
    expectShortProbes(hub, 119999);

    // Every id of one range with every id of another, whose strides interfere in the upper and lower half of the key.
    PairCache square;
    Proxies rows;
    Proxies columns;
    for (int i = 0; i < 350; ++i)
    {
        rows.add((i + 1) * 65536);
        columns.add((i + 1) * 65536 + 32768);
    }
    for (std::size_t i = 0; i < 350; ++i)
        for (std::size_t k = 0; k < 350; ++k)
            square.addPairUnfiltered(rows[i], columns[k]);
    expectShortProbes(square, 350 * 350);
}

TEST(PairCacheCost, ReachesLoadOfSevenTenthsBeforeItMakesRoom)
{
    PairCache cache;
    Proxies proxies(2000);
    std::uint64_t rehashes = 0;
    for (std::size_t i = 1; i < proxies.size(); ++i)
    {
        const PairCacheStats before = cache.stats();
        cache.addPairUnfiltered(proxies[0], proxies[i]);
        if (cache.stats().rehashes == before.rehashes || before.pairs == 0)
            continue;
        ++rehashes;
        EXPECT_DOUBLE_EQ(before.load, 0.7) << before.pairs << " pairs in " << before.slots << " slots";
    }
    EXPECT_GE(rehashes, 3u);
}

TEST(PairCacheCost, VisitsOnlyOwnPairsOfRemovedProxies)
{
    PairCache cache;
    Proxies proxies(100000);
    addNeighbours(cache, proxies, 3);
    const int pairs = cache.getNumOverlappingPairs();
    FakeDispatcher dispatcher;
    const std::uint64_t before = cache.stats().visited;
    for (std::size_t i = 0; i < proxies.size(); i += 10)
    {
        cache.cleanProxyFromPairs(proxies[i], &dispatcher);
        cache.removeOverlappingPairsContainingProxy(proxies[i], &dispatcher);
    }
    const auto removed = static_cast<std::uint64_t>(pairs - cache.getNumOverlappingPairs());
    EXPECT_GE(removed, 59990u);
    EXPECT_EQ(cache.stats().visited - before, 2 * removed);
    EXPECT_TRUE(cache.isConsistent());
}

TEST(PairCacheCost, SortsForOrderedPassesAgainOnlyWhenPairsHaveChanged)
{
    PairCache cache;
    Proxies proxies(20);
    addNeighbours(cache, proxies, 3);
    btDispatcherInfo ordered;
    ordered.m_deterministicOverlappingPairs = true;
    int room = 0;
    // A sort needs memory for as many pairs as the array has room for. So room given to the array before a pass shows
    // whether the pass has sorted.
    const auto hasSorted = [&]
    {
        room += 1000;
        cache.getOverlappingPairArray().reserve(room);
        const std::uint64_t before = cache.bytes();
        Visit visit([](btBroadphasePair&) { return false; });
        cache.processAllOverlappingPairs(&visit, nullptr, ordered);
        EXPECT_EQ(visit.visited.size(), static_cast<std::size_t>(cache.getNumOverlappingPairs()));
        EXPECT_TRUE(std::is_sorted(visit.visited.rbegin(), visit.visited.rend()));
        return cache.bytes() > before;
    };
    EXPECT_TRUE(hasSorted());
    EXPECT_FALSE(hasSorted());
    cache.addOverlappingPair(proxies[0], proxies[19]);
    EXPECT_TRUE(hasSorted());
    EXPECT_FALSE(hasSorted());
    cache.addOverlappingPair(proxies[19], proxies[0]);
    cache.removeOverlappingPair(proxies[0], proxies[18], nullptr);
    cache.findPair(proxies[0], proxies[1])->m_internalInfo1 = &cache;
    EXPECT_FALSE(hasSorted()) << "a pair that is there, one that is not, and what the application writes";
    cache.removeOverlappingPair(proxies[3], proxies[4], nullptr);
    EXPECT_TRUE(hasSorted());
    EXPECT_FALSE(hasSorted());
    cache.removeOverlappingPairsContainingProxy(proxies[7], nullptr);
    EXPECT_TRUE(hasSorted());
    EXPECT_FALSE(hasSorted());
}

TEST(PairCacheCost, TakesLessThanSixtyBytesPerPair)
{
    PairCache cache;
    Proxies proxies(60000);
    cache.reserve(10 * proxies.size());
    addNeighbours(cache, proxies, 10);
    const auto pairs = static_cast<double>(cache.getNumOverlappingPairs());
    ASSERT_GT(pairs, 599000.0);
    EXPECT_GT(static_cast<double>(cache.bytes()), 32.0 * pairs);
    EXPECT_LT(static_cast<double>(cache.bytes()), 60.0 * pairs);
}

TEST(PairCacheCost, BoundsMemoryByLivingProxiesWhenIdsGrow)
{
    PairCache cache;
    Random random(5);
    std::vector<btBroadphaseProxy> proxies(1000);
    int id = 0;
    std::uint64_t most = 0;
    for (int generation = 0; generation < 300; ++generation)
    {
        for (btBroadphaseProxy& proxy : proxies)
        {
            if (generation > 0)
                cache.removeOverlappingPairsContainingProxy(&proxy, nullptr);
            proxy.m_uniqueId = ++id;
        }
        for (std::size_t i = 0; i < 3000; ++i)
        {
            const std::uint32_t b = random.below(1000), a = random.below(1000);
            cache.addPairUnfiltered(&proxies[a], &proxies[b]);
        }
        if (generation == 10)
            most = cache.bytes();
    }
    EXPECT_EQ(id, 300000);
    EXPECT_LE(cache.stats().proxies, 1000u);
    EXPECT_LT(cache.bytes(), most + most / 4);
}
}  // namespace
}  // namespace cullet::test
