// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/convex/child_memory.h"
#include "cullet/tests/plugin/dispatcher/crowd_world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cfenv>
#include <string>
#include <thread>

namespace cullet::test
{
namespace
{
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
constexpr int kSteps = 90;
#else
constexpr int kSteps = 300;
#endif

class ContactJobsTest : public testing::TestWithParam<Crowd>
{
};

/// Pairs whose contacts must be jobs, of all pairs of a crowd, in percent.
int leastJobs(Crowd crowd)
{
    return crowd == Crowd::Mixed || crowd == Crowd::OnMesh ? 40 : 60;
}

// The reference takes Bullet's own near callback, pair by pair.
TEST_P(ContactJobsTest, GiveBulletsManifoldsBitByBitOnAnyNumberOfThreads)
{
    const unsigned seed = 3 + unsigned(GetParam());
    SCOPED_TRACE("seed " + std::to_string(seed));
    const auto bullets = makeCrowd<DerivedDispatcher>(GetParam(), seed, onThreadCount(1));
    const std::vector<std::uint64_t> expected = bullets->run(kSteps);
    EXPECT_EQ(bullets->stats().jobsTotal, 0u);
    EXPECT_GT(bullets->points, kSteps * 40);
    EXPECT_GT(bullets->replaced, kSteps / 6);
    for (const int threads : {1, 2, 3, 8})
    {
        SCOPED_TRACE(std::to_string(threads) + " threads");
        const auto own = makeCrowd(GetParam(), seed, onThreadCount(threads));
        const std::vector<std::uint64_t> hashes = own->run(kSteps);
        const ContactStats& stats = own->stats();
        EXPECT_TRUE(hashes == expected)
            << "differs in step "
            << std::mismatch(hashes.begin(), hashes.end(), expected.begin()).first - hashes.begin();
        EXPECT_EQ(stats.reason, threads == 1 ? SerialReason::OneThread : SerialReason::None);
        // Before the first bodies touch there are too few pairs.
        EXPECT_EQ(stats.dispatchesTotal[std::size_t(stats.reason)] +
                      stats.dispatchesTotal[std::size_t(SerialReason::FewPairs)],
                  std::uint64_t(kSteps));
        EXPECT_EQ(stats.barriersTotal, 0u);
        if (threads == 1)
            continue;
        EXPECT_GT(stats.jobsTotal * 100,
                  (stats.jobsTotal + stats.inOrderTotal) * std::uint64_t(leastJobs(GetParam())));
        EXPECT_GT(stats.dividedTotal, stats.jobsTotal / 2);
        EXPECT_TRUE(stats.helpedTotal > 0 || std::thread::hardware_concurrency() == 1);
    }
}

// Bullet's pool has no lock, and a job on a mesh makes an algorithm for each triangle.
TEST(ContactJobs, TakeMemoryOfTrianglesFromTheirThreadInsteadOfPool)
{
    btDefaultCollisionConfiguration configuration;
    Dispatcher dispatcher(&configuration);
    btPoolAllocator& pool = *configuration.getCollisionAlgorithmPool();
    const int before = pool.getFreeCount();
    {
        ChildMemory ofThisThread;
        void* const first = dispatcher.allocateCollisionAlgorithm(192);
        void* const second = dispatcher.allocateCollisionAlgorithm(192);
        EXPECT_FALSE(pool.validPtr(first));
        EXPECT_NE(first, second);
        EXPECT_EQ(pool.getFreeCount(), before);
        dispatcher.freeCollisionAlgorithm(first);
        dispatcher.freeCollisionAlgorithm(second);
        EXPECT_EQ(dispatcher.allocateCollisionAlgorithm(192), first);
    }
    void* const ofPool = dispatcher.allocateCollisionAlgorithm(192);
    EXPECT_TRUE(pool.validPtr(ofPool));
    dispatcher.freeCollisionAlgorithm(ofPool);
    EXPECT_EQ(pool.getFreeCount(), before);
}

/// A rounding mode of the calling thread.
class Rounding
{
public:
    explicit Rounding(int mode) { std::fesetround(mode); }
    ~Rounding() { std::fesetround(FE_TONEAREST); }
    Rounding(const Rounding&) = delete;
    Rounding& operator=(const Rounding&) = delete;
};

// Threads that an earlier world has started keep the mode of their start. Not with hulls: whether their graphs exist yet
// makes no difference in the usual mode only.
TEST(ContactJobs, AreComputedInRoundingModeOfCallingThread)
{
    constexpr int kShort = 60;
    const auto earlier = makeCrowd(Crowd::Boxes, 2, onThreadCount(3));
    const std::vector<std::uint64_t> nearest = earlier->run(kShort);
    EXPECT_TRUE(earlier->stats().helpedTotal > 0 || std::thread::hardware_concurrency() == 1);
    std::vector<std::uint64_t> hashes[2];
    for (const int threads : {1, 3})
    {
        const auto world = makeCrowd(Crowd::Boxes, 2, onThreadCount(threads));
        const Rounding upward(FE_UPWARD);
        hashes[threads / 2] = world->run(kShort);
    }
    EXPECT_TRUE(hashes[0] == hashes[1]);
    EXPECT_FALSE(hashes[0] == nearest);
}

INSTANTIATE_TEST_SUITE_P(All, ContactJobsTest, testing::ValuesIn(kCrowds),
                         [](const auto& crowd) { return testing::PrintToString(crowd.param); });
}  // namespace
}  // namespace cullet::test
