// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The variants of the cells of Lesson 04 that serve for comparison: what they store and visit. The conformance suite
// checks their pairs.

#include "cullet/comparison/backends.h"
#include "cullet/comparison/cell_grid.h"
#include "cullet/comparison/cell_hash.h"
#include "cullet/comparison/comparison_stats.h"
#include "cullet/comparison/pair_counts.h"
#include "cullet/tests/support/backend_session.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <array>
#include <map>
#include <set>
#include <utility>
#include <vector>

namespace cullet::test
{
namespace
{
using RowPairs = std::set<std::pair<std::uint32_t, std::uint32_t>>;

TEST(CellHash, EqualsAMapForEveryStorageAndNumberOfSlots)
{
    for (const GridStorage storage : {GridStorage::Chained, GridStorage::OpenAddressing, GridStorage::Array})
    {
        for (const std::uint32_t slotCount : {0u, 1u, 7u, 64u, 1000u})
        {
            SCOPED_TRACE("seed 1, storage " + std::to_string(static_cast<int>(storage)) + ", slots " +
                         std::to_string(slotCount));
            Random random(1);
            CellHash directory(storage, slotCount);
            std::map<std::array<std::int32_t, 3>, std::uint32_t> expected;
            std::vector<std::uint32_t> unused(400);
            for (std::uint32_t i = 0; i < 400; ++i)
                unused[i] = i;
            int erased = 0;
            for (int step = 0; step < 4000; ++step)
            {
                const CellNumber cell = {static_cast<std::int32_t>(random.below(10)) - 5,
                                         static_cast<std::int32_t>(random.below(9)) - 4,
                                         static_cast<std::int32_t>(random.below(8)) - 4};
                const auto found = expected.find({cell[0], cell[1], cell[2]});
                ASSERT_EQ(directory.find(cell), found == expected.end() ? CellHash::kNone : found->second);
                if (found != expected.end())
                {
                    directory.erase(found->second);
                    unused.push_back(found->second);
                    expected.erase(found);
                    ++erased;
                }
                else if (!unused.empty())
                {
                    directory.insert(cell, unused.back());
                    expected[{cell[0], cell[1], cell[2]}] = unused.back();
                    unused.pop_back();
                }
            }
            std::size_t visited = 0;
            directory.forEach(
                [&](const CellNumber& cell) {
                    visited += expected.count({cell[0], cell[1], cell[2]});
                });
            EXPECT_EQ(visited, expected.size());
            EXPECT_GT(erased, 1000);
        }
    }
}

TEST(PairCounts, MatchesMapAfterRandomAdditionsAndSubtractions)
{
    SCOPED_TRACE("seed 2");
    Random random(2);
    PairCounts counts;
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> expected;
    for (int step = 0; step < 20000; ++step)
    {
        const std::uint32_t a = random.below(30);
        const std::uint32_t b = (a + 1 + random.below(29)) % 30;
        int& count = expected[std::minmax(a, b)];
        if (count > 0 && random.chance(0.55f))
        {
            counts.subtract(a, b);
            --count;
        }
        else
        {
            counts.add(b, a);
            ++count;
        }
    }
    RowPairs left, found;
    for (const auto& [pair, count] : expected)
    {
        if (count > 0)
            left.insert(pair);
    }
    counts.forEach([&](std::uint32_t a, std::uint32_t b) { EXPECT_TRUE(found.insert({a, b}).second); });
    EXPECT_EQ(found, left);
    EXPECT_EQ(counts.size(), left.size());
    EXPECT_GT(left.size(), 50u);
    EXPECT_LT(left.size(), 400u);
}

TEST(CountedPairs, EqualPairsThatShareCellAtCoarserLevel)
{
    SCOPED_TRACE("seed 3");
    Random random(3);
    CellGridOptions options;
    options.countsPairs = true;
    CellGrid grid(options);
    const auto randomBox = [&]
    {
        const float half = random.logUniform(-3, 2);
        return boxAt(random.point(-10, 10), half);
    };
    for (std::uint32_t row = 0; row < 60; ++row)
        grid.addBox(row, randomBox());
    for (int step = 0; step < 500; ++step)
    {
        const std::uint32_t row = random.below(60);
        if (grid.level(row) == CellGrid::kAbsent)
            grid.addBox(row, randomBox());
        else if (random.chance(0.2f))
            grid.removeBox(row);
        else
            grid.updateBox(row, randomBox());
        grid.dropUnusedLevels();
        RowPairs counted, sharing;
        grid.forEachCounted([&](std::uint32_t a, std::uint32_t b) { counted.insert({a, b}); });
        for (std::uint32_t other = 0; other < 60; ++other)
        {
            if (grid.level(other) != CellGrid::kAbsent)
                grid.forEachNeighbour(
                    other, [&](std::uint32_t third) { sharing.insert(std::minmax(other, third)); });
        }
        ASSERT_EQ(counted, sharing) << "step " << step;
        ASSERT_GT(counted.size(), 10u);
    }
}

TEST(OnePointPlacement, StoresABoxOnceAndSearchesEightCellsOfItsLevel)
{
    SCOPED_TRACE("seed 4");
    Random random(4);
    CellGridOptions options;
    options.placement = GridPlacement::OnePoint;
    options.a = 0.25;
    options.b = 0.5;
    CellGrid grid(options);
    std::uint64_t neighbours = 0;
    for (std::uint32_t row = 0; row < 300; ++row)
    {
        // One level: sizes from 0.5 to 1 in cells of 2.
        const float half = random.between(0.26f, 0.5f);
        grid.addBox(row, boxAt(random.point(-5, 5), half));
        const std::uint64_t before = grid.counters().visitedTotal;
        grid.forEachNeighbour(row, [&](std::uint32_t) { ++neighbours; });
        ASSERT_LE(grid.counters().visitedTotal - before, 8u);
    }
    EXPECT_EQ(grid.counters().levels, 1u);
    EXPECT_EQ(grid.counters().ids, 300u);
    EXPECT_GT(neighbours, 1000u);
}

/// Cost of a cloud in which all boxes move a little, for a cell backend with a given placement.
struct CloudCost
{
    std::uint64_t cells = 0;  ///< touched and visited
    std::uint64_t pairs = 0;
};

CloudCost runCoherentCloud(const CellsOptions& options)
{
    Random random(5);
    BackendSession session{makeCellGridBackend(options)};
    std::vector<Aabb> boxes;
    for (int i = 0; i < 500; ++i)
    {
        const float half = random.logUniform(-3, 0);
        boxes.push_back(boxAt(random.point(0, 16), half));
        session.add(boxes.back());
    }
    EXPECT_TRUE(session.step());
    CloudCost cost;
    for (int step = 0; step < 10; ++step)
    {
        for (std::uint32_t row = 0; row < boxes.size(); ++row)
        {
            const float y = random.between(-0.02f, 0.02f), x = random.between(-0.02f, 0.02f);
            boxes[row] = translated(boxes[row], x, y, 0);
            session.table.setBox(row, boxes[row]);
        }
        EXPECT_TRUE(session.step());
        const BackendStats stats = session.backend().stats();
        EXPECT_STREQ(stats.path, "incremental");
        cost.cells += comparisonStatsOf(session.backend()).cellsTouched + stats.cellsVisited;
    }
    cost.pairs = session.pairs().size();
    return cost;
}

TEST(CellGridBackend, TouchesSixTimesFewerCellsWhenCountingPairsOverCoarserLevels)
{
    CellsOptions options;
    options.rebuildFraction = 1;
    options.placement = GridPlacement::OwnLevel;
    const CloudCost first = runCoherentCloud(options);
    options.placement = GridPlacement::AllCoarser;
    options.countsPairs = true;
    const CloudCost second = runCoherentCloud(options);
    EXPECT_EQ(first.pairs, second.pairs);
    EXPECT_GT(first.pairs, 200u);
    EXPECT_GT(first.cells, 6 * second.cells);
}

TEST(CellGridBackend, TouchesOnlyTheCellsThatChange)
{
    for (const GridPlacement placement : {GridPlacement::AllCoarser, GridPlacement::OneGrid})
    {
        CellsOptions options;
        options.placement = placement;
        options.cellScale = 1;
        options.rebuildFraction = 1;
        BackendSession session{makeCellGridBackend(options)};
        // Size 1, and a mean of 1: cells of size 1; each box lies in 2 x 1 x 1 cells.
        for (int i = 0; i < 100; ++i)
            session.add({{3.0f * static_cast<float>(i) + 0.5f, 0.25f, 0.25f},
                         {3.0f * static_cast<float>(i) + 1.5f, 0.75f, 0.75f}});
        ASSERT_TRUE(session.step());
        EXPECT_EQ(comparisonStatsOf(session.backend()).cellsTouched, 200u);
        const auto move = [&](float x, float y)
        {
            session.table.setBox(7, translated(session.table.box(7), x, y, 0));
            EXPECT_TRUE(session.step());
            return comparisonStatsOf(session.backend()).cellsTouched;
        };
        EXPECT_EQ(move(0.25f, 0), 0u) << "within its cells";
        EXPECT_EQ(move(1, 0), 2u) << "leaves one and enters one";
        EXPECT_EQ(move(0, 0.5f), 2u) << "enters two and leaves none";
        EXPECT_EQ(move(0, 0), 0u);
        ASSERT_TRUE(session.step());
        EXPECT_EQ(comparisonStatsOf(session.backend()).cellsTouched, 0u);
        EXPECT_STREQ(session.backend().stats().path, "idle");
    }
}

TEST(CellGridBackend, FitsOneGridToMeanBoxAndTreatsGiantsAsUnbounded)
{
    CellsOptions options;
    options.placement = GridPlacement::OneGrid;
    BackendSession session{makeCellGridBackend(options)};
    for (int i = 0; i < 1000; ++i)
        session.add(boxAt(static_cast<float>(i), 0, 0, 0.25f));
    session.add(boxAt(500, 0, 0, 1));  // four times as large as the others: in the same grid
    ASSERT_TRUE(session.step());
    EXPECT_EQ(session.backend().stats().levels, 1u);
    EXPECT_EQ(session.backend().stats().unbounded, 0u);
    const std::uint64_t tests = session.backend().stats().candidates;
    session.add(boxAt(500, 0, 0, 40));  // 80^3 cells and more
    ASSERT_TRUE(session.step());
    EXPECT_EQ(session.backend().stats().levels, 1u);
    EXPECT_EQ(session.backend().stats().unbounded, 1u);
    EXPECT_EQ(session.backend().stats().candidates, 1001u) << "only the new box, which meets everybody";
    EXPECT_LT(tests, 8000u);
}

TEST(LeGrandBackend, StoresEightCellsOfBoxAsLargeAsCellThatTouchesThree)
{
    // From just below 0 to 2048: its size is rounded to that of a cell.
    const float below = -std::numeric_limits<float>::denorm_min();
    BackendSession session{makeLeGrandBackend()};
    session.add({{-7.75f, below, below}, {504.0f, 5.0f, 2048.0f}});
    session.add({{0, 0, 2000}, {1, 1, 2001}});
    ASSERT_TRUE(session.step());
    EXPECT_EQ(session.backend().stats().entries, 8u + 1);
    EXPECT_EQ(session.backend().stats().pairs, 1u);
}

TEST(LeGrandBackend, ConcentratesTestsInOneCellWhenSizesOrPositionsAreUneven)
{
    SCOPED_TRACE("seed 6");
    Random random(6);
    std::uint64_t tests[3];
    for (int scene = 0; scene < 3; ++scene)
    {
        // Equal boxes spread out; half of them in a corner; one large one among them, which makes the cells large.
        BackendSession session{makeLeGrandBackend()};
        for (int i = 0; i < 1000; ++i)
        {
            const float side = scene == 1 && i % 2 == 0 ? 2.0f : 20.0f;
            session.add(boxAt(random.point(0, side)));
        }
        if (scene == 2)
            session.add(boxAt(10, 10, 10, 8));
        ASSERT_TRUE(session.step());
        const BackendStats stats = session.backend().stats();
        EXPECT_GE(stats.entries, 1000u);
        EXPECT_LE(stats.entries, 8u * 1001);
        tests[scene] = comparisonStatsOf(session.backend()).mostTests;
    }
    EXPECT_GT(tests[0], 0u);
    EXPECT_GT(tests[1], 100 * tests[0]);
    EXPECT_GT(tests[2], 100 * tests[0]);
}
}  // namespace
}  // namespace cullet::test
