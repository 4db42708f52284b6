// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/hull_points.h"
#include "cullet/tests/plugin/convex/convex_contacts.h"
#include "cullet/tests/plugin/convex/faulty_cube.h"
#include "cullet/tests/plugin/dispatcher/pair_bench.h"
#include "cullet/tests/support/process/failing_new.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <initializer_list>
#include <stdexcept>
#include <vector>

namespace cullet::test
{
namespace
{
std::unique_ptr<btConvexHullShape> roundHull(int level)
{
    std::vector<btVector3> points;
    for (const Eigen::Vector3d& p : icoPoints(level))
        points.push_back(vec(p.x(), p.y(), p.z()));
    return makeHullShape(points);
}
}  // namespace

TEST(IsaGjkMemory, IsNotAllocatedByConstructorDestructorOrWarmStep)
{
    const auto hull = makeHullShape(ballPoints(40, 0.5, 1));
    const auto other = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    ConvexBench bench;
    {
        ConvexPairProbe first(bench.dispatcher, *hull, *other);
        first.place(vec(0, 0.9, 0), vec(0, 0, 0));
        first.step();
    }
    const std::uint64_t before = newCount();
    {
        ConvexPairProbe probe(bench.dispatcher, *hull, *other);
        for (const double height : {3.0, 1.03, 0.9, 3.0})
        {
            probe.place(vec(0.1, height, 0), vec(0, 0, 0));
            probe.step();
        }
    }
    EXPECT_EQ(newCount(), before);
    EXPECT_EQ(bench.registration->stats().depthsTotal, 2u);
}

TEST(IsaGjkMemory, IsNotAllocatedWhenPointsAreRewrittenInEveryStep)
{
    const auto hull = makeHullShape(ballPoints(40, 0.5, 1));
    hull->addPoint(vec(0, -0.6, 0));
    btBoxShape ground(vec(5, 0.5, 5));
    ConvexBench bench;
    ConvexPairProbe probe(bench.dispatcher, *hull, ground);
    std::uint64_t before = 0;
    for (int i = 0; i < 60; ++i)
    {
        for (int k = 0; k < hull->getNumPoints(); ++k)
            hull->getUnscaledPoints()[k] *= btScalar(i % 2 == 0 ? 1.003 : 0.997);
        // The first points may be shared, and two sets of own points follow.
        if (i == 3)
            before = newCount();
        probe.place(vec(0, i % 3 == 0 ? 1.05 : 1.15, 0), vec(0, 0, 0));
        EXPECT_EQ(probe.step()->getNumContacts(), 1);
    }
    EXPECT_EQ(newCount(), before);
    EXPECT_GT(bench.registration->stats().touchingTotal, 50u);
}

TEST(IsaGjkFallback, CountsPairAndLeavesItToBulletWhenGraphAllocationFails)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    std::uint64_t failed = 0;
    bool isReached = true;
    for (std::size_t after = 0; isReached; ++after)
    {
        SCOPED_TRACE(after);
        ConvexBench bench;
        // New points with level faces, without a graph yet, at an address that may have a record.
        const auto hull = makeHullShape(boxPoints(0.5, 0.5, 0.4 + 1e-3 * double(after)));
        ConvexPairProbe probe(bench.dispatcher, *hull, *cube);
        probe.place(vec(0, 0.5, 0), vec(0, 0, 0));
        {
            const OneNewFails failure(after);
            EXPECT_GT(probe.step()->getNumContacts(), 0);
            isReached = failure.hasHappened();
        }
        const IsaGjkStats stats = bench.registration->stats();
        EXPECT_EQ(stats.notConvergedTotal + stats.touchingTotal, 1u);
        failed += stats.notConvergedTotal;
        // Valid for a shape without a record, too, whose allocation failed.
        invalidate(*hull);
        probe.step();
        EXPECT_EQ(bench.registration->stats().touchingTotal, stats.touchingTotal + 1);
    }
    EXPECT_GT(failed, 10u);
}

namespace
{
/// Coincident round hulls: all faces of the difference are equally close.
///
/// @param level     of icoPoints()
/// @param isExact   the large polytope is too small for all faces, too
/// @param failures  which allocation of a step fails
void checkDepthWithoutMemory(int level, bool isExact, std::initializer_list<std::size_t> failures)
{
    const auto hull = roundHull(level);
    ConvexBench bench;
    ConvexPairProbe probe(bench.dispatcher, *hull, *hull);
    probe.place(vec(0, 0, 0), vec(0, 0, 0));
    probe.step();
    IsaGjkStats stats = bench.registration->stats();
    EXPECT_EQ(stats.exactTotal, isExact ? 1u : 0u);
    EXPECT_EQ(stats.depthsTotal, 1u);
    EXPECT_EQ(stats.notConvergedTotal, 0u);
    for (const std::size_t after : failures)
    {
        const OneNewFails failure(after);
        EXPECT_GT(probe.step()->getNumContacts(), 0);
        EXPECT_TRUE(failure.hasHappened());
    }
    stats = bench.registration->stats();
    EXPECT_EQ(stats.notConvergedTotal, failures.size());
    EXPECT_EQ(stats.exactTotal, isExact ? 1u : 0u);
}
}  // namespace

TEST(IsaGjkFallback, CountsDepthAndLeavesItToBulletWhenAllocationFails)
{
    checkDepthWithoutMemory(3, false, {0});
    checkDepthWithoutMemory(4, true, {0, 1, 6});
}

TEST(IsaGjkFallback, CountsShapeThatThrowsAndLeavesItToBullet)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    for (const int badCall : {0, 1})
    {
        ConvexBench bench;
        FaultyCube faulty(badCall, []() -> btVector3 { throw std::runtime_error("no support"); });
        ConvexPairProbe probe(bench.dispatcher, faulty, *cube);
        probe.place(btTransform(btQuaternion(vec(1, 2, 3).normalized(), btScalar(0.3)), vec(0.1, 0.5, 0.05)),
                    btTransform::getIdentity());
        EXPECT_GT(probe.step()->getNumContacts(), 0);
        EXPECT_EQ(bench.registration->stats().notConvergedTotal, 1u);
    }
}

// A motion of sleeping bodies during a dispatch that failed to allocate still counts when they are awake.
TEST(DispatcherMemory, LosesNoTouchingPairAfterFailedAllocationInEarlierDispatch)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    std::uint64_t failures = 0;
    bool isReached = true;
    for (std::size_t after = 0; isReached; ++after)
    {
        SCOPED_TRACE(after);
        PairBench pairs;
        pairs.addPair(*cube, 0.3);
        pairs.addPair(*cube, 0.3);
        pairs.dispatch(3);
        EXPECT_EQ(pairs.dispatcher.stillPairs(), 2u);
        // More pairs than the capacity.
        for (int i = 0; i < 100; ++i)
            pairs.addPair(*cube, 0.3);
        pairs.setState(0, ISLAND_SLEEPING);
        pairs.closeGap(0, 0.15);
        {
            const OneNewFails failure(after);
            pairs.dispatch();
            isReached = failure.hasHappened();
        }
        failures += isReached ? 1 : 0;
        pairs.setState(0, ACTIVE_TAG);
        pairs.closeGap(0, 0.15);
        pairs.dispatch();
        EXPECT_GT(pairs.contactsOfPair(0), 0);
        EXPECT_EQ(pairs.dispatcher.idlePairs(), 101u);
    }
    EXPECT_GT(failures, 3u);
}

TEST(DispatcherMemory, ReadsNoBodyOfRemovedPairThatCouldNotBeTracked)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    std::uint64_t failures = 0;
    bool isReached = true;
    for (std::size_t after = 0; isReached; ++after)
    {
        SCOPED_TRACE(after);
        PairBench pairs;
        pairs.addPair(*cube, 0.3);
        pairs.dispatch(3);
        pairs.addPair(*cube, 0.3);
        {
            const OneNewFails failure(after);
            pairs.dispatch();
            isReached = failure.hasHappened();
        }
        failures += isReached ? 1 : 0;
        for (const std::size_t i : {2u, 3u})
        {
            pairs.cache.removeOverlappingPairsContainingProxy(&pairs.bodies[i].proxy, &pairs.dispatcher);
            pairs.bodies[i].destroy();
        }
        pairs.dispatch(3);
        EXPECT_EQ(pairs.dispatcher.stillPairs(), 1u);
    }
    EXPECT_GE(failures, 3u) << "room for the pair, and the place of each of its bodies";
}

TEST(HullCache, SharesPointsThatASecondThreadSeesWhileTheFirstAllocatesForThem)
{
    std::uint64_t allocations = 0;
    for (bool hasWaited = true; hasWaited; ++allocations)
    {
        const std::vector<btVector3> points = ballPoints(40, 0.5, 60 + unsigned(allocations));
        const auto mine = makeHullShape(points), others = makeHullShape(points);
        trimHullCache();
        const HullCacheStats before = hullCacheStats();
        HullUse use, useAgain, useOfOthers;
        const Hull<btScalar>*hull = nullptr, *hullAgain = nullptr, *hullOfOthers = nullptr;
        std::future<void> second;
        // The second thread has time to overtake the first one, if nothing stops it.
        const std::function<void()> startSecond = [&]
        {
            second = std::async(std::launch::async,
                                [&]
                                {
                                    hullAgain = useAgain.hullOf(*mine, 0);
                                    hullOfOthers = useOfOthers.hullOf(*others, 0);
                                });
            second.wait_for(std::chrono::milliseconds(50));
        };
        {
            const OneNewCalls call(allocations, startSecond);
            hull = use.hullOf(*mine, 0);
            hasWaited = call.hasHappened();
        }
        if (!hasWaited)
            startSecond();
        second.wait();
        EXPECT_NE(hull, nullptr);
        EXPECT_EQ(hull, hullAgain) << "before allocation " << allocations;
        EXPECT_EQ(hull, hullOfOthers) << "before allocation " << allocations;
        EXPECT_EQ(hullCacheStats().pointSets, before.pointSets + 1) << "before allocation " << allocations;
        EXPECT_EQ(hullCacheStats().shapes, before.shapes + 2) << "before allocation " << allocations;
    }
    EXPECT_GT(allocations, 5u);
}
}  // namespace cullet::test
