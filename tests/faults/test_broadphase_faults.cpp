// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Whatever fails once in a broad phase: nothing leaks, the caller learns of it as documented, and the next update has
// the pairs of brute force.
#include "cullet/tests/faults/support/crowd.h"

#include <algorithm>

namespace cullet::test
{
namespace
{
/// Bodies come, move and go.
void liveWithBodies(FaultRun& run, const CrowdOptions& options)
{
    Crowd crowd(run, options);
    for (std::size_t i = 0; i < crowd.size(); ++i)
        crowd.create(i, inRow(i));
    crowd.update();
    for (std::size_t i = 0; i < crowd.size(); i += 2)
        crowd.move(i, inRow(i % 5, 3));
    crowd.update();
    for (std::size_t i = 0; i < crowd.size(); i += 3)
        crowd.destroy(i);
    crowd.update();
    for (std::size_t i = 0; i < crowd.size(); ++i)
        crowd.create(i, inRow(i, 0.4));
    crowd.update();
    crowd.update();
}

/// Bodies come to rest, and one after the other wakes.
void liveAndSettle(FaultRun& run, const CrowdOptions& options)
{
    Crowd crowd(run, options);
    crowd.keptGap = 2.001 * double(options.broadphase.margin);
    for (std::size_t i = 0; i < crowd.size(); ++i)
        crowd.create(i, inRow(i, 0.9));
    for (int step = 0; step < 10; ++step)
    {
        for (std::size_t i = 0; i < crowd.size(); ++i)
            crowd.move(i, inRow(i, 0.9) + vec(0.001 * step, 0, 0));
        crowd.update();
    }
    for (std::size_t i = 0; i < crowd.size(); i += 9)
    {
        crowd.move(i, inRow(i, 0.9) + vec(0.4, 0.3, 0));
        crowd.update();
    }
}

void liveAndTeleport(FaultRun& run, const CrowdOptions& options)
{
    Crowd crowd(run, options);
    for (std::size_t i = 0; i < crowd.size(); ++i)
        crowd.create(i, inRow(i));
    for (int step = 1; step < 5; ++step)
    {
        for (std::size_t i = 0; i < crowd.size(); ++i)
            crowd.move(i, inRow((i * 7 + std::size_t(step)) % crowd.size()) +
                              vec(100 * step, -50 * step, 0.3 * double(i % 4)));
        crowd.update();
    }
}

/// The pool is reset again and again, so that ids and rows begin anew.
void liveAndReset(FaultRun& run, const CrowdOptions& options)
{
    Crowd crowd(run, options);
    for (int life = 0; life < 4; ++life)
    {
        // Other cubes overlap in each life, under the same ids.
        for (std::size_t i = 0; i < crowd.size(); ++i)
            crowd.create(i, inRow(i % 2 == 0 ? i : i + 40 * std::size_t(life)));
        crowd.update();
        for (std::size_t i = 0; i < crowd.size(); ++i)
            crowd.destroy(i);
        run.attempt([&] { crowd.broadphase().resetPool(nullptr); });
    }
}

/// A margin of Bullet's that changes, with pairs that stay by it.
void liveWithMargins(FaultRun& run, const CrowdOptions& options)
{
    const btScalar before = gDbvtMargin;
    {
        Crowd crowd(run, options);
        for (const double margin : {0.05, 0.5, 0.0, 0.2, 0.0})
        {
            gDbvtMargin = btScalar(margin);
            crowd.keptGap = 2.001 * margin;
            for (std::size_t i = 0; i < crowd.size(); ++i)
                crowd.create(i, inRow(i, 0.9));
            crowd.update();
            for (std::size_t i = 1; i < crowd.size(); i += 2)
                crowd.move(i, inRow(i, 0.9) + vec(0, 0, 1 + 1.5 * margin));
            crowd.update();
            for (std::size_t i = 0; i < crowd.size(); i += 3)
                crowd.destroy(i);
        }
    }
    gDbvtMargin = before;
}

/// Counts what a query finds; may throw.
struct FaultyHits : btBroadphaseRayCallback
{
    FaultyHits()
    {
        m_rayDirectionInverse = vec(1, BT_LARGE_FLOAT, BT_LARGE_FLOAT);
        m_signs[0] = m_signs[1] = m_signs[2] = 0;
        m_lambda_max = 1000;
    }
    bool process(const btBroadphaseProxy*) override
    {
        failInCallback();
        ++count;
        return true;
    }
    std::size_t count = 0;
};

struct FaultyBoxHits : btBroadphaseAabbCallback
{
    bool process(const btBroadphaseProxy*) override
    {
        failInCallback();
        ++count;
        return true;
    }
    std::size_t count = 0;
};

/// The same hits as before, whichever of the queries has failed.
void query(FaultRun& run, Crowd& crowd)
{
    std::size_t alive = 0;
    for (std::size_t i = 0; i < crowd.size(); ++i)
        alive += crowd.proxy(i) != nullptr ? 1 : 0;
    FaultyHits ray, sweep;
    FaultyBoxHits boxes;
    const btVector3 from = vec(-10, 0.25, 0), to = vec(990, 0.25, 0);
    if (run.attempt([&] { crowd.broadphase().rayTest(from, to, ray); }))
    {
        EXPECT_EQ(ray.count, alive);
    }
    const btVector3 half = vec(0.3, 0.3, 0.3);
    if (run.attempt([&] { crowd.broadphase().rayTest(from, to, sweep, -half, half); }))
    {
        EXPECT_EQ(sweep.count, alive);
    }
    if (run.attempt([&] { crowd.broadphase().aabbTest(vec(-9, -9, -9), vec(999, 9, 9), boxes); }))
    {
        EXPECT_EQ(boxes.count, alive);
    }
}

void liveWithQueries(FaultRun& run, const CrowdOptions& options)
{
    Crowd crowd(run, options);
    for (std::size_t i = 0; i < crowd.size(); ++i)
    {
        crowd.create(i, inRow(i));
        if (i % 16 == 0)
            query(run, crowd);
    }
    for (int step = 0; step < 40; ++step)
    {
        const std::size_t moved = step % 4 == 0 ? 1 : 9;
        for (std::size_t i = std::size_t(step) % 3; i < crowd.size(); i += moved)
            crowd.move(i, inRow(i) + vec(step, 0, 0));
        query(run, crowd);
        if (step % 10 == 9)
            crowd.destroy(std::size_t(step));
    }
    crowd.update();
}

using Scene = void (*)(FaultRun&, const CrowdOptions&);

/// Faults of one kind in a scene, of which at least `least` have to be there.
void expectWhole(const char* name, FaultKind kind, std::uint64_t least, Scene scene,
                 const CrowdOptions& options)
{
    const SweepCounts counts = sweepFaults(name, kind, [&](FaultRun& run) { scene(run, options); });
    EXPECT_GE(counts.injected, least) << "too few calls to be a test";
    EXPECT_TRUE(counts.thrown > 0 || kind == FaultKind::BulletAllocation)
        << "no fault has reached the caller";
}

CrowdOptions withMargin(CrowdOptions options, double margin)
{
    options.broadphase.margin = btScalar(margin);
    return options;
}

CrowdOptions withFilter(CrowdOptions options)
{
    options.hasFilter = true;
    return options;
}

/// Ids of the first cubes are on one page of lists, those of the others on the next.
CrowdOptions onTwoPages(CrowdOptions options)
{
    options.idsBefore = 1010;
    return options;
}

CrowdOptions withGhosts(CrowdOptions options)
{
    options.hasGhosts = true;
    return options;
}

CrowdOptions withPairCachingGhosts(CrowdOptions options)
{
    options.hasGhosts = true;
    options.hasPairCachingGhosts = true;
    return options;
}

TEST(BroadphaseFaults, KeepPairsWholeWhenAllocationFails)
{
    expectWhole("bodies", FaultKind::New, 80, liveWithBodies, crowdOf(40));
    expectWhole("bodies in columns", FaultKind::New, 200, liveWithBodies, crowdOf(40, 0));
    expectWhole("settling bodies", FaultKind::New, 400, liveAndSettle, withMargin(crowdOf(80, 0), 0.05));
    // So few that updates are left out, in which nothing is allocated.
    expectWhole("few settling bodies", FaultKind::New, 200, liveAndSettle, withMargin(crowdOf(60, 0), 0.05));
    expectWhole("teleports", FaultKind::New, 150, liveAndTeleport, crowdOf(50, 0));
    expectWhole("margins", FaultKind::New, 80, liveWithMargins, withMargin(crowdOf(30), -1));
}

TEST(BroadphaseFaults, KeepPairsWholeWhenAllocationFailsBesidesReset)
{
    expectWhole("resetPool()", FaultKind::New, 80, liveAndReset, crowdOf(24));
    expectWhole("resetPool() in columns", FaultKind::New, 80, liveAndReset, crowdOf(24, 0));
}

TEST(BroadphaseFaults, KeepPairsWholeWhenAllocationOfFilteredOrGhostPairsFails)
{
    expectWhole("filter", FaultKind::New, 80, liveWithBodies, onTwoPages(withFilter(crowdOf(40))));
    expectWhole("ghosts", FaultKind::New, 80, liveWithBodies, withPairCachingGhosts(crowdOf(30)));
    expectWhole("ghosts and filter", FaultKind::New, 150, liveWithBodies,
                onTwoPages(withFilter(withPairCachingGhosts(crowdOf(30)))));
}

TEST(BroadphaseFaults, KeepPairsWholeWhenBulletsAllocationFails)
{
    expectWhole("bodies", FaultKind::BulletAllocation, 2, liveWithBodies, crowdOf(40));
    expectWhole("teleports", FaultKind::BulletAllocation, 1, liveAndTeleport, crowdOf(50, 0));
    expectWhole("ghosts", FaultKind::BulletAllocation, 50, liveWithBodies, withGhosts(crowdOf(30)));
}

TEST(BroadphaseFaults, KeepPairsWholeWhenCallbackThrows)
{
    expectWhole("filter", FaultKind::Callback, 100, liveWithBodies, withFilter(crowdOf(40)));
    expectWhole("ghosts", FaultKind::Callback, 200, liveWithBodies, withPairCachingGhosts(crowdOf(30)));
    expectWhole("ghosts and filter", FaultKind::Callback, 250, liveWithBodies,
                withFilter(withGhosts(crowdOf(30))));
}

TEST(BroadphaseFaults, FindEveryBoxInQueriesAfterFault)
{
    expectWhole("queries", FaultKind::New, 60, liveWithQueries, crowdOf(80));
    expectWhole("queries", FaultKind::Callback, 2000, liveWithQueries, crowdOf(80));
}
}  // namespace
}  // namespace cullet::test
