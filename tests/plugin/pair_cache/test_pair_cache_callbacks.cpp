// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Calls of the pair cache from inside its own callbacks.
#include "cullet/plugin/pair_cache/pair_cache.h"
#include "cullet/tests/plugin/pair_cache/pair_cache_support.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
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

/// A filter with an answer that calls a function first.
class CallingFilter final : public btOverlapFilterCallback
{
public:
    explicit CallingFilter(PairCache& cache) : m_cache(cache) { cache.setOverlapFilterCallback(this); }
    ~CallingFilter() override { m_cache.setOverlapFilterCallback(nullptr); }
    bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override
    {
        calls.push_back(std::minmax(a->m_uniqueId, b->m_uniqueId));
        // A call for the same pair inside would not come to an end.
        if (std::count(calls.begin(), calls.end(), calls.back()) <= limit && onCall)
            onCall(a, b);
        return answer;
    }

    std::function<void(btBroadphaseProxy*, btBroadphaseProxy*)> onCall;
    bool answer = true;
    std::ptrdiff_t limit = 1;
    mutable std::vector<RowPair> calls;

private:
    PairCache& m_cache;
};

/// Adds the pair in each way there is.
void addInEveryWay(PairCache& cache, btBroadphaseProxy* a, btBroadphaseProxy* b,
                   const btBroadphasePair* expected)
{
    EXPECT_EQ(cache.addOverlappingPair(a, b), expected);
    EXPECT_EQ(cache.addOverlappingPair(b, a), expected);
    EXPECT_EQ(cache.addPair(a, b), expected);
    EXPECT_EQ(cache.addPairUnfiltered(b, a), expected);
}

TEST(PairCacheCallbacks, RefuseSamePairWhileItsFilterRuns)
{
    for (const bool answer : {false, true})
    {
        for (const bool hasGhosts : {false, true})
        {
            PairCache cache;
            Proxies proxies(3);
            GhostLog ghosts;
            cache.setInternalGhostPairCallback(hasGhosts ? &ghosts : nullptr);
            CallingFilter filter(cache);
            filter.answer = answer;
            filter.onCall = [&](btBroadphaseProxy* a, btBroadphaseProxy* b)
            {
                addInEveryWay(cache, a, b, nullptr);
                if (b != proxies[2])
                {
                    EXPECT_EQ(cache.addOverlappingPair(a, proxies[2]) != nullptr, answer) << "another pair";
                }
            };
            EXPECT_EQ(cache.addOverlappingPair(proxies[1], proxies[0]) != nullptr, answer);
            EXPECT_EQ(cache.getNumOverlappingPairs(), answer ? 2 : 0);
            EXPECT_EQ(filter.calls, (std::vector<RowPair>{{1, 2}, {2, 3}}));
            EXPECT_EQ(ghosts.added.size(), answer && hasGhosts ? 2u : 0u);
            EXPECT_TRUE(cache.isConsistent());
        }
    }
}

TEST(PairCacheCallbacks, ReturnExistingPairWhileItsFilterRuns)
{
    PairCache cache;
    Proxies proxies(2);
    btBroadphasePair* const pair = cache.addOverlappingPair(proxies[0], proxies[1]);
    CallingFilter filter(cache);
    filter.onCall = [&](btBroadphaseProxy* a, btBroadphaseProxy* b) { addInEveryWay(cache, a, b, pair); };
    EXPECT_EQ(cache.addOverlappingPair(proxies[0], proxies[1]), pair);
    EXPECT_EQ(filter.calls.size(), 1u);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 1);
}

TEST(PairCacheCallbacks, RefusePairThatFilterRemovesAndAddsAgain)
{
    PairCache cache;
    Proxies proxies(2);
    CallingFilter filter(cache);
    filter.onCall = [&](btBroadphaseProxy* a, btBroadphaseProxy* b)
    {
        EXPECT_EQ(cache.removeOverlappingPair(a, b, nullptr), nullptr);
        addInEveryWay(cache, a, b, nullptr);
    };
    EXPECT_EQ(cache.addOverlappingPair(proxies[0], proxies[1]), nullptr);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 0);
    EXPECT_NE(cache.addOverlappingPair(proxies[0], proxies[1]), nullptr) << "nothing is left of that";
}

TEST(PairCacheCallbacks, AddPairWhoseProxyIsCleanedInFilter)
{
    PairCache cache;
    Proxies proxies(5);
    FakeDispatcher dispatcher;
    for (std::size_t i = 1; i < 4; ++i)
        cache.addOverlappingPair(proxies[0], proxies[i])->m_algorithm = dispatcher.makeAlgorithm();
    CallingFilter filter(cache);
    filter.onCall = [&](btBroadphaseProxy* a, btBroadphaseProxy*)
    {
        cache.cleanProxyFromPairs(a, &dispatcher);
        cache.removeOverlappingPair(a, proxies[2], &dispatcher);
    };
    btBroadphasePair* const pair = cache.addOverlappingPair(proxies[0], proxies[4]);
    ASSERT_NE(pair, nullptr);
    EXPECT_EQ(pair->m_algorithm, nullptr);
    EXPECT_EQ(dispatcher.freedCount, 3);
    EXPECT_EQ(idsOf(cache), (std::vector<RowPair>{{1, 2}, {1, 4}, {1, 5}}));
    EXPECT_TRUE(cache.isConsistent());
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
}  // namespace
}  // namespace cullet::test
