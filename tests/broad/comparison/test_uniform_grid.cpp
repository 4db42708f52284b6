// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/pair.h"
#include "cullet/comparison/uniform_grid.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr float kTiny = std::numeric_limits<float>::denorm_min();

Aabb randomBox(Random& random, float side, float largest)
{
    Aabb box;
    for (int axis = 0; axis < 3; ++axis)
    {
        // Coordinates on a lattice of quarters, so that faces often lie on cell borders.
        box.min[axis] = std::floor(random.between(-side, side) * 4) / 4;
        box.max[axis] = box.min[axis] + std::floor(random.between(0, largest) * 4) / 4;
    }
    return box;
}

std::uint64_t cellCount(const CellRange& cells)
{
    std::uint64_t count = 1;
    for (int axis = 0; axis < 3; ++axis)
        count *= static_cast<std::uint64_t>(std::max(0, cells.high[axis] - cells.low[axis] + 1));
    return count;
}

CellRange intersection(CellRange a, const CellRange& b)
{
    for (int axis = 0; axis < 3; ++axis)
    {
        a.low[axis] = std::max(a.low[axis], b.low[axis]);
        a.high[axis] = std::min(a.high[axis], b.high[axis]);
    }
    return a;
}

/// Overlapping pairs of rows that the grid reports; fails on a pair not reported exactly once per row.
std::set<std::pair<std::uint32_t, std::uint32_t>> overlapsFound(const UniformGrid& grid,
                                                                const std::vector<Aabb>& boxes)
{
    std::multiset<std::pair<std::uint32_t, std::uint32_t>> visits;
    for (std::uint32_t row = 0; row < boxes.size(); ++row)
    {
        if (!grid.contains(row))
            continue;
        grid.forEachSharing(row, false, [&](std::uint32_t other) { visits.insert(std::minmax(row, other)); });
    }
    std::set<std::pair<std::uint32_t, std::uint32_t>> found;
    for (const auto& [a, b] : visits)
    {
        EXPECT_EQ(visits.count({a, b}), 2u) << "once from either side";
        if (overlaps(boxes[a], boxes[b]))
            found.insert({a, b});
    }
    return found;
}

std::set<std::pair<std::uint32_t, std::uint32_t>> overlapsOf(const std::vector<Aabb>& boxes)
{
    std::set<std::pair<std::uint32_t, std::uint32_t>> found;
    for (std::uint32_t a = 0; a < boxes.size(); ++a)
    {
        for (std::uint32_t b = a + 1; b < boxes.size(); ++b)
        {
            if (overlaps(boxes[a], boxes[b]))
                found.insert({a, b});
        }
    }
    return found;
}

TEST(CellOf, RoundsDownOnBothSidesOfZero)
{
    EXPECT_EQ(cellOf(0.0f, 0), 0);
    EXPECT_EQ(cellOf(-0.0f, 0), 0);
    EXPECT_EQ(cellOf(0.75f, 0), 0);
    EXPECT_EQ(cellOf(-0.25f, 0), -1);
    EXPECT_EQ(cellOf(-1.0f, 0), -1);
    EXPECT_EQ(cellOf(kTiny, 0), 0);
    EXPECT_EQ(cellOf(-kTiny, 0), -1);
    EXPECT_EQ(cellOf(-3.0f, 1), -2);
    EXPECT_EQ(cellOf(0.3f, -2), 1);
    EXPECT_EQ(cellOf(3 * kTiny, -149), 3);
}

TEST(CellOf, PutsABorderIntoTheUpperCell)
{
    for (int exponent = -20; exponent <= 20; ++exponent)
    {
        for (int cell = -5; cell <= 5; ++cell)
        {
            const float border = std::ldexp(static_cast<float>(cell), exponent);
            ASSERT_EQ(cellOf(border, exponent), cell);
            ASSERT_EQ(cellOf(std::nextafter(border, -kInfinity), exponent), cell - 1);
        }
    }
}

TEST(CellOf, SaturatesAndNeverOverflows)
{
    EXPECT_EQ(cellOf(kInfinity, 0), kLastCell);
    EXPECT_EQ(cellOf(-kInfinity, 0), -kLastCell);
    EXPECT_EQ(cellOf(3e38f, -149), kLastCell);
    EXPECT_EQ(cellOf(-3e38f, -149), -kLastCell);
    EXPECT_EQ(cellOf(1e9f, 0), 1000000000);
    EXPECT_EQ(cellOf(-1e9f, 0), -1000000000);
    EXPECT_EQ(cellOf(2e9f, 0), kLastCell);
    EXPECT_EQ(cellOf(kNan, 0), -kLastCell) << "a defined value, though no valid box has it";
}

TEST(CellOf, IsMonotonicOverTheWholeRange)
{
    SCOPED_TRACE("seed 1");
    Random random(1);
    int saturated = 0;
    for (int i = 0; i < 100000; ++i)
    {
        const float magnitude = random.logUniform(-149, 31);
        float a = magnitude * (random.chance(0.5f) ? 1.0f : -1.0f);
        float b = random.chance(0.3f) ? std::nextafter(a, kInfinity) : random.between(-1e9f, 1e9f);
        if (a > b)
            std::swap(a, b);
        const int exponent = static_cast<int>(random.below(60)) - 40;
        ASSERT_LE(cellOf(a, exponent), cellOf(b, exponent)) << a << " " << b << " " << exponent;
        const double low = std::ldexp(static_cast<double>(cellOf(a, exponent)), exponent);
        if (std::abs(cellOf(a, exponent)) == kLastCell)
        {
            ++saturated;
            continue;
        }
        ASSERT_LE(low, a);
        ASSERT_LT(a, low + std::ldexp(1.0, exponent));
    }
    EXPECT_GT(saturated, 1000);
    EXPECT_LT(saturated, 50000);
}

TEST(CellHash, EqualsXorOfCellNumbersTimesPrimes)
{
    EXPECT_EQ(cellHash({1, 0, 0}), 73856093u);
    EXPECT_EQ(cellHash({0, 1, 0}), 19349663u);
    EXPECT_EQ(cellHash({0, 0, 1}), 83492791u);
    EXPECT_EQ(cellHash({1, 2, 3}), 73856093u ^ 2u * 19349663u ^ 3u * 83492791u);
    EXPECT_EQ(cellHash({-1, 0, 0}), 0u - 73856093u);
}

TEST(UniformGrid, EqualsBruteForceOnTenThousandScenes)
{
    SCOPED_TRACE("seed 2");
    Random random(2);
    std::size_t pairs = 0;
    std::size_t emptyScenes = 0;
    for (int scene = 0; scene < 10000; ++scene)
    {
        const std::uint32_t bucketCount = random.below(4);
        UniformGrid grid(static_cast<int>(random.below(3)) - 1, bucketCount);
        std::vector<Aabb> boxes;
        for (std::uint32_t row = 0; row < 7; ++row)
        {
            boxes.push_back(randomBox(random, 2, 2));
            grid.addBox(row, boxes.back());
        }
        const auto expected = overlapsOf(boxes);
        ASSERT_EQ(overlapsFound(grid, boxes), expected) << "scene " << scene;
        pairs += expected.size();
        emptyScenes += expected.empty() ? 1 : 0;
    }
    EXPECT_GT(pairs, 10000u);
    EXPECT_LT(emptyScenes, 5000u);
}

TEST(UniformGrid, KeepsNoIdAndNoCellWhenAllBoxesAreRemoved)
{
    SCOPED_TRACE("seed 3");
    Random random(3);
    UniformGrid grid(0);
    std::uint64_t bytes = 0;
    for (int round = 0; round < 20; ++round)
    {
        std::vector<std::uint32_t> rows;
        for (std::uint32_t row = 0; row < 300; ++row)
        {
            const auto mark = random.chance(0.5f) ? UniformGrid::Mark::Bold : UniformGrid::Mark::Regular;
            grid.addBox(row, randomBox(random, 10, 3), mark);
            rows.push_back(row);
            if (random.chance(0.3f))
                grid.updateBox(row, randomBox(random, 10, 3));
        }
        EXPECT_GT(grid.counters().ids, 300u);
        EXPECT_GT(grid.counters().cells, 100u);
        for (std::size_t left = rows.size(); left > 0; --left)
        {
            std::swap(rows[random.below(static_cast<std::uint32_t>(left))], rows[left - 1]);
            grid.removeBox(rows[left - 1]);
            ASSERT_FALSE(grid.contains(rows[left - 1]));
        }
        ASSERT_EQ(grid.counters().ids, 0u);
        ASSERT_EQ(grid.counters().cells, 0u);
        if (round == 4)
            bytes = grid.bytes();
    }
    EXPECT_LE(grid.bytes(), bytes * 3 / 2) << "freed ids and cells are used again";
}

TEST(UniformGrid, TouchesOnlyCellsThatUpdatedBoxEntersOrLeaves)
{
    SCOPED_TRACE("seed 4");
    Random random(4);
    UniformGrid grid(0);
    std::vector<Aabb> boxes;
    for (std::uint32_t row = 0; row < 30; ++row)
    {
        boxes.push_back(randomBox(random, 4, 3));
        grid.addBox(row, boxes.back());
    }
    std::uint64_t untouched = 0, partly = 0, wholly = 0;
    for (int move = 0; move < 100000; ++move)
    {
        const std::uint32_t row = random.below(30);
        const auto nudged = [&](const Aabb& from)
        {
            const float y = random.between(-0.3f, 0.3f), x = random.between(-0.3f, 0.3f);
            return translated(from, x, y, 0);
        };
        const bool isSmall = random.chance(0.9f);
        const Aabb box = isSmall ? nudged(boxes[row]) : randomBox(random, 4, 3);
        const CellRange before = cellsOf(boxes[row], 0);
        const CellRange after = cellsOf(box, 0);
        const std::uint64_t common = cellCount(intersection(before, after));
        const std::uint64_t expected = cellCount(before) + cellCount(after) - 2 * common;
        const std::uint64_t touched = grid.counters().touchedTotal;
        grid.updateBox(row, box);
        boxes[row] = box;
        ASSERT_EQ(grid.counters().touchedTotal - touched, expected) << "move " << move;
        ++(expected == 0 ? untouched : common > 0 ? partly : wholly);
        if (move % 2000 == 0)
        {
            ASSERT_EQ(overlapsFound(grid, boxes), overlapsOf(boxes)) << "move " << move;
        }
    }
    ASSERT_EQ(overlapsFound(grid, boxes), overlapsOf(boxes));
    for (const std::uint64_t count : {untouched, partly, wholly})
        EXPECT_GT(count, 1000u);
}

TEST(UniformGrid, KeepsPairThatLeavesOneOfItsSharedCells)
{
    // The pair shares cells 0 and 1 on x, then only cell 1: removing pairs cell by cell would lose it.
    UniformGrid grid(0);
    std::vector<Aabb> boxes = {cube(0.5f, 1.5f), cube(0.75f, 1.75f)};
    grid.addBox(0, boxes[0]);
    grid.addBox(1, boxes[1]);
    boxes[1] = cube(1.25f, 1.75f);
    grid.updateBox(1, boxes[1]);
    EXPECT_EQ(overlapsFound(grid, boxes).size(), 1u);
}

TEST(UniformGrid, FindsSamePairsWithAnyNumberOfBuckets)
{
    for (const std::uint32_t bucketCount : {0u, 1u, 2u, 7u, 64u, 1000003u})
    {
        SCOPED_TRACE("buckets " + std::to_string(bucketCount));
        Random random(5);
        UniformGrid grid(-1, bucketCount);
        std::vector<Aabb> boxes;
        for (std::uint32_t row = 0; row < 150; ++row)
        {
            boxes.push_back(randomBox(random, 3, 1.5f));
            grid.addBox(row, boxes.back());
        }
        for (std::uint32_t row = 0; row < 150; row += 2)
        {
            boxes[row] = randomBox(random, 3, 1.5f);
            grid.updateBox(row, boxes[row]);
        }
        EXPECT_EQ(overlapsFound(grid, boxes), overlapsOf(boxes));
        EXPECT_GT(overlapsOf(boxes).size(), 50u);
    }
}

TEST(UniformGrid, PutsFarAndHugeBoxesIntoLastCell)
{
    UniformGrid grid(0);
    const std::vector<Aabb> boxes = {cube(1e30f, 1e30f), cube(1e30f, 2e30f), cube(-1e30f, -1e30f)};
    for (std::uint32_t row = 0; row < 3; ++row)
        grid.addBox(row, boxes[row]);
    EXPECT_EQ(overlapsFound(grid, boxes), overlapsOf(boxes));
    EXPECT_EQ(grid.counters().cells, 2u);
}
}  // namespace
}  // namespace cullet::test
