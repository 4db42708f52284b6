// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Random worlds, each update checked against the oracle.

#include "cullet/tests/broad/conformance/backend_cases.h"
#include "cullet/tests/support/backend_session.h"
#include "cullet/tests/support/random_world.h"

#include <gtest/gtest.h>

#include <string>

namespace cullet::test
{
namespace
{
class BackendFuzz : public BackendTest
{
protected:
    /// Steps a world and checks each update; stops at the first difference.
    void run(RandomWorld& world, int steps)
    {
        for (int step = 0; step < steps; ++step)
        {
            SCOPED_TRACE("step " + std::to_string(step));
            ASSERT_TRUE(session.step());
            world.step();
        }
    }

    /// The sample is representative: pairs entered and left, but not all of them in every step.
    void expectRepresentative(std::uint64_t changes) const
    {
        EXPECT_GT(session.addedTotal(), changes);
        EXPECT_GT(session.removedTotal(), changes);
    }

    BackendSession session{GetParam().make()};
};

CULLET_ON_EVERY_BACKEND(BackendFuzz);

TEST_P(BackendFuzz, MatchesOracleOverThousandRandomSteps)
{
    SCOPED_TRACE("seed 1");
    session.margin = 0.0625f;
    RandomWorldOptions options;
    options.count = 50;
    options.special = 0.005f;
    RandomWorld world(1, options, session.table);
    run(world, 1000);
    expectRepresentative(5000);
    const RandomWorldCounts& counts = world.counts();
    for (const std::uint64_t count : {counts.moved, counts.teleported, counts.resized, counts.refiltered,
                                      counts.created, counts.destroyed, counts.special})
        EXPECT_GT(count, 150u);
}

TEST_P(BackendFuzz, MatchesOracleWithoutMargin)
{
    SCOPED_TRACE("seed 2");
    RandomWorldOptions options;
    options.special = 0;
    options.isSnapped = false;
    RandomWorld world(2, options, session.table);
    run(world, 200);
    expectRepresentative(1000);
}

TEST_P(BackendFuzz, MatchesOracleWhenMarginChangesBetweenUpdates)
{
    SCOPED_TRACE("seed 3");
    RandomWorldOptions options;
    options.count = 50;
    options.move = 0.1f;
    RandomWorld world(3, options, session.table);
    for (int step = 0; step < 200; ++step)
    {
        SCOPED_TRACE("step " + std::to_string(step));
        const float margins[] = {0.0f, 0.05f, 1.0f};
        session.margin = margins[world.random().below(3)];
        ASSERT_TRUE(session.step());
        if (step % 3 != 0)
            world.step();
    }
    expectRepresentative(500);
}

TEST_P(BackendFuzz, MatchesOracleWhenFilterWordsAreSwitchedOffAndOn)
{
    SCOPED_TRACE("seed 4");
    RandomWorldOptions options;
    options.count = 40;
    RandomWorld world(4, options, session.table);
    for (int step = 0; step < 60; ++step)
    {
        SCOPED_TRACE("step " + std::to_string(step));
        // New filter words for all proxies: a caller that does so restarts the backend, because no row is dirty for it.
        if (step % 10 == 5)
        {
            session.useFilter = !session.useFilter;
            session.restart(session.pairs());
        }
        ASSERT_TRUE(session.step());
        world.step();
    }
    expectRepresentative(100);
}

TEST_P(BackendFuzz, MatchesOracleFarFromOrigin)
{
    for (const float shift : {1e5f, -1e6f})
    {
        SCOPED_TRACE("seed 5, shift " + std::to_string(shift));
        BackendSession far{GetParam().make()};
        RandomWorldOptions options;
        options.shift[0] = shift;
        options.shift[1] = -shift;
        options.shift[2] = shift;
        options.special = 0;
        RandomWorld world(5, options, far.table);
        for (int step = 0; step < 60; ++step, world.step())
            ASSERT_TRUE(far.step()) << "step " << step;
        EXPECT_GT(far.addedTotal(), 500u);
        EXPECT_GT(far.removedTotal(), 500u);
    }
}

TEST_P(BackendFuzz, MatchesOracleWithSizesOverSixDecades)
{
    SCOPED_TRACE("seed 6");
    session.margin = 0.01f;
    RandomWorldOptions options;
    options.halfSide = 30;
    options.sizeLow = -13;
    options.sizeHigh = 7;
    options.isSnapped = false;
    options.count = 80;
    RandomWorld world(6, options, session.table);
    run(world, 100);
    expectRepresentative(500);
}

TEST_P(BackendFuzz, MatchesOracleWhenBoxesAreOftenUnboundedOrInvalid)
{
    SCOPED_TRACE("seed 7");
    RandomWorldOptions options;
    options.count = 50;
    options.special = 0.2f;
    options.move = 0.1f;
    RandomWorld world(7, options, session.table);
    run(world, 150);
    expectRepresentative(1000);
}

TEST_P(BackendFuzz, MatchesOracleWhenRestingWorldWakesInParts)
{
    SCOPED_TRACE("seed 8");
    session.margin = 0.05f;
    RandomWorldOptions options;
    options.count = 200;
    options.halfSide = 12;
    options.move = 0;
    options.teleport = options.resize = options.refilter = options.destroy = options.resend =
        options.special = 0;
    RandomWorld world(8, options, session.table);
    ASSERT_TRUE(session.step());
    for (int step = 0; step < 120; ++step)
    {
        SCOPED_TRACE("step " + std::to_string(step));
        // The same tenth moves for twelve steps, then another tenth; in some steps none.
        const std::uint32_t part = static_cast<std::uint32_t>(step / 12);
        for (std::uint32_t i = part; i < world.rows().size() && step % 6 != 5; i += 10)
        {
            const ProxyId row = world.rows()[i];
            const float x = world.random().between(-0.5f, 0.5f);
            session.table.setBox(row, translated(session.table.box(row), x, -x, x));
        }
        ASSERT_TRUE(session.step());
        if (step % 6 == 5)
        {
            EXPECT_TRUE(session.reported({}, {}));
        }
    }
    expectRepresentative(100);
}

TEST_P(BackendFuzz, MatchesOracleWhenBoxesJitterAroundMarginAndScatter)
{
    SCOPED_TRACE("seed 9");
    const std::uint32_t side = 4;
    session.margin = 0.05f;
    Random random(9);
    std::vector<Aabb> home;
    for (std::uint32_t i = 0; i < side * side * side; ++i)
    {
        home.push_back(boxAt(static_cast<float>(i % side), static_cast<float>(i / side % side),
                             static_cast<float>(i / side / side)));
        session.add(home.back());
    }
    std::uint64_t quietSteps = 0;
    for (int step = 0; step < 220; ++step)
    {
        SCOPED_TRACE("step " + std::to_string(step));
        // Motions below the margin, then around it, then unrelated ones.
        const float reach = step < 100 ? 0.0499f : step < 200 ? 0.07f : 3.0f;
        for (std::uint32_t i = 0; i < home.size(); ++i)
        {
            const float x = random.between(-reach, reach);
            session.table.setBox(i, translated(home[i], x, random.between(-reach, reach), 0));
        }
        ASSERT_TRUE(session.step());
        quietSteps += session.delta().removed.empty() ? 1 : 0;
    }
    expectRepresentative(100);
    EXPECT_GE(quietSteps, 90u) << "below the margin nothing may leave";
}

TEST_P(BackendFuzz, MatchesOracleWhenWorldEmptiesAndGrowsAgain)
{
    SCOPED_TRACE("seed 10");
    RandomWorldOptions options;
    options.count = 40;
    RandomWorld world(10, options, session.table);
    for (int round = 0; round < 6; ++round)
    {
        for (int step = 0; step < 5; ++step, world.step())
            ASSERT_TRUE(session.step());
        world.destroyAll();
        ASSERT_TRUE(session.step());
        EXPECT_TRUE(session.pairs().empty());
        ASSERT_TRUE(session.step());
        EXPECT_TRUE(session.reported({}, {}));
        world.options.count = round % 2 == 0 ? 150 : 20;
        world.createSome(world.options.count);
    }
    expectRepresentative(500);
}

TEST_P(BackendFuzz, MatchesOracleWithIdsNearEndOfRange)
{
    SCOPED_TRACE("seed 11");
    RandomWorldOptions options;
    options.firstId = 0xffffffffu - 2000;
    RandomWorld world(11, options, session.table);
    run(world, 100);
    expectRepresentative(500);
    EXPECT_LT(world.counts().created, 2000u);
}
}  // namespace
}  // namespace cullet::test
