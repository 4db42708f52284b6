// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Broad phase and pair cache with failing allocations.
#include "cullet/broad/proxy_table.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/pair_cache/pair_cache_support.h"
#include "cullet/tests/support/process/failing_new.h"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <new>
#include <stdexcept>
#include <thread>
#include <vector>

namespace cullet::test
{
namespace
{
/// On one thread, because only allocations of the test's own thread can be made to fail.
BroadphaseOptions gridOptions()
{
    BroadphaseOptions options;
    options.backend = BackendChoice::Grid;
    options.threads = 1;
    return options;
}

/// The index of the failing allocation in each attempt to add one cube.
///
/// Memory allocated by an attempt stays with the arrays, so repeating 1 lets each of their allocations fail in turn.
/// Memory that an attempt frees is allocated again by the next one; then the numbers have to grow.
std::uint64_t goodAllocations(std::uint64_t attempt)
{
    constexpr std::uint64_t kArrays = 10;
    return attempt <= kArrays ? std::min<std::uint64_t>(attempt, 1) : attempt - kArrays + 1;
}

/// A row of cubes, each touching the next; every allocation that adding one takes fails once.
class ScarceRow
{
public:
    ScarceRow() : broadphase(gridOptions()) {}

    /// Adds the next cube, after failed attempts.
    void add(void* client)
    {
        const auto next = static_cast<double>(proxies.size());
        bool hasFailed = true;
        for (std::uint64_t attempt = 0; hasFailed; ++attempt)
        {
            const Outcome before = outcome();
            btBroadphaseProxy* proxy = nullptr;
            try
            {
                const OneNewFails failure(goodAllocations(attempt));
                proxy = addCube(broadphase, vec(next, 0, 0), 0.5, 1, kAllGroups, client);
                hasFailed = failure.hasHappened();
            }
            catch (const std::bad_alloc&)
            {
                ++failures;
            }
            if (!hasFailed)
            {
                proxies.push_back(proxy);
                return;
            }
            // Some allocations are optional.
            if (proxy != nullptr)
                broadphase.destroyProxy(proxy, nullptr);
            ASSERT_EQ(outcome(), before) << proxies.size() << " cubes, attempt " << attempt;
        }
    }

    /// Expects no remains once the cubes are removed.
    void expectCleanEnd()
    {
        for (btBroadphaseProxy* proxy : proxies)
            broadphase.destroyProxy(proxy, nullptr);
        EXPECT_TRUE(updatedPairs(broadphase).empty());
        broadphase.resetPool(nullptr);
        EXPECT_EQ(idOf(addCube(broadphase, vec(0, 0, 0))), 1u);
        EXPECT_EQ(broadphase.stats().bodies, 1u);
        EXPECT_EQ(boxHits(broadphase, vec(-1, -1, -1), vec(1e4, 1, 1)), Ids{1});
    }

    Broadphase broadphase;
    std::vector<btBroadphaseProxy*> proxies;
    int failures = 0;  ///< that reached the caller

private:
    struct Outcome
    {
        std::uint32_t bodies, ghosts;
        Ids hits;
        Pairs pairs;

        bool operator==(const Outcome& other) const
        {
            return bodies == other.bodies && ghosts == other.ghosts && hits == other.hits &&
                   pairs == other.pairs;
        }
    };

    Outcome outcome()
    {
        const BroadphaseStats stats = broadphase.stats();
        return {stats.bodies, stats.ghosts, boxHits(broadphase, vec(-1, -1, -1), vec(1e4, 1, 1)),
                pairsOf(broadphase)};
    }
};

TEST(BroadphaseMemory, LeavesNothingBehindWhenProxyAllocationFails)
{
    // More than a page of ids and a chunk of proxies in either precision.
    constexpr std::size_t kCubes = 1100;
    ScarceRow row;
    while (row.proxies.size() < kCubes && !testing::Test::HasFailure())
        row.add(nullptr);
    EXPECT_GT(row.failures, 70) << "the arrays of the table grow a dozen times each";
    EXPECT_EQ(row.broadphase.table().size(), kCubes) << "no row was wasted";
    EXPECT_EQ(idOf(row.proxies.back()), kCubes) << "nor an id";
    EXPECT_EQ(updatedPairs(row.broadphase).size(), kCubes - 1);
    row.expectCleanEnd();
}

TEST(BroadphaseMemory, LeavesNoProxyOrPairWhenGhostAllocationFails)
{
    constexpr std::size_t kGhosts = 150;
    std::vector<std::unique_ptr<btGhostObject>> ghosts;
    btGhostPairCallback callback;
    ScarceRow row;
    row.broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(&callback);
    while (ghosts.size() < kGhosts && !testing::Test::HasFailure())
    {
        ghosts.push_back(std::make_unique<btGhostObject>());
        row.add(ghosts.back().get());
        if (ghosts.size() > 1)
        {
            EXPECT_EQ(ghosts[ghosts.size() - 2]->getNumOverlappingObjects(), ghosts.size() > 2 ? 2 : 1);
        }
        row.broadphase.calculateOverlappingPairs(nullptr);
    }
    EXPECT_GT(row.failures, 100) << "the set of pairs of ghosts that the backend has not seen begins anew";
    EXPECT_EQ(updatedPairs(row.broadphase).size(), kGhosts - 1);
    row.expectCleanEnd();
}

TEST(BroadphaseMemory, RemovesSeparatedGhostPairInUpdateAfterFailedAllocation)
{
    btGhostPairCallback callback;
    int failures = 0;
    for (bool hasFailed = true; hasFailed; ++failures)
    {
        btGhostObject ghost;
        btCollisionObject object;
        Broadphase broadphase(gridOptions());
        broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(&callback);
        btBroadphaseProxy* moving = addCube(broadphase, vec(9, 0, 0), 0.5, 1, kAllGroups, &ghost);
        addCube(broadphase, vec(0, 0, 0), 0.5, 1, kAllGroups, &object);
        EXPECT_TRUE(updatedPairs(broadphase).empty());
        try
        {
            const OneNewFails failure(static_cast<std::uint64_t>(failures));
            moveCube(broadphase, moving, vec(0.5, 0, 0));
            hasFailed = failure.hasHappened();
        }
        catch (const std::bad_alloc&)
        {
        }
        moveCube(broadphase, moving, vec(9, 0, 0));
        EXPECT_TRUE(updatedPairs(broadphase).empty()) << "after " << failures << " good allocations";
        EXPECT_EQ(ghost.getNumOverlappingObjects(), 0);
        broadphase.destroyProxy(moving, nullptr);
    }
    EXPECT_GT(failures, 8);
}

TEST(BroadphaseMemory, DestroysProxyWhenItsGhostCallbackThrows)
{
    btGhostObject ghost;
    GhostLog log;
    Broadphase broadphase(gridOptions());
    broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(&log);
    addCube(broadphase, vec(0, 0, 0), 0.5, 1, kAllGroups, &ghost);
    for (const bool isDestroyedBefore : {false, true})
    {
        log.onAdd = [&](btBroadphaseProxy*, btBroadphaseProxy* second)
        {
            if (isDestroyedBefore)
                broadphase.destroyProxy(second, nullptr);
            throw std::runtime_error("of the test");
        };
        EXPECT_THROW(addCube(broadphase, vec(0.5, 0, 0)), std::runtime_error);
        EXPECT_EQ(broadphase.stats().bodies, 1u);
        EXPECT_TRUE(updatedPairs(broadphase).empty());
    }
    log.onAdd = nullptr;
    addCube(broadphase, vec(0.5, 0, 0));
    EXPECT_EQ(pairsOf(broadphase).size(), 1u);
}

TEST(BroadphaseMemory, LeavesNoProxyListsWhenPairAllocationFails)
{
    PairCache cache;
    GhostLog ghosts;
    Proxies proxies;
    // On separate pages, so that the allocation may fail for the second list only.
    constexpr int kPage = 1024;
    for (int i = 1; i < 40; ++i)
        proxies.add(i * kPage);
    int failures = 0;
    for (std::size_t i = 0; i + 1 < proxies.size(); i += 2)
    {
        cache.setInternalGhostPairCallback(i % 4 == 0 ? &ghosts : nullptr);
        ghosts.added.reserve(proxies.size());
        const std::size_t told = ghosts.added.size();
        const std::uint64_t lists = cache.stats().proxies;
        for (std::uint64_t after = 0; cache.findPair(proxies[i], proxies[i + 1]) == nullptr; ++after)
        {
            const OneNewFails failure(after);
            if (cache.addOverlappingPair(proxies[i], proxies[i + 1]) != nullptr)
                continue;
            ++failures;
            ASSERT_EQ(cache.stats().proxies, lists) << i << ", after " << after;
            ASSERT_EQ(ghosts.added.size(), told);
        }
        EXPECT_EQ(cache.stats().proxies, lists + 2);
    }
    EXPECT_GT(failures, 40);
    EXPECT_TRUE(cache.isConsistent());
}

TEST(BroadphaseMemory, AddsReportedPairWithoutAllocationAfterNestedPairIsCancelled)
{
    PairCache cache;
    GhostLog ghosts;
    Proxies proxies;
    constexpr int kPage = 1024;
    for (int i = 1; i <= 3; ++i)
        proxies.add(i * kPage);
    cache.setInternalGhostPairCallback(&ghosts);
    std::unique_ptr<OneNewFails> failure;
    ghosts.onAdd = [&](btBroadphaseProxy* first, btBroadphaseProxy* second)
    {
        if (second == proxies[2])
        {
            cache.removeOverlappingPair(first, second, nullptr);
            return;
        }
        EXPECT_EQ(cache.addOverlappingPair(first, proxies[2]), nullptr);
        failure = std::make_unique<OneNewFails>(0);
    };
    EXPECT_NE(cache.addOverlappingPair(proxies[0], proxies[1]), nullptr) << "its memory was found before";
    EXPECT_FALSE(failure->hasHappened());
    failure.reset();
    EXPECT_EQ(cache.stats().proxies, 2u);
}

/// A query in the destructor of a thread-local variable.
struct LastQuery
{
    ~LastQuery()
    {
        const std::uint64_t before = newCount();
        broadphase->aabbTest(vec(-1, -1, -1), vec(1e4, 1, 1), hits);
        taken = newCount() - before;
    }

    struct Count final : btBroadphaseAabbCallback
    {
        bool process(const btBroadphaseProxy*) override { return ++count != 0; }
        int count = 0;
    };

    Broadphase* broadphase = nullptr;
    Count& hits;
    std::uint64_t& taken;
};

TEST(BroadphaseMemory, ListsPairsOfBodiesAtOneSpotInLargePages)
{
    constexpr std::uint64_t kBodies = 1200, kPairs = kBodies * (kBodies - 1) / 2;
    Broadphase broadphase(gridOptions());
    std::vector<btBroadphaseProxy*> proxies;
    for (std::uint64_t i = 0; i < kBodies; ++i)
        proxies.push_back(addCube(broadphase, vec(0, 0, 0)));
    // The system hands out pages of 4 KiB more slowly than they are written.
    const std::uint64_t before = largeUnalignedNewBytes();
    broadphase.calculateOverlappingPairs(nullptr);
    ASSERT_EQ(broadphase.stats().pairs, kPairs);
    for (std::uint64_t i = 0; i < kBodies; ++i)
        moveCube(broadphase, proxies[i], vec(2.0 * double(i), 0, 0));
    broadphase.calculateOverlappingPairs(nullptr);
    ASSERT_EQ(broadphase.stats().pairs, 0u);
    EXPECT_EQ(largeUnalignedNewBytes(), before);
}

TEST(BroadphaseMemory, AllocatesForQueryAfterThreadLocalBuffersAreDestroyed)
{
    Broadphase broadphase(gridOptions());
    for (int i = 0; i < 30; ++i)
        addCube(broadphase, vec(i, 0, 0));
    LastQuery::Count hits;
    std::uint64_t taken = 0;
    std::thread(
        [&]
        {
            // Constructed before the thread's first query, and so destroyed after the thread-local data of queries,
            // like any static object.
            thread_local LastQuery last{&broadphase, hits, taken};
            last.broadphase->aabbTest(vec(-1, -1, -1), vec(1e4, 1, 1), hits);
            const std::uint64_t before = newCount();
            last.broadphase->aabbTest(vec(-1, -1, -1), vec(1e4, 1, 1), hits);
            EXPECT_EQ(newCount(), before) << "the memory of the first query serves the second";
        })
        .join();
    EXPECT_EQ(hits.count, 90);
    EXPECT_GT(taken, 0u);
}
}  // namespace
}  // namespace cullet::test
