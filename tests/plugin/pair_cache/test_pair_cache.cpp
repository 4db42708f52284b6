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

TEST(PairCache, HasNoArrayWhenItsLastPairIsRemoved)
{
    PairCache cache;
    Proxies proxies(2);
    const PairCache& constant = cache;
    ASSERT_NE(cache.addOverlappingPair(proxies[0], proxies[1]), nullptr);
    EXPECT_NE(constant.getOverlappingPairArrayPtr(), nullptr);
    cache.removeOverlappingPair(proxies[0], proxies[1], nullptr);
    EXPECT_EQ(cache.getOverlappingPairArrayPtr(), nullptr);
    EXPECT_EQ(constant.getOverlappingPairArrayPtr(), nullptr);
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
    EXPECT_EQ(cache.stats().moved, 1u);
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
