// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_cache/pair_cache.h"
#include "cullet/tests/plugin/pair_cache/pair_cache_support.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <new>
#include <vector>

namespace cullet::test
{
namespace
{
/// The ids of all pairs, ascending as batches are.
Pairs sortedIdsOf(const PairCache& cache)
{
    Pairs ids;
    for (const RowPair& pair : idsOf(cache))
        ids.push_back(
            makePair(static_cast<std::uint32_t>(pair.first), static_cast<std::uint32_t>(pair.second)));
    std::sort(ids.begin(), ids.end());
    return ids;
}

/// The pairs in the order in which they leave by proxies, which is that of the lists.
std::vector<RowPair> listedPairsOf(PairCache& cache, Proxies& proxies)
{
    GhostLog ghosts;
    cache.setInternalGhostPairCallback(&ghosts);
    for (std::size_t i = 0; i < proxies.size(); ++i)
        cache.removeOverlappingPairsContainingProxy(proxies[i], nullptr);
    cache.setInternalGhostPairCallback(nullptr);
    return ghosts.removed;
}

/// A batch of about `percent` of the pairs, and a pair that the cache does not have.
Pairs batchOf(const PairCache& cache, std::uint32_t percent, Random& random)
{
    Pairs batch;
    for (const Pair ids : sortedIdsOf(cache))
    {
        if (random.below(100) < percent)
            batch.push_back(ids);
    }
    batch.push_back({1000, 1001});
    return batch;
}

/// Adds random pairs of the first 40 proxies and removes some, the same to both caches.
void shuffle(PairCache& cache, PairCache& other, Proxies& proxies, Random& random)
{
    for (int i = 0; i < 500; ++i)
    {
        const std::uint32_t a = random.below(40), b = random.below(40);
        const bool isRemoved = random.below(4) == 0;
        for (PairCache* each : {&cache, &other})
        {
            if (isRemoved)
                each->removeOverlappingPair(proxies[a], proxies[b], nullptr);
            else
                each->addOverlappingPair(proxies[a], proxies[b]);
        }
    }
}

TEST(PairCacheBatches, LeaveSameOrderOfPairsAsRemovalsOneByOne)
{
    const std::uint32_t seed = 11;
    Random random(seed);
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    int compacted = 0;
    for (int round = 0; round < 200; ++round)
    {
        Proxies proxies(40);
        PairCache batched, single;
        batched.setLinked(round % 5 != 0);
        single.setLinked(round % 5 != 0);
        shuffle(batched, single, proxies, random);
        const std::uint32_t percent = 30 + random.below(71);
        const Pairs batch = batchOf(batched, percent, random);
        const std::uint64_t versions = batched.version();
        std::size_t removed = 0;
        for (const Pair ids : batch)
        {
            const int before = single.getNumOverlappingPairs();
            single.removePair(ids, nullptr);
            removed += static_cast<std::size_t>(before - single.getNumOverlappingPairs());
        }
        ASSERT_EQ(batched.removePairs(batch.data(), batch.size(), nullptr), removed);
        ASSERT_EQ(removed, batch.size() - 1);
        ASSERT_EQ(batched.version() - versions, removed);
        ASSERT_TRUE(batched.isConsistent());
        ASSERT_EQ(idsOf(batched), idsOf(single));
        ASSERT_EQ(batched.stats().proxies, single.stats().proxies);
        compacted += percent > 55 && percent < 100 ? 1 : 0;
        shuffle(batched, single, proxies, random);
        ASSERT_EQ(idsOf(batched), idsOf(single));
        ASSERT_EQ(listedPairsOf(batched, proxies), listedPairsOf(single, proxies));
    }
    EXPECT_GE(compacted, 50);
}

TEST(PairCacheBatches, RemoveAllPairsThatEnteredInOrderWithoutSearchOrMove)
{
    PairCache cache;
    Proxies proxies(60);
    for (int round = 0; round < 2; ++round)
    {
        ASSERT_TRUE(cache.isEmpty());
        const std::uint64_t before = cache.stats().searched;
        for (std::size_t a = 0; a < proxies.size(); ++a)
            for (std::size_t b = a + 1; b < proxies.size(); ++b)
                ASSERT_TRUE(cache.appendNew(proxies[b], proxies[a]));
        EXPECT_TRUE(cache.isConsistent());
        EXPECT_FALSE(cache.isEmpty());
        const Pairs all = sortedIdsOf(cache);
        ASSERT_EQ(all.size(), 1770u);
        EXPECT_EQ(cache.removePairs(all.data(), all.size(), nullptr), all.size());
        EXPECT_EQ(cache.stats().searched, before);
        EXPECT_EQ(cache.stats().moved, 0u);
        EXPECT_EQ(cache.stats().pairs + cache.stats().proxies, 0u);
        EXPECT_TRUE(cache.isConsistent());
    }
}

TEST(PairCacheBatches, SearchOncePerGapAndMoveOnlyPairsThatStay)
{
    PairCache cache;
    Proxies proxies(60);
    addAllPairs(cache, proxies, proxies.size());
    Pairs most = sortedIdsOf(cache);
    for (const std::size_t kept : {1500, 1000, 500})
        most.erase(most.begin() + static_cast<std::ptrdiff_t>(kept));
    const PairCacheStats before = cache.stats();
    EXPECT_EQ(cache.removePairs(most.data(), most.size(), nullptr), 1767u);
    EXPECT_LE(cache.stats().searched - before.searched, 4u);
    EXPECT_LE(cache.stats().moved - before.moved, 3u);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 3);
    EXPECT_TRUE(cache.isConsistent());
}

TEST(PairCacheBatches, RemovePairsOfIdsFromTwoToThe31stOn)
{
    PairCache cache;
    Proxies proxies;
    for (std::uint32_t i = 0; i < 20; ++i)
        proxies.add(static_cast<std::int32_t>(0x7ffffff6u + i));
    addAllPairs(cache, proxies, proxies.size());
    const Pairs all = sortedIdsOf(cache);
    ASSERT_GT(all.back().second, 0x80000000u);
    ASSERT_LT(all.front().first, 0x80000000u);
    EXPECT_EQ(cache.removePairs(all.data(), all.size(), nullptr), 190u);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 0);
    EXPECT_TRUE(cache.isConsistent());
}

TEST(PairCacheBatches, CountPairThatIsListedTwiceOnce)
{
    PairCache cache;
    Proxies proxies(12);
    addAllPairs(cache, proxies, proxies.size());
    Pairs batch = sortedIdsOf(cache);
    batch.back() = batch.front();
    EXPECT_EQ(cache.removePairs(batch.data(), batch.size(), nullptr), 65u);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 1);
    EXPECT_TRUE(cache.isConsistent());
}

TEST(PairCacheBatches, DestroyEachAlgorithmAndCallGhostsForEachPair)
{
    FakeDispatcher dispatcher;
    for (const bool hasGhosts : {false, true})
    {
        PairCache cache;
        Proxies proxies(20);
        GhostLog ghosts;
        addAllPairs(cache, proxies, proxies.size());
        btBroadphasePairArray& array = cache.getOverlappingPairArray();
        for (int i = hasGhosts ? array.size() : 100; i < array.size(); ++i)
            array[i].m_algorithm = dispatcher.makeAlgorithm();
        cache.setInternalGhostPairCallback(hasGhosts ? &ghosts : nullptr);
        const Pairs all = sortedIdsOf(cache);
        EXPECT_EQ(cache.removePairs(all.data(), all.size(), &dispatcher), 190u);
        EXPECT_EQ(ghosts.removed.size(), hasGhosts ? 190u : 0u);
        EXPECT_TRUE(cache.isConsistent());
    }
    EXPECT_EQ(dispatcher.madeCount, 90);
    EXPECT_EQ(dispatcher.destroyedCount, 90);
    EXPECT_EQ(dispatcher.freedCount, 90);
}

/// What the callbacks of a removal by batch and of removals one by one have seen.
struct SeenByCallbacks
{
    /// Records the calls for a cache, and lets `change` do something to it in each.
    SeenByCallbacks(PairCache& cache, bool hasGhosts, const std::function<void(RowPair)>& change)
    {
        const auto see = [this, &cache, change](RowPair ids)
        {
            calls.push_back(ids);
            places.push_back(idsOf(cache));
            foundTotal +=
                cache.findPair(makePair(std::uint32_t(ids.first), std::uint32_t(ids.second))) != nullptr;
            change(ids);
        };
        ghosts.onRemove = [see](btBroadphaseProxy* a, btBroadphaseProxy* b) {
            see({a->m_uniqueId, b->m_uniqueId});
        };
        btBroadphasePairArray& array = cache.getOverlappingPairArray();
        for (int i = 0; i < array.size(); i += 3)
        {
            FakeDispatcher::Algorithm* const algorithm = dispatcher.makeAlgorithm();
            algorithm->onDestroy = [see, ids = idsOf(array[i])] { see(ids); };
            array[i].m_algorithm = algorithm;
        }
        cache.setInternalGhostPairCallback(hasGhosts ? &ghosts : nullptr);
    }

    FakeDispatcher dispatcher;
    GhostLog ghosts;
    std::vector<RowPair> calls;
    std::vector<std::vector<RowPair>> places;  ///< the array in each call
    std::size_t foundTotal = 0;
};

TEST(PairCacheBatches, LetCallbacksSeeSameArrayAsRemovalsOneByOne)
{
    const std::uint32_t seed = 12;
    Random random(seed);
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    int changed = 0, whole = 0;
    for (int round = 0; round < 120; ++round)
    {
        Proxies proxies(41);
        PairCache batched, single;
        shuffle(batched, single, proxies, random);
        Pairs batch = batchOf(batched, round % 2 == 0 ? 100 : 50 + random.below(51), random);
        if (round % 3 != 0)
            batch.pop_back();  // the cache has all others
        // A few calls add a pair, or remove another one.
        const std::uint32_t rarity = round % 4 < 2 ? 1u << 30 : 40u;
        std::uint32_t calls[2] = {};
        const auto changeOf = [&](PairCache& cache, std::uint32_t& count)
        {
            return [&, rarity](RowPair ids)
            {
                if (++count % rarity == 0 && count % 2 == 0)
                    cache.addOverlappingPair(proxies[40], proxies[std::size_t(ids.first - 1)]);
                else if (count % rarity == 0)
                    cache.removeOverlappingPair(proxies[std::size_t(ids.first)], proxies[39], nullptr);
            };
        };
        const bool hasGhosts = round % 5 != 0;
        SeenByCallbacks byBatch(batched, hasGhosts, changeOf(batched, calls[0]));
        SeenByCallbacks bySingle(single, hasGhosts, changeOf(single, calls[1]));
        whole += batch.size() == std::size_t(batched.getNumOverlappingPairs()) ? 1 : 0;
        batched.removePairs(batch.data(), batch.size(), &byBatch.dispatcher);
        for (const Pair ids : batch)
            single.removePair(ids, &bySingle.dispatcher);
        ASSERT_EQ(byBatch.calls, bySingle.calls);
        ASSERT_EQ(byBatch.places, bySingle.places);
        ASSERT_EQ(byBatch.foundTotal, bySingle.foundTotal);
        ASSERT_EQ(idsOf(batched), idsOf(single));
        ASSERT_EQ(batched.version(), single.version());
        ASSERT_TRUE(batched.isLinked());
        ASSERT_TRUE(batched.isConsistent());
        ASSERT_EQ(batched.stats().proxies, single.stats().proxies);
        changed += calls[0] >= rarity ? 1 : 0;
        for (PairCache* cache : {&batched, &single})
            cache->setInternalGhostPairCallback(nullptr);
        const Pairs left = sortedIdsOf(batched);
        batched.removePairs(left.data(), left.size(), &byBatch.dispatcher);
        for (const Pair ids : left)
            single.removePair(ids, &bySingle.dispatcher);
    }
    EXPECT_GE(changed, 40);
    EXPECT_GE(whole, 30);
}

TEST(PairCacheBatches, SearchNoPairThatEnteredInOrderWhereCallbacksRun)
{
    PairCache cache;
    Proxies proxies(60);
    addAllPairs(cache, proxies, proxies.size());
    GhostLog ghosts;
    cache.setInternalGhostPairCallback(&ghosts);
    const Pairs all = sortedIdsOf(cache);
    const std::uint64_t before = cache.stats().searched;
    EXPECT_EQ(cache.removePairs(all.data(), all.size(), nullptr), 1770u);
    EXPECT_EQ(ghosts.removed.size(), 1770u);
    EXPECT_EQ(cache.stats().searched, before);
    EXPECT_LE(cache.stats().moved, 1770u / 2);
    EXPECT_TRUE(cache.isLinked());
    EXPECT_EQ(cache.stats().pairs + cache.stats().proxies, 0u);
    EXPECT_TRUE(cache.isConsistent());
}

TEST(PairCacheBatches, LinkPairsAgainAfterExceptionOfCallback)
{
    PairCache cache;
    Proxies proxies(20);
    addAllPairs(cache, proxies, proxies.size());
    GhostLog ghosts;
    ghosts.onRemove = [&](btBroadphaseProxy*, btBroadphaseProxy*)
    {
        EXPECT_FALSE(cache.isLinked());
        if (ghosts.removed.size() == 100)
            throw std::bad_alloc();
    };
    cache.setInternalGhostPairCallback(&ghosts);
    const Pairs all = sortedIdsOf(cache);
    EXPECT_THROW(cache.removePairs(all.data(), all.size(), nullptr), std::bad_alloc);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 90);
    EXPECT_TRUE(cache.isLinked());
    EXPECT_TRUE(cache.isConsistent());
}

TEST(PairCacheBatches, RunOneByOneInsideCallbackOfPass)
{
    PairCache cache;
    Proxies proxies(20);
    addAllPairs(cache, proxies, proxies.size());
    const Pairs all = sortedIdsOf(cache);
    Visit removeAll(
        [&](btBroadphasePair&)
        {
            EXPECT_EQ(cache.removePairs(all.data(), all.size(), nullptr), 190u);
            return true;
        });
    cache.processAllOverlappingPairs(&removeAll, nullptr);
    EXPECT_EQ(removeAll.visited.size(), 1u);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 0);
    EXPECT_TRUE(cache.isConsistent());
}
}  // namespace
}  // namespace cullet::test
