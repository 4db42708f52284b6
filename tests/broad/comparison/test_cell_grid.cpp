// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/comparison/cell_grid.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <vector>

namespace cullet::test
{
namespace
{
using Rows = std::pair<std::uint32_t, std::uint32_t>;

Aabb boxOfSize(float size)
{
    return {{0, 0, 0}, {size, size / 2, 0}};
}

Aabb randomBox(Random& random, float side, int sizeLow, int sizeHigh)
{
    Aabb box;
    const float size = random.logUniform(sizeLow, sizeHigh);
    for (int axis = 0; axis < 3; ++axis)
    {
        box.min[axis] = random.between(-side, side);
        box.max[axis] = box.min[axis] + size * (random.chance(0.5f) ? 1.0f : random.unit());
    }
    return box;
}

/// Number of visits of each pair of rows, from either side.
std::map<Rows, int> visitsOf(const CellGrid& grid, std::uint32_t rowCount)
{
    std::map<Rows, int> visits;
    for (std::uint32_t row = 0; row < rowCount; ++row)
    {
        if (grid.level(row) == CellGrid::kAbsent)
            continue;
        grid.forEachNeighbour(row, [&](std::uint32_t other) { ++visits[std::minmax(row, other)]; });
    }
    return visits;
}

/// Expects one visit of each visited pair from either side, including all overlapping pairs. Returns the number of
/// overlapping pairs.
std::size_t expectExact(const CellGrid& grid, const std::vector<Aabb>& boxes)
{
    const auto visits = visitsOf(grid, static_cast<std::uint32_t>(boxes.size()));
    for (const auto& [rows, count] : visits)
        EXPECT_EQ(count, 2) << rows.first << "-" << rows.second;
    std::size_t overlapCount = 0;
    for (std::uint32_t a = 0; a < boxes.size(); ++a)
    {
        for (std::uint32_t b = a + 1; b < boxes.size(); ++b)
        {
            const bool isPair = isValid(boxes[a]) && isValid(boxes[b]) && overlaps(boxes[a], boxes[b]);
            EXPECT_TRUE(!isPair || visits.count({a, b}) == 1) << a << "-" << b;
            overlapCount += isPair ? 1 : 0;
        }
    }
    return overlapCount;
}

TEST(CellGridLevel, IsHalfOpenAtPowersOfTwo)
{
    const CellGrid grid;
    for (int exponent = -148; exponent <= 127; ++exponent)
    {
        const float size = std::ldexp(1.0f, exponent);
        // A box with size / s = 1 is at the level of s, one with size / s = 0.5 is not.
        EXPECT_EQ(grid.levelOf(boxOfSize(size)), exponent);
        EXPECT_EQ(grid.levelOf(boxOfSize(std::nextafter(size, 0.0f))), exponent - (exponent == -148 ? 1 : 0));
        if (exponent < 127)
        {
            EXPECT_EQ(grid.levelOf(boxOfSize(std::nextafter(size, kInfinity))), exponent + 1);
        }
    }
}

TEST(CellGridLevel, FitsSizesOfHalfToOneCellForAllFloats)
{
    SCOPED_TRACE("seed 1");
    const CellGrid grid;
    Random random(1);
    for (std::uint32_t exponent = 0; exponent < 255; ++exponent)
    {
        for (int i = 0; i < 200; ++i)
        {
            const std::uint32_t bits = exponent << 23 | random.below(1u << 23);
            float size = 0;
            std::memcpy(&size, &bits, sizeof size);
            const int level = grid.levelOf(boxOfSize(size));
            if (size > std::ldexp(1.0f, 127))
            {
                ASSERT_EQ(level, CellGrid::kUnbounded);
                continue;
            }
            const double ratio = std::ldexp(static_cast<double>(size), -level);
            ASSERT_TRUE((ratio > 0.5 && ratio <= 1.0) || size == 0) << size << " at level " << level;
        }
    }
    EXPECT_EQ(grid.levelOf(cube(0, 0)), CellGrid::kFinestLevel);
}

TEST(CellGridLevel, DependsOnTheLargestExtent)
{
    const CellGrid grid;
    EXPECT_EQ(grid.levelOf({{0, 0, 0}, {1, 8, 2}}), 3);
    EXPECT_EQ(grid.levelOf({{-1, 0, 0}, {1, 0, 2}}), 1);
    EXPECT_EQ(grid.levelOf({{0, 0, -4}, {0, 0, 0}}), 2);
}

TEST(CellGridLevel, IsSoCoarseThatCellNumbersDoNotSaturate)
{
    const CellGrid grid;
    for (const float far : {1.0f, -1e9f, 1e20f, -3e38f})
    {
        const Aabb box = cube(far, far);
        const int level = grid.levelOf(box);
        EXPECT_LT(std::abs(cellOf(far, level)), kLastCell);
        EXPECT_GE(std::abs(cellOf(far, level)), kLastCell / 2);
    }
}

TEST(CellGridLevel, IsUnboundedForBoxesWithoutBounds)
{
    const CellGrid grid;
    EXPECT_EQ(grid.levelOf(cube(-kInfinity, kInfinity)), CellGrid::kUnbounded);
    EXPECT_EQ(grid.levelOf(cube(kInfinity, kInfinity)), CellGrid::kUnbounded);
    EXPECT_EQ(grid.levelOf({{0, 0, -kInfinity}, {1, 1, 1}}), CellGrid::kUnbounded);
    EXPECT_EQ(grid.levelOf(cube(-3e38f, 3e38f)), CellGrid::kUnbounded);
    EXPECT_EQ(grid.levelOf(cube(-1e18f, 1e18f)), 61);
}

TEST(CellGridLevel, FollowsTheConfiguredBounds)
{
    CellGridOptions options;
    options.a = 0.25;
    options.b = 1.0;
    CellGrid grid(options);
    grid.addBox(0, boxOfSize(1.0f));
    EXPECT_EQ(grid.level(0), 0);
    grid.updateBox(0, boxOfSize(0.5f));
    EXPECT_EQ(grid.level(0), 0) << "0.25 < 0.5 <= 1, though a new box of this size goes to level -1";
    grid.updateBox(0, boxOfSize(0.25f));
    EXPECT_EQ(grid.level(0), -2);
    grid.updateBox(0, boxOfSize(0.3f));
    EXPECT_EQ(grid.level(0), -1);

    options.a = 0.025;
    options.b = 0.05;
    const CellGrid wide(options);
    EXPECT_EQ(wide.levelOf(boxOfSize(1.0f)), 5) << "20 <= 2^5";
}

TEST(CellGrid, VisitsEachPairOnceFromEitherSide)
{
    SCOPED_TRACE("seed 2");
    Random random(2);
    std::size_t overlapCount = 0;
    for (int scene = 0; scene < 60; ++scene)
    {
        CellGridOptions options;
        options.bucketCount = random.below(4);
        options.updatesByRemoveAndAdd = scene % 3 == 0;
        options.a = scene % 2 == 0 ? 0.5 : 0.25;
        CellGrid grid(options);
        std::vector<Aabb> boxes(60, kEmptyAabb);
        for (int operation = 0; operation < 200; ++operation)
        {
            const std::uint32_t row = random.below(60);
            const bool isRemoved = isValid(boxes[row]) && random.chance(0.2f);
            const Aabb box = random.chance(0.03f) ? cube(-kInfinity, 0) : randomBox(random, 10, -6, 5);
            if (isRemoved)
                grid.removeBox(row);
            else if (isValid(boxes[row]))
                grid.updateBox(row, box);
            else
                grid.addBox(row, box);
            boxes[row] = isRemoved ? kEmptyAabb : box;
            if (operation % 50 == 49)
                overlapCount += expectExact(grid, boxes);
            if (random.chance(0.1f))
                grid.dropUnusedLevels();
        }
    }
    EXPECT_GT(overlapCount, 10000u);
}

TEST(CellGrid, HandlesSizesOfOneToAMillion)
{
    SCOPED_TRACE("seed 3");
    Random random(3);
    CellGrid grid;
    std::vector<Aabb> boxes;
    for (std::uint32_t row = 0; row < 300; ++row)
    {
        boxes.push_back(randomBox(random, 500, -10, 10));
        grid.addBox(row, boxes.back());
    }
    EXPECT_GE(grid.counters().levels, 18u);
    EXPECT_GT(expectExact(grid, boxes), 500u);
    // At most eight cells in each grid from the box's own level up.
    EXPECT_LE(grid.counters().ids, 300u * 8 * grid.counters().levels);
}

TEST(CellGrid, AddsLevelForLargeBoxAndDropsItWhenUnused)
{
    CellGrid grid;
    for (std::uint32_t row = 0; row < 10; ++row)
        grid.addBox(row, boxAt(3.0f * static_cast<float>(row), 0.5f, 0.5f, 0.25f));
    const CellGrid::Counters before = grid.counters();
    EXPECT_EQ(before.levels, 1u);
    grid.addBox(10, cube(-100, 100));
    EXPECT_EQ(grid.counters().levels, 2u);
    EXPECT_GT(grid.counters().ids, before.ids + 10) << "all smaller boxes are regular in the new grid";
    std::set<std::uint32_t> neighbours;
    grid.forEachNeighbour(10, [&](std::uint32_t other) { neighbours.insert(other); });
    EXPECT_EQ(neighbours.size(), 10u);
    grid.removeBox(10);
    grid.dropUnusedLevels();
    EXPECT_EQ(grid.counters().levels, 1u);
    EXPECT_EQ(grid.counters().ids, before.ids);
    EXPECT_EQ(grid.counters().cells, before.cells);
    for (std::uint32_t row = 0; row < 10; ++row)
        grid.removeBox(row);
    grid.dropUnusedLevels();
    EXPECT_EQ(grid.counters().levels, 0u);
    EXPECT_EQ(grid.counters().ids, 0u);
}

TEST(CellGrid, KeepsNothingWhenCleared)
{
    CellGrid grid;
    grid.addBox(0, cube(0, 1));
    grid.addBox(1, cube(-kInfinity, kInfinity));
    grid.clear();
    EXPECT_EQ(grid.level(0), CellGrid::kAbsent);
    EXPECT_EQ(grid.counters().ids, 0u);
    EXPECT_EQ(grid.counters().unbounded, 0u);
    grid.addBox(1, cube(0, 1));
    int visits = 0;
    grid.forEachNeighbour(1, [&](std::uint32_t) { ++visits; });
    EXPECT_EQ(visits, 0);
}

TEST(CellGrid, TouchesFiveTimesFewerCellsOnUpdateThanOnRemoveAndAdd)
{
    std::uint64_t touched[2] = {};
    for (const bool isSimple : {false, true})
    {
        CellGridOptions options;
        options.updatesByRemoveAndAdd = isSimple;
        CellGrid grid(options);
        Random random(4);
        std::vector<Aabb> boxes;
        for (std::uint32_t row = 0; row < 100; ++row)
        {
            boxes.push_back(randomBox(random, 10, -3, 2));
            grid.addBox(row, boxes.back());
        }
        const std::uint64_t before = grid.counters().touchedTotal;
        for (int step = 0; step < 20; ++step)
        {
            for (std::uint32_t row = 0; row < 100; ++row)
            {
                const float y = random.between(-0.05f, 0.05f), x = random.between(-0.05f, 0.05f);
                boxes[row] = translated(boxes[row], x, y, 0);
                grid.updateBox(row, boxes[row]);
            }
        }
        touched[isSimple ? 1 : 0] = grid.counters().touchedTotal - before;
        expectExact(grid, boxes);
    }
    EXPECT_GT(touched[0], 0u);
    EXPECT_LT(touched[0] * 5, touched[1]);
}
}  // namespace
}  // namespace cullet::test
