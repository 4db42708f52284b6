// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// What the column grid does to save work, and no pair shows.

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/broad/grid/column_grid_backend.h"
#include "cullet/broad/grid/columns/column_grid.h"
#include "cullet/broad/grid/columns/column_hash.h"
#include "cullet/broad/proxy_table.h"
#include "cullet/broad/verlet/verlet_pairs.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

namespace cullet::test
{
namespace
{
class PairCounter final : public PairSink
{
public:
    void take(unsigned /*worker*/, const PairBuffer& found) override { pairs += found.count; }

    std::uint64_t pairs = 0;
};

/// A grid on one thread whose cells are as wide as a box of size 1.
struct NarrowGrid
{
    static GridOptions options()
    {
        GridOptions result;
        result.cellScale = 1;
        return result;
    }

    void scan(const std::vector<Aabb>& boxes)
    {
        GridInput input;
        input.boxes = boxes.data();
        input.count = static_cast<std::uint32_t>(boxes.size());
        grid.scan(input, found, ColumnUse::Query);
    }

    ParallelLoops workers{1};
    ColumnGrid grid{options(), workers};
    PairCounter found;
};

std::vector<Aabb> randomBoxes(Random& random, std::uint32_t count, float low, float high)
{
    std::vector<Aabb> boxes;
    for (std::uint32_t i = 0; i < count; ++i)
        boxes.push_back(boxAt(random.point(low, high)));
    return boxes;
}

TEST(ColumnHash, BeginsWithTheBucketOfACellWhenBucketsAreFewerThanSlots)
{
    constexpr std::uint32_t kBuckets = 7;
    std::set<std::uint32_t> columns;
    for (std::int32_t j = -20; j < 20; ++j)
    {
        ColumnHash hash;
        hash.reset(64, kBuckets, {});
        columns.insert(hash.findOrInsert(packCell(0, j, 3 * j + 1)));
    }
    EXPECT_EQ(columns.size(), kBuckets);
    EXPECT_LT(*columns.rbegin(), kBuckets);
}

TEST(ColumnGrid, OrdersBoxesByColumnAndAlongItWhenColumnsAreMany)
{
    SCOPED_TRACE("seed 61");
    Random random(61);
    const std::vector<Aabb> boxes = randomBoxes(random, 8000, -25, 25);
    NarrowGrid narrow;
    narrow.scan(boxes);
    EXPECT_GT(narrow.found.pairs, 1000u);
    const GridPlan& plan = narrow.grid.plan();
    const auto columnOf = [&](const Aabb& box)
    {
        return std::pair(std::floor(box.min[plan.tileAxisY] * plan.inverseWidth[0]),
                         std::floor(box.min[plan.tileAxisZ] * plan.inverseWidth[0]));
    };
    std::vector<std::uint32_t> rows(boxes.size());
    std::iota(rows.rbegin(), rows.rend(), 0u);
    const std::vector<std::uint32_t> order = narrow.grid.orderAlongColumns(boxes.data(), rows);
    ASSERT_EQ(std::set(order.begin(), order.end()).size(), boxes.size());
    std::set columns{columnOf(boxes[rows[order[0]]])};
    for (std::size_t i = 1; i < order.size(); ++i)
    {
        const Aabb& before = boxes[rows[order[i - 1]]];
        const Aabb& box = boxes[rows[order[i]]];
        if (columnOf(before) == columnOf(box))
            EXPECT_LE(before.min[plan.sweepAxis], box.min[plan.sweepAxis]) << i;
        else
            EXPECT_TRUE(columns.insert(columnOf(box)).second) << "comes back to a column at " << i;
    }
    EXPECT_GT(columns.size(), 600u);
}

TEST(ColumnGrid, ClearsASmallTableWhenFewColumnsAreLeft)
{
    SCOPED_TRACE("seed 62");
    Random random(62);
    NarrowGrid narrow;
    narrow.scan(randomBoxes(random, 8000, -1000, 1000));
    const std::uint32_t large = narrow.grid.tableSize();
    EXPECT_GE(large, 8000u);
    const std::vector<Aabb> few = randomBoxes(random, 100, -10, 10);
    for (int scan = 0; scan < 8; ++scan)
        narrow.scan(few);
    EXPECT_LE(narrow.grid.tableSize(), large / 8);
    EXPECT_GT(narrow.grid.tableSize(), 100u);
}

TEST(VerletPairs, AreChangeableFromTheFirstOneOn)
{
    VerletPairs pairs;
    for (std::uint32_t row = 0; row < 5; ++row)
        pairs.add({row, row + 1}, VerletPairs::State::Persistent);
    pairs.add({0, 2}, VerletPairs::State::Overlapping);
    pairs.add({0, 3}, VerletPairs::State::Candidate);
    pairs.finish(6);
    EXPECT_EQ(pairs.firstChangeable(), 5u);
    EXPECT_EQ(pairs.changeableCount(), 2u);
}

TEST(GridDecision, ComparesASampleOfTheBoxesWhenMostJumpedBefore)
{
    SCOPED_TRACE("seed 63");
    constexpr std::uint32_t kCount = 3000;
    GridOptions options;
    options.threads = 1;
    ColumnGridBackend grid(options);
    ProxyTable table;
    Random random(63);
    for (std::uint32_t id = 1; id <= kCount; ++id)
        table.create(boxAt(random.point(0, 40)), id, {1, -1});
    PairDelta delta;
    std::vector<std::uint32_t> strays;
    for (int update = 0; update < 5; ++update)
    {
        ASSERT_EQ(grid.update(table.beginUpdate(0.0625f, false), delta), Status::Ok);
        table.endUpdate();
        strays.push_back(grid.stats().decision.strays);
        for (ProxyId row = 0; row < kCount; ++row)
        {
            // The first ones come back to their places.
            const Aabb before = table.box(row);
            table.setBox(row, boxAt(random.point(0, 40)));
            if (row < kCount / 8)
                table.setBox(row, before);
        }
    }
    EXPECT_EQ(strays[1], kCount / 8 * 7) << "compares all boxes";
    for (std::size_t update = 2; update < strays.size(); ++update)
        EXPECT_EQ(strays[update], kCount) << "compares a sample in update " << update;
    EXPECT_STREQ(grid.stats().decision.reason, "most boxes jumped");
}

TEST(ColumnGrid, FindsPairsBesideAWindowOfFarMoreColumnsAlongOneAxis)
{
    SCOPED_TRACE("seed 64");
    Random random(64);
    std::vector<Aabb> boxes;
    for (std::uint32_t i = 0; i < 6000; ++i)
    {
        const float z = random.between(0, 150), y = random.between(0, 3);
        boxes.push_back(boxAt(random.between(0, 4000), y, z));
    }
    // Few enough to lie outside of the window, each with a partner.
    for (std::uint32_t i = 0; i < 20; ++i)
    {
        const float x = random.between(0, 4000), y = random.between(20, 149), z = random.between(0, 3);
        boxes.push_back(boxAt(x, y, z));
        boxes.push_back(boxAt(x + 0.5f, y - 0.5f, z + 0.5f));
    }
    std::uint64_t expected = 0;
    for (std::size_t i = 0; i < boxes.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
            expected += overlaps(boxes[i], boxes[j]) ? 1 : 0;
    NarrowGrid narrow;
    narrow.scan(boxes);
    EXPECT_EQ(narrow.grid.plan().sweepAxis, 0);
    EXPECT_EQ(narrow.found.pairs, expected);
}

/// Counts how often it is given pairs: once for each part of the columns that has some.
class TakeCounter final : public PairSink
{
public:
    void take(unsigned /*worker*/, const PairBuffer& found) override { takes += found.count != 0 ? 1 : 0; }

    std::atomic<int> takes{0};
};

TEST(ColumnGrid, ScansColumnsInPartsWhenThereAreThreads)
{
    SCOPED_TRACE("seed 65");
    Random random(65);
    const std::vector<Aabb> boxes = randomBoxes(random, 20000, -25, 25);
    GridInput input;
    input.boxes = boxes.data();
    input.count = static_cast<std::uint32_t>(boxes.size());
    int takes[2];
    for (const int threads : {1, 2})
    {
        ParallelLoops workers{threads};
        ColumnGrid grid{NarrowGrid::options(), workers};
        TakeCounter counter;
        grid.scan(input, counter, ColumnUse::Query);
        takes[threads - 1] = counter.takes;
    }
    EXPECT_GT(takes[1], takes[0] + 1);
}
}  // namespace
}  // namespace cullet::test
