// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Calls of the pair cache from inside its own callbacks.
#include "cullet/plugin/pair_cache/pair_cache.h"
#include "cullet/tests/plugin/pair_cache/pair_cache_support.h"

#include <gtest/gtest.h>

#include <vector>

namespace cullet::test
{
namespace
{
TEST(PairCacheCallbacks, SortNothingWhilePairsAreProcessed)
{
    PairCache cache;
    Proxies proxies(6);
    for (std::size_t i = 1; i < 6; ++i)
        cache.addOverlappingPair(proxies[0], proxies[i]);
    const std::vector<RowPair> before = idsOf(cache);
    Visit visit(
        [&](btBroadphasePair&)
        {
            cache.sortOverlappingPairs(nullptr);
            EXPECT_EQ(idsOf(cache), before);
            return false;
        });
    cache.processAllOverlappingPairs(&visit, nullptr);
    EXPECT_EQ(visit.visited, before) << "each once, in the order of the array";
    cache.sortOverlappingPairs(nullptr);
    EXPECT_EQ(idsOf(cache), std::vector<RowPair>(before.rbegin(), before.rend()));
}

TEST(PairCacheCallbacks, SortNothingWhilePairIsRemoved)
{
    PairCache cache;
    Proxies proxies(6);
    GhostLog ghosts;
    for (std::size_t i = 1; i < 6; ++i)
        cache.addOverlappingPair(proxies[0], proxies[i]);
    ghosts.onRemove = [&](btBroadphaseProxy*, btBroadphaseProxy*) { cache.sortOverlappingPairs(nullptr); };
    cache.setInternalGhostPairCallback(&ghosts);
    cache.removeOverlappingPair(proxies[0], proxies[2], nullptr);
    EXPECT_EQ(idsOf(cache), (std::vector<RowPair>{{1, 2}, {1, 6}, {1, 4}, {1, 5}}));
    EXPECT_TRUE(cache.isConsistent());
}

TEST(PairCacheCallbacks, CleanAllPairsOfProxyWhenDestructorRemovesOne)
{
    for (std::size_t taken = 1; taken < 6; ++taken)
    {
        PairCache cache;
        Proxies proxies(6);
        FakeDispatcher dispatcher;
        for (std::size_t i = 1; i < 6; ++i)
        {
            FakeDispatcher::Algorithm* algorithm = dispatcher.makeAlgorithm();
            if (i == taken)
                algorithm->onDestroy = [&]
                { cache.removeOverlappingPair(proxies[0], proxies[taken], &dispatcher); };
            cache.addOverlappingPair(proxies[0], proxies[i])->m_algorithm = algorithm;
        }
        cache.cleanProxyFromPairs(proxies[0], &dispatcher);
        EXPECT_EQ(dispatcher.destroyedCount, 5) << "the pair with proxy " << taken << " was taken out";
        EXPECT_EQ(dispatcher.freedCount, 5);
        EXPECT_EQ(cache.getNumOverlappingPairs(), 4);
        EXPECT_TRUE(cache.isConsistent());
    }
}

TEST(PairCacheCallbacks, KeepProxyListOfPendingPairWhenNestedOneIsCancelled)
{
    PairCache cache;
    Proxies proxies(3);
    GhostLog ghosts;
    cache.setInternalGhostPairCallback(&ghosts);
    ghosts.onAdd = [&](btBroadphaseProxy* first, btBroadphaseProxy* second)
    {
        if (second == proxies[2])
        {
            cache.removeOverlappingPair(first, second, nullptr);
            return;
        }
        EXPECT_EQ(cache.stats().proxies, 2u);
        EXPECT_EQ(cache.addOverlappingPair(first, proxies[2]), nullptr);
        EXPECT_EQ(cache.stats().proxies, 2u) << "the list of the proxy that both have in common stays";
    };
    EXPECT_NE(cache.addOverlappingPair(proxies[0], proxies[1]), nullptr);
    EXPECT_EQ(cache.stats().proxies, 2u);
    EXPECT_TRUE(cache.isConsistent());
}
}  // namespace
}  // namespace cullet::test
