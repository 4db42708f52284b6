// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The contract of every backend, on scenes small enough for results by hand.

#include "cullet/tests/broad/conformance/backend_cases.h"
#include "cullet/tests/support/backend_session.h"
#include "cullet/tests/support/boxes.h"

#include <gtest/gtest.h>

#include <cmath>

namespace cullet::test
{
namespace
{
class BackendConformance : public BackendTest
{
protected:
    BackendSession session{GetParam().make()};
};

CULLET_ON_EVERY_BACKEND(BackendConformance);

TEST_P(BackendConformance, ReportsNoPairsWhenTableIsEmpty)
{
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {}));
}

TEST_P(BackendConformance, DoesNotPairSingleBoxWithItself)
{
    session.add(cube(0, 1));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {}));
}

TEST_P(BackendConformance, ReportsPairsOfBoxesThatOnlyTouch)
{
    session.add(cube(0, 1));
    session.add(boxAt(1.5f, 0.5f, 0.5f));     // face
    session.add(boxAt(0.5f, 1.5f, 1.5f));     // edge
    session.add(boxAt(-0.5f, -0.5f, -0.5f));  // corner
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{1, 2}, {1, 3}, {1, 4}, {2, 3}}, {}));
}

TEST_P(BackendConformance, DoesNotPairBoxesAcrossGapOfOneUlp)
{
    const float justAbove = std::nextafter(1.0f, 2.0f);
    session.add(cube(0, 1));
    for (int axis = 0; axis < 3; ++axis)
    {
        Aabb box = cube(0, 1);
        box.min[axis] = justAbove;
        box.max[axis] = 2;
        session.add(box);
    }
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {}));
}

TEST_P(BackendConformance, ReportsAllPairsOfIdenticalBoxes)
{
    for (int i = 0; i < 3; ++i)
        session.add(cube(-1, 1));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{1, 2}, {1, 3}, {2, 3}}, {}));
}

TEST_P(BackendConformance, ReportsPairsOfZeroSizeBoxesWithBoxesTheyLieIn)
{
    session.add(cube(0, 0));
    session.add(cube(0, 0));
    session.add(cube(-1, 1));
    session.add(cube(1, 1));
    session.add(cube(-0.0f, 0.0f));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{1, 2}, {1, 3}, {1, 5}, {2, 3}, {2, 5}, {3, 4}, {3, 5}}, {}));
}

TEST_P(BackendConformance, ReportsEveryPairWhenTwoHundredBoxesAllOverlap)
{
    for (int i = 0; i < 200; ++i)
        session.add(boxAt(0.001f * static_cast<float>(i), 0, 0));
    ASSERT_TRUE(session.step());
    EXPECT_EQ(session.delta().added.size(), 200u * 199 / 2);
}

TEST_P(BackendConformance, ReportsNoPairWhenTwoHundredBoxesAreApart)
{
    for (int i = 0; i < 200; ++i)
        session.add(boxAt(1.5f * static_cast<float>(i), 0, 0));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {}));
}

TEST_P(BackendConformance, DoesNotPairStaticBodiesWithEachOther)
{
    const Filter isStatic = {2, ~2};
    session.add(cube(0, 1), isStatic);
    session.add(cube(0, 1), isStatic);
    session.add(cube(0, 1), {1, -1});
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{1, 3}, {2, 3}}, {}));
}

TEST_P(BackendConformance, ReportsPairOnlyWhenBothFiltersAccept)
{
    session.add(cube(0, 1), {1, 2});
    session.add(cube(0, 1), {2, 1});  // pairs with 1 by both masks
    session.add(cube(0, 1), {2, 4});  // its own mask excludes 1
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{1, 2}}, {}));
}

TEST_P(BackendConformance, ReportsEveryOverlapWithoutFilterWords)
{
    session.useFilter = false;
    session.add(cube(0, 1), {1, 0});
    session.add(cube(0, 1), {1, 0});
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{1, 2}}, {}));
}

TEST_P(BackendConformance, AddsPairsButRemovesNoneWhenFilterChanges)
{
    const ProxyId first = session.add(cube(0, 1), {1, 0});
    session.add(cube(0, 1));
    session.add(cube(5, 6));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {}));
    session.table.setFilter(first, kEverything);
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{1, 2}}, {}));
    session.table.setFilter(first, {1, 0});
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {}));
    // The pair stays when the box moves, as long as the boxes overlap ...
    session.table.setBox(first, cube(0.5f, 1.5f));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {}));
    // ... and enters again only if the filter words allow it.
    session.table.setBox(first, cube(2, 3));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {{1, 2}}));
    session.table.setBox(first, cube(0, 1));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {}));
}

TEST_P(BackendConformance, RemovesPairWhenBoxesPartAndAddsItWhenTheyMeetAgain)
{
    const ProxyId row = session.add(cube(0, 1));
    session.add(cube(0, 1));
    ASSERT_TRUE(session.step());
    session.table.setBox(row, cube(10, 11));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {{1, 2}}));
    session.table.setBox(row, cube(1, 2));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{1, 2}}, {}));
}

TEST_P(BackendConformance, KeepsPairWithinMarginAndRemovesItBeyond)
{
    session.margin = 0.25f;
    const ProxyId row = session.add(boxAt(0, 0, 0));
    session.add(boxAt(1, 0, 0));
    ASSERT_TRUE(session.step());
    for (const float gap : {0.25f, 0.5f, 0.375f, 0.5f})
    {
        session.table.setBox(row, boxAt(-gap, 0, 0));
        ASSERT_TRUE(session.step());
        EXPECT_TRUE(session.reported({}, {})) << gap;
    }
    session.table.setBox(row, boxAt(-0.5625f, 0, 0));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {{1, 2}}));
    // A gap within the margin is not enough to enter.
    session.table.setBox(row, boxAt(-0.25f, 0, 0));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {}));
}

TEST_P(BackendConformance, KeepsPairHeldByMarginWhileNeitherBoxMoves)
{
    session.margin = 0.25f;
    const ProxyId row = session.add(boxAt(0, 0, 0));
    session.add(boxAt(1, 0, 0));
    const ProxyId other = session.add(boxAt(50, 0, 0));
    ASSERT_TRUE(session.step());
    session.table.setBox(row, boxAt(-0.5f, 0, 0));
    ASSERT_TRUE(session.step());
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {}));
    session.table.setBox(other, boxAt(51, 0, 0));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {}));
    // The partner moves away; the row that moved away first does not move.
    session.table.setBox(row + 1, boxAt(1.0625f, 0, 0));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {{1, 2}}));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {}));
}

TEST_P(BackendConformance, RemovesPairsWhenMarginShrinksThoughNothingMoves)
{
    const ProxyId row = session.add(boxAt(0, 0, 0));
    session.add(boxAt(1, 0, 0));
    for (const float margin : {0.0f, 0.05f, 1.0f})
    {
        session.margin = margin;
        ASSERT_TRUE(session.step());
    }
    session.table.setBox(row, boxAt(-1, 0, 0));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {}));
    session.margin = 0.05f;
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {{1, 2}}));
    session.margin = 1.0f;  // no pair enters by a margin
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {}));
}

TEST_P(BackendConformance, RemovesPairsOfDestroyedRows)
{
    const ProxyId row = session.add(cube(0, 1));
    session.add(cube(0, 1));
    session.add(cube(0, 1));
    ASSERT_TRUE(session.step());
    session.table.destroy(row);
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {{1, 2}, {1, 3}}));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {}));
}

TEST_P(BackendConformance, TreatsDestroyAndCreateInOneStepAsTwoProxies)
{
    const ProxyId first = session.add(cube(0, 1));
    session.add(cube(0, 1));
    ASSERT_TRUE(session.step());
    session.table.destroy(first);
    const ProxyId third = session.add(cube(0, 1));
    EXPECT_NE(third, first) << "the row is not free before the backend has seen that it is empty";
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{2, 3}}, {{1, 2}}));
}

TEST_P(BackendConformance, TreatsReusedRowAsNewProxy)
{
    const ProxyId first = session.add(cube(0, 1));
    session.add(cube(0, 1));
    ASSERT_TRUE(session.step());
    session.table.destroy(first);
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {{1, 2}}));
    EXPECT_EQ(session.add(cube(0.5f, 1.5f)), first);
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{2, 3}}, {}));
}

TEST_P(BackendConformance, IgnoresProxyCreatedAndDestroyedWithinOneStep)
{
    session.add(cube(0, 1));
    session.table.destroy(session.add(cube(0, 1)));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {}));
    session.add(cube(0, 1));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{1, 3}}, {}));
}

TEST_P(BackendConformance, ReportsNothingOnSecondUpdateWithoutChanges)
{
    for (int i = 0; i < 20; ++i)
        session.add(boxAt(0.9f * static_cast<float>(i), 0, 0));
    ASSERT_TRUE(session.step());
    EXPECT_EQ(session.delta().added.size(), 19u);
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {}));
}

TEST_P(BackendConformance, ReportsNothingWhenBoxesAreSetAgainUnchanged)
{
    for (int i = 0; i < 20; ++i)
        session.add(boxAt(0.9f * static_cast<float>(i), 0, 0));
    ASSERT_TRUE(session.step());
    for (ProxyId row = 0; row < 20; ++row)
        session.table.setBox(row, Aabb(session.table.box(row)));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({}, {}));
}

TEST_P(BackendConformance, ReportsPairsOfSparseAndLargestIds)
{
    const std::uint32_t last = 0xffffffffu;
    session.addWithId(last, cube(0, 1));
    session.addWithId(5, cube(0, 1));
    session.addWithId(last - 1, cube(0, 1));
    session.addWithId(0x80000000u, cube(0, 1));
    ASSERT_TRUE(session.step());
    EXPECT_TRUE(session.reported({{5, 0x80000000u},
                                  {5, last - 1},
                                  {5, last},
                                  {0x80000000u, last - 1},
                                  {0x80000000u, last},
                                  {last - 1, last}},
                                 {}));
}
}  // namespace
}  // namespace cullet::test
