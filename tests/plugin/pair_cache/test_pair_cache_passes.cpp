// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/core/proxy_ids.h"
#include "cullet/plugin/pair_cache/pair_cache.h"
#include "cullet/tests/plugin/pair_cache/pair_cache_support.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <climits>
#include <set>
#include <stdexcept>
#include <utility>

namespace cullet::test
{
namespace
{
TEST(PairCache, VisitsTheSwappedInPairNextWhenThePassRemovesOne)
{
    PairCache cache;
    Proxies proxies(5);
    for (std::size_t i = 1; i < 5; ++i)
        cache.addOverlappingPair(proxies[0], proxies[i]);
    Visit visit([&](btBroadphasePair& pair) { return pair.m_pProxy1 == proxies[2]; });
    cache.processAllOverlappingPairs(&visit, nullptr);
    EXPECT_EQ(visit.visited, (std::vector<RowPair>{{1, 2}, {1, 3}, {1, 5}, {1, 4}}));
    EXPECT_EQ(idsOf(cache), (std::vector<RowPair>{{1, 2}, {1, 5}, {1, 4}}));
}

TEST(PairCache, VisitsPairsAddedDuringThePassAtItsEnd)
{
    PairCache cache;
    Proxies proxies(200);
    cache.addOverlappingPair(proxies[0], proxies[1]);
    std::size_t next = 2;
    Visit visit(
        [&](btBroadphasePair&)
        {
            // Enough pairs to reallocate the array several times.
            if (next < proxies.size())
                cache.addOverlappingPair(proxies[0], proxies[next++]);
            return false;
        });
    cache.processAllOverlappingPairs(&visit, nullptr);
    EXPECT_EQ(visit.visited.size(), 199u);
    EXPECT_EQ(visit.visited, idsOf(cache));
}

TEST(PairCache, GoesOnWhenACallbackRemovesItsOwnPair)
{
    for (const bool answer : {false, true})
    {
        PairCache cache;
        Proxies proxies(8);
        addAllPairs(cache, proxies, 8);
        Visit visit(
            [&](btBroadphasePair& pair)
            {
                if (pair.m_pProxy0 == proxies[1])
                {
                    cache.removeOverlappingPair(pair.m_pProxy0, pair.m_pProxy1, nullptr);
                    return answer;
                }
                return false;
            });
        cache.processAllOverlappingPairs(&visit, nullptr);
        const std::set<RowPair> distinct(visit.visited.begin(), visit.visited.end());
        EXPECT_EQ(visit.visited.size(), 28u);
        EXPECT_EQ(distinct.size(), 28u);
        EXPECT_EQ(cache.getNumOverlappingPairs(), 28 - 6);
        EXPECT_TRUE(cache.isConsistent());
    }
}

TEST(PairCache, RemovesTheVisitedPairThatTheCallbackMoved)
{
    for (const bool isOrdered : {false, true})
    {
        PairCache cache;
        Proxies proxies(4);
        for (std::size_t i = 1; i < 4; ++i)
            cache.addOverlappingPair(proxies[0], proxies[i]);
        Visit visit(
            [&](btBroadphasePair& pair)
            {
                if (pair.m_pProxy1 != proxies[3])
                    return false;
                // The last pair, (1, 4), takes the place of (1, 2).
                cache.removeOverlappingPair(proxies[0], proxies[1], nullptr);
                return true;
            });
        cache.processAllOverlappingPairs(&visit, nullptr, isOrdered ? deterministic() : btDispatcherInfo());
        EXPECT_EQ(idsOf(cache), (std::vector<RowPair>{{1, 3}}));
        EXPECT_TRUE(cache.isConsistent());
    }
}

TEST(PairCache, VisitsNoPairTwiceWhenCallbacksRemoveEarlierPairs)
{
    PairCache cache;
    Proxies proxies(20);
    addAllPairs(cache, proxies, 20);
    std::size_t removedEarlier = 0;
    Visit visit(
        [&](btBroadphasePair& pair)
        {
            const bool isLast = pair.m_pProxy0 ==
                                cache.getOverlappingPairArray()[cache.getNumOverlappingPairs() - 1].m_pProxy0;
            if (pair.m_pProxy1->m_uniqueId % 5 == 0 || isLast)
            {
                const btBroadphasePair first = cache.getOverlappingPairArray()[0];
                const bool isSelf = &pair == cache.getOverlappingPairArrayPtr();
                cache.removeOverlappingPair(first.m_pProxy0, first.m_pProxy1, nullptr);
                removedEarlier += isSelf ? 0 : 1;
            }
            return false;
        });
    cache.processAllOverlappingPairs(&visit, nullptr);
    const std::set<RowPair> distinct(visit.visited.begin(), visit.visited.end());
    EXPECT_EQ(distinct.size(), visit.visited.size());
    EXPECT_GT(removedEarlier, 10u);
    EXPECT_LT(removedEarlier, 100u);
    EXPECT_GE(visit.visited.size() + removedEarlier, 190u) << "each earlier removal costs one visit at most";
    EXPECT_TRUE(cache.isConsistent());
}

TEST(PairCache, ProcessesInDescendingOrderOfIdsWhenAskedTo)
{
    PairCache cache;
    Proxies proxies;
    // Bullet's ids are int: those from 2^31 on are the lowest.
    for (const int id : {70000, -1, 3, 1 << 30, INT_MIN, 12, 4096, INT_MIN + 5, 5000, INT_MAX})
        proxies.add(id);
    addAllPairs(cache, proxies, proxies.size());
    std::vector<RowPair> expected = idsOf(cache);
    const std::vector<RowPair> inArray = expected;
    std::sort(expected.rbegin(), expected.rend());
    ASSERT_NE(expected, inArray);

    Visit visit(keep);
    cache.processAllOverlappingPairs(&visit, nullptr, deterministic());
    EXPECT_EQ(visit.visited, expected);
    EXPECT_EQ(idsOf(cache), inArray) << "the array keeps its order";
    Visit plain(keep);
    cache.processAllOverlappingPairs(&plain, nullptr, btDispatcherInfo());
    EXPECT_EQ(plain.visited, inArray);
    cache.sortOverlappingPairs(nullptr);
    EXPECT_EQ(idsOf(cache), expected);
}

TEST(PairCache, ProcessesInOrderEveryPairThatIsStillThereWhenCallbacksRemove)
{
    PairCache cache;
    Proxies proxies(30);
    addAllPairs(cache, proxies, 30);
    std::vector<RowPair> expected = idsOf(cache);
    std::sort(expected.rbegin(), expected.rend());
    // Of the pairs (a, b): a divisible by 3 is removed by the answer, (a, 30) removes (a - 1, 29) ahead of its visit,
    // and added pairs are visited in the next pass.
    const auto isRemovedAhead = [](RowPair ids) { return ids.second == 29; };
    expected.erase(std::remove_if(expected.begin(), expected.end(), isRemovedAhead), expected.end());
    Visit visit(
        [&](btBroadphasePair& pair)
        {
            const RowPair ids = idsOf(pair);
            if (ids.second == 30 && ids.first > 1)
                cache.removePair({static_cast<std::uint32_t>(ids.first - 1), 29}, nullptr);
            if (ids.second == 30)
                cache.addOverlappingPair(proxies[static_cast<std::size_t>(ids.first - 1)],
                                         proxies.add(1000 - ids.first));
            return ids.first % 3 == 0;
        });
    cache.processAllOverlappingPairs(&visit, nullptr, deterministic());
    EXPECT_EQ(visit.visited, expected);
    EXPECT_TRUE(cache.isConsistent());
    for (const RowPair& ids : idsOf(cache))
        EXPECT_TRUE(ids.first % 3 != 0 || ids.second > 900);
}

TEST(PairCache, VisitsReturnedPairOnceInOrderedPassWhenItComesBackBeforeItsTurn)
{
    PairCache cache;
    Proxies proxies(4);
    FakeDispatcher dispatcher;
    addAllPairs(cache, proxies, 4);
    const auto renew = [&](std::size_t a, std::size_t b)
    {
        cache.removeOverlappingPair(proxies[a], proxies[b], &dispatcher);
        cache.addOverlappingPair(proxies[a], proxies[b])->m_algorithm = dispatcher.makeAlgorithm();
    };
    int renewedCount = 0;
    Visit visit(
        [&](btBroadphasePair& pair)
        {
            const bool isRenewed = idsOf(pair) == RowPair{1, 2};
            EXPECT_EQ(pair.m_algorithm != nullptr, isRenewed) << "the visit is for the pair that came back";
            renewedCount += isRenewed;
            if (idsOf(pair) == RowPair{2, 3})
            {
                renew(2, 3);  // visited before
                renew(1, 2);  // this one
                renew(0, 1);  // not yet visited
            }
            return false;
        });
    cache.processAllOverlappingPairs(&visit, &dispatcher, deterministic());
    EXPECT_EQ(visit.visited, (std::vector<RowPair>{{3, 4}, {2, 4}, {2, 3}, {1, 4}, {1, 3}, {1, 2}}));
    EXPECT_EQ(renewedCount, 1);
    for (std::size_t i = 0; i < 4; ++i)
        cache.removeOverlappingPairsContainingProxy(proxies[i], &dispatcher);
    EXPECT_EQ(dispatcher.freedCount, 3);
}

TEST(PairCache, ProcessesNestedOrderedPassesCorrectlyAfterChanges)
{
    PairCache cache;
    Proxies proxies(40);
    addAllPairs(cache, proxies, 20);
    for (int round = 0; round < 4; ++round)
    {
        Visit outer(keep);
        Visit inner(keep);
        Visit nesting(
            [&](btBroadphasePair&)
            {
                if (inner.visited.empty())
                    cache.processAllOverlappingPairs(&inner, nullptr, deterministic());
                return false;
            });
        cache.processAllOverlappingPairs(&outer, nullptr, deterministic());
        cache.processAllOverlappingPairs(&nesting, nullptr, deterministic());
        std::vector<RowPair> expected = idsOf(cache);
        std::sort(expected.rbegin(), expected.rend());
        EXPECT_EQ(outer.visited, expected);
        EXPECT_EQ(nesting.visited, expected);
        EXPECT_EQ(inner.visited, expected);
        if (round == 1)
            cache.addOverlappingPair(proxies[30], proxies[31]);
        if (round == 2)
            cache.removeOverlappingPair(proxies[3], proxies[7], nullptr);
    }
}

TEST(PairCache, VisitsNoLeavingPairInOrderedPassOfItsGhostCallback)
{
    PairCache cache;
    Proxies proxies(5);
    addAllPairs(cache, proxies, 5);
    Visit before(keep), during(keep);
    cache.processAllOverlappingPairs(&before, nullptr, deterministic());
    GhostLog ghosts;
    ghosts.onRemove = [&](btBroadphaseProxy*, btBroadphaseProxy*)
    { cache.processAllOverlappingPairs(&during, nullptr, deterministic()); };
    cache.setInternalGhostPairCallback(&ghosts);
    cache.removeOverlappingPair(proxies[1], proxies[3], nullptr);
    EXPECT_EQ(ghosts.removed, (std::vector<RowPair>{{2, 4}}));
    std::vector<RowPair> expected = before.visited;
    ASSERT_EQ(expected.size(), 10u);
    expected.erase(std::find(expected.begin(), expected.end(), RowPair{2, 4}));
    EXPECT_EQ(during.visited, expected);
}
}  // namespace
}  // namespace cullet::test
