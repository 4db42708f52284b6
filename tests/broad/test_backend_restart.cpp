// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Backend::restart(): a backend takes over from another one without losing a pair.

#include "tests/broad/backend_cases.h"
#include "tests/support/backend_session.h"
#include "tests/support/boxes.h"
#include "tests/support/random_world.h"

#include <gtest/gtest.h>

namespace cullet::test
{
namespace
{
class BackendRestart : public BackendTest
{
protected:
    /// Five boxes in a row, each touching the next: pairs 1-2, 2-3, 3-4, 4-5.
    BackendRestart()
    {
        for (int i = 0; i < 5; ++i)
            session.add(boxAt(static_cast<float>(i), 0, 0));
    }

    BackendSession session{GetParam().make()};
};

CULLET_ON_EVERY_BACKEND(BackendRestart);

TEST_P(BackendRestart, FromTheCorrectPairsReportsNothing)
{
    session.restart({{1, 2}, {2, 3}, {3, 4}, {4, 5}});
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {}));
}

TEST_P(BackendRestart, FromNothingReportsEverything)
{
    ASSERT_TRUE(session.step());
    session.restart({});
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{1, 2}, {2, 3}, {3, 4}, {4, 5}}, {}));
}

TEST_P(BackendRestart, FromStalePairsReportsTheDifference)
{
    // 1-3 does not overlap, 7 and 9 never lived.
    session.restart({{1, 3}, {2, 3}, {4, 7}, {7, 9}});
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{1, 2}, {3, 4}, {4, 5}}, {{1, 3}, {4, 7}, {7, 9}}));
}

TEST_P(BackendRestart, KnowsDestroyedProxies)
{
    ASSERT_TRUE(session.step());
    session.table.destroy(2);
    session.restart(session.pairs());
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {{2, 3}, {3, 4}}));
}

TEST_P(BackendRestart, ReadsRowsThatAreNotDirty)
{
    ASSERT_TRUE(session.step());
    session.changeBackend(GetParam().make());
    session.table.setBox(0, boxAt(10, 0, 0));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {{1, 2}}));
    // A box that was clean when the second backend began meets the one that moved.
    session.table.setBox(0, boxAt(3.5f, 0, 0));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{1, 4}, {1, 5}}, {}));
}

TEST_P(BackendRestart, KeepsPairsWithinTheMarginAndPairsThatTheFilterNoLongerWants)
{
    session.margin = 0.25f;
    session.table.setBox(0, boxAt(-0.5f, 0, 0));
    session.table.setFilter(4, {1, 0});
    session.restart({{1, 2}, {4, 5}});
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{2, 3}, {3, 4}}, {}));
}

TEST_P(BackendRestart, InTheMiddleOfARandomWorldLosesNothing)
{
    BackendSession random{GetParam().make()};
    random.margin = 0.125f;
    RandomWorldOptions options;
    options.count = 60;
    RandomWorld world(11, options, random.table);
    for (int step = 0; step < 60; ++step)
    {
        SCOPED_TRACE("seed 11, step " + std::to_string(step));
        if (step % 7 == 3)
            random.restart(random.pairs());
        if (step % 11 == 5)
            random.changeBackend(GetParam().make());
        if (step % 17 == 9)
        {
            Pairs stale = random.pairs();
            if (stale.size() > 4)
                stale.erase(stale.begin(), stale.begin() + 4);
            random.restart(stale);
        }
        ASSERT_TRUE(random.step());
        world.step();
    }
    EXPECT_GT(random.addedTotal(), 100u);
    EXPECT_GT(random.removedTotal(), 100u);
}
}  // namespace
}  // namespace cullet::test
