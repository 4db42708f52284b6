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
bool keep(btBroadphasePair&)
{
    return false;
}

/// Every pair of the first `count` proxies.
void addAllPairs(PairCache& cache, Proxies& proxies, std::size_t count)
{
    for (std::size_t a = 0; a < count; ++a)
        for (std::size_t b = a + 1; b < count; ++b)
            cache.addOverlappingPair(proxies[a], proxies[b]);
}

btDispatcherInfo deterministic()
{
    btDispatcherInfo info;
    info.m_deterministicOverlappingPairs = true;
    return info;
}

TEST(PairCache, IsEmptyAtFirst)
{
    PairCache cache;
    Proxies proxies(2);
    const PairCache& constant = cache;
    EXPECT_EQ(cache.getNumOverlappingPairs(), 0);
    EXPECT_EQ(cache.getOverlappingPairArrayPtr(), nullptr);
    EXPECT_EQ(constant.getOverlappingPairArrayPtr(), nullptr);
    EXPECT_EQ(cache.findPair(proxies[0], proxies[1]), nullptr);
    EXPECT_EQ(cache.removeOverlappingPair(proxies[0], proxies[1], nullptr), nullptr);
    EXPECT_FALSE(cache.hasDeferredRemoval());
    cache.removeOverlappingPairsContainingProxy(proxies[0], nullptr);
    cache.sortOverlappingPairs(nullptr);
    EXPECT_TRUE(cache.isConsistent());
}

TEST(PairCache, StoresTheLowerIdFirstAndStartsThePairBlank)
{
    PairCache cache;
    Proxies proxies(2);
    btBroadphasePair* pair = cache.addOverlappingPair(proxies[1], proxies[0]);
    ASSERT_NE(pair, nullptr);
    EXPECT_EQ(pair->m_pProxy0, proxies[0]);
    EXPECT_EQ(pair->m_pProxy1, proxies[1]);
    EXPECT_EQ(pair->m_algorithm, nullptr);
    EXPECT_EQ(pair->m_internalInfo1, nullptr);
    EXPECT_EQ(cache.addOverlappingPair(proxies[0], proxies[1]), pair);
    EXPECT_EQ(cache.findPair(proxies[1], proxies[0]), pair);
    EXPECT_EQ(cache.findPair(Pair{1, 2}), pair);
    EXPECT_EQ(cache.getOverlappingPairArrayPtr(), pair);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 1);
}

TEST(PairCache, RefusesPairsOfEqualIds)
{
    PairCache cache;
    Proxies proxies(1);
    EXPECT_EQ(cache.addOverlappingPair(proxies[0], proxies[0]), nullptr);
    EXPECT_EQ(cache.addOverlappingPair(proxies[0], proxies.add(1)), nullptr);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 0);
}

TEST(PairCache, ReturnsTheInternalInfoOfARemovedPair)
{
    PairCache cache;
    Proxies proxies(2);
    int info = 0;
    cache.addOverlappingPair(proxies[0], proxies[1])->m_internalInfo1 = &info;
    EXPECT_EQ(cache.removeOverlappingPair(proxies[1], proxies[0], nullptr), &info);
    EXPECT_EQ(cache.addOverlappingPair(proxies[0], proxies[1])->m_internalInfo1, nullptr);
}

TEST(PairCache, MovesTheLastPairIntoTheHole)
{
    PairCache cache;
    Proxies proxies(4);
    cache.addOverlappingPair(proxies[2], proxies[3]);
    cache.addOverlappingPair(proxies[0], proxies[1]);
    cache.addOverlappingPair(proxies[0], proxies[2]);
    EXPECT_EQ(idsOf(cache), (std::vector<RowPair>{{3, 4}, {1, 2}, {1, 3}}));
    cache.removeOverlappingPair(proxies[2], proxies[3], nullptr);
    EXPECT_EQ(idsOf(cache), (std::vector<RowPair>{{1, 3}, {1, 2}}));
}

TEST(PairCache, AppliesGroupAndMaskOfBothSidesWithoutACallback)
{
    PairCache cache;
    Proxies proxies(2);
    proxies[0]->m_collisionFilterGroup = 4;
    proxies[0]->m_collisionFilterMask = 8;
    proxies[1]->m_collisionFilterGroup = 8;
    proxies[1]->m_collisionFilterMask = 2;
    EXPECT_FALSE(cache.needsBroadphaseCollision(proxies[0], proxies[1]));
    EXPECT_FALSE(cache.needsBroadphaseCollision(proxies[1], proxies[0]));
    EXPECT_EQ(cache.addOverlappingPair(proxies[0], proxies[1]), nullptr);
    EXPECT_NE(cache.addPairUnfiltered(proxies[0], proxies[1]), nullptr);
    proxies[1]->m_collisionFilterMask = 4;
    EXPECT_TRUE(cache.needsBroadphaseCollision(proxies[0], proxies[1]));
}

TEST(PairCache, LetsTheFilterCallbackAloneDecide)
{
    struct Filter final : btOverlapFilterCallback
    {
        bool needBroadphaseCollision(btBroadphaseProxy*, btBroadphaseProxy*) const override { return answer; }
        bool answer = true;
    } filter;
    PairCache cache;
    Proxies proxies(3);
    proxies[0]->m_collisionFilterMask = 0;
    EXPECT_EQ(cache.addOverlappingPair(proxies[0], proxies[1]), nullptr);
    cache.setOverlapFilterCallback(&filter);
    EXPECT_EQ(cache.getOverlapFilterCallback(), &filter);
    EXPECT_NE(cache.addOverlappingPair(proxies[0], proxies[1]), nullptr);
    filter.answer = false;
    EXPECT_EQ(cache.addOverlappingPair(proxies[1], proxies[2]), nullptr);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 1) << "pairs that exist stay";
    cache.setOverlapFilterCallback(nullptr);
    EXPECT_NE(cache.addOverlappingPair(proxies[1], proxies[2]), nullptr);
}

TEST(PairCache, FreesEveryAlgorithmOnceWithTheDispatcherGiven)
{
    PairCache cache;
    Proxies proxies(10);
    FakeDispatcher dispatcher;
    addAllPairs(cache, proxies, 10);
    for (int i = 0; i < 45; ++i)
        cache.getOverlappingPairArray()[i].m_algorithm = dispatcher.makeAlgorithm();

    cache.cleanProxyFromPairs(proxies[3], &dispatcher);
    EXPECT_EQ(dispatcher.freedCount, 9);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 45) << "cleaning keeps the pairs";
    for (int i = 0; i < 45; ++i)
    {
        const btBroadphasePair& pair = cache.getOverlappingPairArray()[i];
        EXPECT_EQ(pair.m_algorithm == nullptr, pair.m_pProxy0 == proxies[3] || pair.m_pProxy1 == proxies[3]);
    }
    cache.removeOverlappingPair(proxies[0], proxies[1], &dispatcher);
    EXPECT_EQ(dispatcher.freedCount, 10);
    cache.removeOverlappingPairsContainingProxy(proxies[0], &dispatcher);
    EXPECT_EQ(dispatcher.freedCount, 10 + 7) << "one of nine removed before, one cleaned before";
    for (std::size_t i = 0; i < proxies.size(); ++i)
        cache.removeOverlappingPairsContainingProxy(proxies[i], &dispatcher);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 0);
    EXPECT_EQ(dispatcher.freedCount, 45);
    EXPECT_EQ(dispatcher.destroyedCount, 45);
}

TEST(PairCache, WorksWithoutADispatcherAndLeavesAlgorithmsAlone)
{
    PairCache cache;
    Proxies proxies(3);
    FakeDispatcher dispatcher;
    addAllPairs(cache, proxies, 3);
    btCollisionAlgorithm* const algorithm = dispatcher.makeAlgorithm();
    cache.getOverlappingPairArray()[0].m_algorithm = algorithm;
    cache.cleanProxyFromPairs(proxies[0], nullptr);
    cache.cleanOverlappingPair(cache.getOverlappingPairArray()[0], nullptr);
    EXPECT_EQ(cache.getOverlappingPairArray()[0].m_algorithm, algorithm);
    cache.removeOverlappingPairsContainingProxy(proxies[0], nullptr);
    Visit removeAll([](btBroadphasePair&) { return true; });
    cache.processAllOverlappingPairs(&removeAll, nullptr);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 0);
    EXPECT_EQ(dispatcher.destroyedCount, 0);
    algorithm->~btCollisionAlgorithm();
    dispatcher.freeCollisionAlgorithm(algorithm);
}

TEST(PairCache, ReportsPairToGhostsBeforeItIsFindableAndAfterItNoLongerIs)
{
    PairCache cache;
    Proxies proxies(3);
    FakeDispatcher dispatcher;
    GhostLog ghosts;
    cache.setInternalGhostPairCallback(&ghosts);
    EXPECT_EQ(cache.ghostPairCallback(), &ghosts);
    int calls = 0;
    ghosts.onAdd = [&](btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1)
    {
        ++calls;
        EXPECT_EQ(cache.findPair(proxy0, proxy1), nullptr);
    };
    ghosts.onRemove = [&](btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1)
    {
        ++calls;
        EXPECT_EQ(cache.findPair(proxy0, proxy1), nullptr);
        EXPECT_EQ(dispatcher.freedCount, 1) << "the algorithm went first";
        EXPECT_EQ(cache.getNumOverlappingPairs(), 2) << "the entry is still there";
    };
    cache.addOverlappingPair(proxies[2], proxies[0])->m_algorithm = dispatcher.makeAlgorithm();
    cache.addOverlappingPair(proxies[0], proxies[2]);
    cache.addOverlappingPair(proxies[1], proxies[2]);
    EXPECT_EQ(ghosts.added, (std::vector<RowPair>{{1, 3}, {2, 3}}));
    cache.removeOverlappingPair(proxies[2], proxies[0], &dispatcher);
    cache.removeOverlappingPair(proxies[2], proxies[0], &dispatcher);
    EXPECT_EQ(ghosts.removed, (std::vector<RowPair>{{1, 3}}));
    EXPECT_EQ(ghosts.lastDispatcher, &dispatcher);
    EXPECT_EQ(calls, 3);
}

TEST(PairCache, ReportsEveryRemovalByProxyOrPassToGhosts)
{
    PairCache cache;
    Proxies proxies(6);
    GhostLog ghosts;
    cache.setInternalGhostPairCallback(&ghosts);
    addAllPairs(cache, proxies, 6);
    cache.removeOverlappingPairsContainingProxy(proxies[2], nullptr);
    EXPECT_EQ(ghosts.removed.size(), 5u);
    Visit removeAll([](btBroadphasePair&) { return true; });
    cache.processAllOverlappingPairs(&removeAll, nullptr);
    std::sort(ghosts.added.begin(), ghosts.added.end());
    std::sort(ghosts.removed.begin(), ghosts.removed.end());
    EXPECT_EQ(ghosts.added.size(), 15u);
    EXPECT_EQ(ghosts.removed, ghosts.added);
    EXPECT_EQ(ghosts.forbiddenCalls, 0);
}

TEST(PairCache, SurvivesGhostCallbacksThatChangeIt)
{
    PairCache cache;
    Proxies proxies(8);
    GhostLog ghosts;
    cache.setInternalGhostPairCallback(&ghosts);
    bool isNested = false;
    ghosts.onAdd = [&](btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1)
    {
        if (std::exchange(isNested, true))
            return;
        cache.addOverlappingPair(proxy0, proxy1);
        cache.addOverlappingPair(proxies[6], proxies[7]);
        isNested = false;
    };
    addAllPairs(cache, proxies, 5);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 11);
    EXPECT_TRUE(cache.isConsistent());

    // A removal whose callback removes other pairs, adds the pair again and iterates over the pairs, while its own
    // entry still exists.
    ghosts.onRemove = [&](btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1)
    {
        if (std::exchange(isNested, true))
            return;
        const int before = cache.getNumOverlappingPairs();
        cache.removeOverlappingPairsContainingProxy(proxies[1], nullptr);
        cache.addOverlappingPair(proxy0, proxy1);
        Visit visit(keep);
        cache.processAllOverlappingPairs(&visit, nullptr);
        EXPECT_EQ(visit.visited.size(), static_cast<std::size_t>(cache.getNumOverlappingPairs() - 1));
        cache.processAllOverlappingPairs(&visit, nullptr, deterministic());
        EXPECT_EQ(visit.visited.size(), 2 * static_cast<std::size_t>(cache.getNumOverlappingPairs() - 1));
        EXPECT_LT(cache.getNumOverlappingPairs(), before);
        isNested = false;
    };
    cache.removeOverlappingPair(proxies[0], proxies[2], nullptr);
    EXPECT_TRUE(cache.isConsistent());
    EXPECT_NE(cache.findPair(proxies[0], proxies[2]), nullptr);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 11 - 4);
}

TEST(PairCache, SurvivesAlgorithmsWhoseDestructorsChangeIt)
{
    PairCache cache;
    Proxies proxies(6);
    FakeDispatcher dispatcher;
    addAllPairs(cache, proxies, 6);
    const auto onDestroy = [&]
    {
        cache.removeOverlappingPair(proxies[0], proxies[1], &dispatcher);
        cache.removeOverlappingPair(proxies[0], proxies[5], &dispatcher);
        cache.addOverlappingPair(proxies[2], proxies[0]);
    };
    for (int i = 0; i < 15; ++i)
    {
        FakeDispatcher::Algorithm* algorithm = dispatcher.makeAlgorithm();
        algorithm->onDestroy = onDestroy;
        cache.getOverlappingPairArray()[i].m_algorithm = algorithm;
    }
    cache.removeOverlappingPair(proxies[0], proxies[1], &dispatcher);
    EXPECT_TRUE(cache.isConsistent());
    EXPECT_EQ(cache.getNumOverlappingPairs(), 13);
    cache.cleanProxyFromPairs(proxies[5], &dispatcher);
    EXPECT_TRUE(cache.isConsistent());
    EXPECT_EQ(cache.getNumOverlappingPairs(), 13);
    for (std::size_t i = 0; i < proxies.size(); ++i)
        cache.removeOverlappingPairsContainingProxy(proxies[i], &dispatcher);
    EXPECT_EQ(dispatcher.destroyedCount, 15);
    EXPECT_EQ(dispatcher.freedCount, 15);
    EXPECT_TRUE(cache.isConsistent());
}

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
    for (const int id : {70000, 3, 1 << 30, 12, 4096, 5000, INT_MAX})
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

TEST(PairCache, SortsTheArrayWithoutTouchingAlgorithmsOrGhosts)
{
    PairCache cache;
    Proxies proxies(12);
    FakeDispatcher dispatcher;
    GhostLog ghosts;
    addAllPairs(cache, proxies, 12);
    std::vector<std::pair<RowPair, btCollisionAlgorithm*>> expected;
    for (int i = 0; i < cache.getNumOverlappingPairs(); ++i)
    {
        btBroadphasePair& pair = cache.getOverlappingPairArray()[i];
        pair.m_algorithm = dispatcher.makeAlgorithm();
        expected.push_back({idsOf(pair), pair.m_algorithm});
    }
    std::sort(expected.rbegin(), expected.rend());
    cache.setInternalGhostPairCallback(&ghosts);
    cache.sortOverlappingPairs(&dispatcher);
    cache.setInternalGhostPairCallback(nullptr);
    EXPECT_TRUE(ghosts.added.empty() && ghosts.removed.empty());
    EXPECT_EQ(dispatcher.destroyedCount, 0);
    for (std::size_t i = 0; i < expected.size(); ++i)
    {
        const btBroadphasePair& pair = cache.getOverlappingPairArray()[static_cast<int>(i)];
        EXPECT_EQ(idsOf(pair), expected[i].first);
        EXPECT_EQ(pair.m_algorithm, expected[i].second);
    }
    EXPECT_TRUE(cache.isConsistent());
    for (std::size_t i = 0; i < proxies.size(); ++i)
        cache.removeOverlappingPairsContainingProxy(proxies[i], &dispatcher);
    EXPECT_EQ(dispatcher.freedCount, 66);
}

TEST(PairCache, StaysUsableWhenACallbackThrows)
{
    PairCache cache;
    Proxies proxies(6);
    GhostLog ghosts;
    addAllPairs(cache, proxies, 6);
    Visit thrower([](btBroadphasePair&) -> bool { throw std::runtime_error("of the test"); });
    EXPECT_THROW(cache.processAllOverlappingPairs(&thrower, nullptr), std::runtime_error);
    EXPECT_THROW(cache.processAllOverlappingPairs(&thrower, nullptr, deterministic()), std::runtime_error);
    cache.setInternalGhostPairCallback(&ghosts);
    ghosts.onRemove = [](btBroadphaseProxy*, btBroadphaseProxy*) { throw std::runtime_error("of the test"); };
    EXPECT_THROW(cache.removeOverlappingPair(proxies[0], proxies[1], nullptr), std::runtime_error);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 14);
    EXPECT_TRUE(cache.isConsistent());
    cache.sortOverlappingPairs(nullptr);  // would have no effect if the passes above still counted as running
    const std::vector<RowPair> ids = idsOf(cache);
    EXPECT_TRUE(std::is_sorted(ids.rbegin(), ids.rend()));
}

TEST(PairCache, AllowsReservingThroughTheArray)
{
    PairCache cache;
    Proxies proxies(50);
    cache.getOverlappingPairArray().reserve(777);
    addAllPairs(cache, proxies, 20);
    cache.getOverlappingPairArray().reserve(1025);
    addAllPairs(cache, proxies, 50);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 1225);
    EXPECT_TRUE(cache.isConsistent());
}

TEST(PairCache, MovesNothingAfterReserve)
{
    PairCache cache;
    Proxies proxies(101);
    cache.reserve(100);
    const btBroadphasePair* first = cache.addOverlappingPair(proxies[0], proxies[1]);
    const std::uint64_t rehashes = cache.stats().rehashes;
    for (std::size_t i = 2; i < 101; ++i)
        cache.addOverlappingPair(proxies[0], proxies[i]);
    EXPECT_EQ(cache.getOverlappingPairArrayPtr(), first);
    EXPECT_EQ(cache.stats().rehashes, rehashes);
}

TEST(PairCache, GrowsDuringGhostCallbackOfRemoval)
{
    PairCache cache;
    Proxies proxies(62);
    GhostLog ghosts;
    cache.setInternalGhostPairCallback(&ghosts);
    for (std::size_t i = 1; i <= 20; ++i)
        cache.addOverlappingPair(proxies[0], proxies[i]);
    std::size_t added = 21;
    ghosts.onRemove = [&](btBroadphaseProxy*, btBroadphaseProxy*)
    {
        for (; added <= 61; ++added)
            cache.addOverlappingPair(proxies[0], proxies[added]);
    };
    const std::uint64_t rehashes = cache.stats().rehashes;
    cache.removeOverlappingPair(proxies[0], proxies[1], nullptr);
    EXPECT_GT(cache.stats().rehashes, rehashes);
    EXPECT_TRUE(cache.isConsistent());
    EXPECT_EQ(cache.getNumOverlappingPairs(), 60);
    EXPECT_EQ(cache.findPair(proxies[0], proxies[1]), nullptr);
    for (std::size_t i = 2; i <= 61; ++i)
        EXPECT_NE(cache.findPair(proxies[0], proxies[i]), nullptr) << i;
    cache.removeOverlappingPairsContainingProxy(proxies[0], nullptr);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 0);
    EXPECT_EQ(ghosts.added.size(), ghosts.removed.size());
}

TEST(PairCache, AddsNoPairThatIsRemovedInItsGhostCallback)
{
    PairCache cache;
    Proxies proxies(4);
    GhostLog ghosts;
    FakeDispatcher dispatcher;
    cache.setInternalGhostPairCallback(&ghosts);
    ghosts.onAdd = [&](btBroadphaseProxy*, btBroadphaseProxy* second)
    {
        if (second == proxies[1])
            cache.removeOverlappingPairsContainingProxy(second, &dispatcher);
    };
    EXPECT_NE(cache.addOverlappingPair(proxies[0], proxies[2]), nullptr);
    EXPECT_EQ(cache.addOverlappingPair(proxies[0], proxies[1]), nullptr);
    EXPECT_EQ(idsOf(cache), (std::vector<RowPair>{{1, 3}}));
    EXPECT_EQ(ghosts.removed, (std::vector<RowPair>{{1, 2}})) << "told to come, so told to go";
    EXPECT_EQ(ghosts.lastDispatcher, &dispatcher);
    // Finds the pair alone, by its proxies and by its ids.
    for (const bool byIds : {false, true})
    {
        ghosts.onAdd = [&, byIds](btBroadphaseProxy* first, btBroadphaseProxy* second)
        {
            EXPECT_EQ(byIds ? cache.removePair({1, 2}, nullptr)
                            : cache.removeOverlappingPair(second, first, nullptr),
                      nullptr);
        };
        EXPECT_EQ(cache.addOverlappingPair(proxies[1], proxies[0]), nullptr);
    }
    EXPECT_EQ(ghosts.removed.size(), 3u);
    ghosts.onAdd = nullptr;
    EXPECT_NE(cache.addOverlappingPair(proxies[0], proxies[1]), nullptr) << "nothing is left of that";
    EXPECT_TRUE(cache.isConsistent());
}

TEST(PairCache, LeavesNoProxyListsOfPairThatIsNotAdded)
{
    PairCache cache;
    Proxies proxies(4);
    GhostLog ghosts;
    cache.setInternalGhostPairCallback(&ghosts);
    cache.addOverlappingPair(proxies[0], proxies[1]);
    EXPECT_EQ(cache.stats().proxies, 2u);
    ghosts.onAdd = [&](btBroadphaseProxy*, btBroadphaseProxy* second)
    { cache.removeOverlappingPairsContainingProxy(second, nullptr); };
    EXPECT_EQ(cache.addOverlappingPair(proxies[0], proxies[2]), nullptr);
    EXPECT_EQ(cache.addOverlappingPair(proxies[2], proxies[3]), nullptr);
    EXPECT_EQ(cache.stats().proxies, 2u);
    ghosts.onAdd = [](btBroadphaseProxy*, btBroadphaseProxy*) { throw std::runtime_error("of the test"); };
    EXPECT_THROW(cache.addOverlappingPair(proxies[2], proxies[3]), std::runtime_error);
    EXPECT_EQ(cache.stats().proxies, 2u);
    // A pair is added while the addition of another one fails.
    ghosts.onAdd = [&](btBroadphaseProxy*, btBroadphaseProxy* second)
    {
        if (second != proxies[3])
            return;
        EXPECT_NE(cache.addOverlappingPair(proxies[1], proxies[2]), nullptr);
        cache.removeOverlappingPair(proxies[2], proxies[3], nullptr);
    };
    EXPECT_EQ(cache.addOverlappingPair(proxies[2], proxies[3]), nullptr);
    EXPECT_EQ(cache.stats().proxies, 3u);
    EXPECT_TRUE(cache.isConsistent());
}

TEST(PairCache, AddsNoPairWhoseProxyIsRemovedInFilterCallback)
{
    PairCache cache;
    Proxies proxies(3);
    struct Filter final : btOverlapFilterCallback
    {
        bool needBroadphaseCollision(btBroadphaseProxy*, btBroadphaseProxy* second) const override
        {
            cache->removeOverlappingPairsContainingProxy(second, nullptr);
            return true;
        }
        PairCache* cache;
    } filter;
    filter.cache = &cache;
    GhostLog ghosts;
    cache.setInternalGhostPairCallback(&ghosts);
    cache.setOverlapFilterCallback(&filter);
    EXPECT_EQ(cache.addOverlappingPair(proxies[0], proxies[1]), nullptr);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 0);
    EXPECT_TRUE(ghosts.added.empty() && ghosts.removed.empty()) << "nobody was told";
    cache.setOverlapFilterCallback(nullptr);
}

TEST(PairCache, ReportsPairOnceHoweverOftenItIsAddedMeanwhile)
{
    PairCache cache;
    Proxies proxies(3);
    GhostLog ghosts;
    cache.setInternalGhostPairCallback(&ghosts);
    ghosts.onAdd = [&](btBroadphaseProxy* first, btBroadphaseProxy* second)
    {
        if (second == proxies[2])
            return;
        EXPECT_EQ(cache.addOverlappingPair(first, second), nullptr);
        EXPECT_NE(cache.addOverlappingPair(first, proxies[2]), nullptr) << "others may be added";
        cache.setInternalGhostPairCallback(nullptr);
        EXPECT_EQ(cache.addOverlappingPair(second, first), nullptr);
        cache.setInternalGhostPairCallback(&ghosts);
    };
    EXPECT_NE(cache.addOverlappingPair(proxies[0], proxies[1]), nullptr);
    EXPECT_EQ(ghosts.added, (std::vector<RowPair>{{1, 2}, {1, 3}}));
    EXPECT_EQ(idsOf(cache), (std::vector<RowPair>{{1, 3}, {1, 2}}));
    EXPECT_TRUE(cache.isConsistent());
}

TEST(PairCache, FindsAndRemovesPairsOfIdsBeyondSignedRange)
{
    PairCache cache;
    Proxies proxies;
    for (const std::uint32_t id : {5u, 0x7fffffffu, 0x80000000u, 0xffffffffu})
        proxies.add(static_cast<int>(id));
    addAllPairs(cache, proxies, 4);
    EXPECT_TRUE(cache.isConsistent());
    for (std::size_t i = 0; i < 4; ++i)
    {
        for (std::size_t k = i + 1; k < 4; ++k)
        {
            const auto a = static_cast<std::uint32_t>(proxies[i]->m_uniqueId);
            const auto b = static_cast<std::uint32_t>(proxies[k]->m_uniqueId);
            btBroadphasePair* const pair = cache.findPair(proxies[i], proxies[k]);
            ASSERT_NE(pair, nullptr);
            EXPECT_EQ(pairOf(*pair), (Pair{a, b}));
            EXPECT_EQ(cache.findPair(proxies[k], proxies[i]), pair);
            EXPECT_EQ(cache.findPair(Pair{a, b}), pair);
            EXPECT_EQ(cache.findPair(Pair{b, a}), pair);
            EXPECT_EQ(cache.addOverlappingPair(proxies[k], proxies[i]), pair);
        }
    }
    EXPECT_EQ(cache.getNumOverlappingPairs(), 6);
    const Pair leaving[] = {{5, 0x80000000u}, {5, 0xffffffffu}, {0x7fffffffu, 0x80000000u}};
    EXPECT_EQ(cache.removePairs(leaving, 3, nullptr), 3u);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 3);
    cache.removePair({0x80000000u, 0xffffffffu}, nullptr);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 2);
    EXPECT_TRUE(cache.isConsistent());
    // The pairs that are left, with the later proxy first.
    for (const auto& [later, earlier] : {std::pair{3, 1}, std::pair{1, 0}})
    {
        btBroadphaseProxy* const a = proxies[static_cast<std::size_t>(later)];
        btBroadphaseProxy* const b = proxies[static_cast<std::size_t>(earlier)];
        ASSERT_NE(cache.findPair(a, b), nullptr);
        cache.removeOverlappingPair(a, b, nullptr);
        EXPECT_EQ(cache.findPair(a, b), nullptr);
        EXPECT_EQ(cache.findPair(b, a), nullptr);
    }
    EXPECT_EQ(cache.getNumOverlappingPairs(), 0);
    EXPECT_TRUE(cache.isConsistent());
    addAllPairs(cache, proxies, 4);
    cache.removeOverlappingPairsContainingProxy(proxies[3], nullptr);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 3);
    EXPECT_TRUE(cache.isConsistent());
}
}  // namespace
}  // namespace cullet::test
