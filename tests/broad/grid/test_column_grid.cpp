// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Columns: the kernels of every instruction set on the same columns, and which columns an update reads.

#include "cullet/broad/brute/brute_force_backend.h"
#include "cullet/broad/grid/column_grid_backend.h"
#include "cullet/broad/grid/columns/cell_bounds.h"
#include "cullet/broad/grid/columns/column_builder.h"
#include "cullet/broad/grid/columns/column_soa.h"
#include "cullet/tests/broad/grid/column_kernels_here.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/random_world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <tuple>

namespace cullet::test
{
namespace
{
using Hit = std::tuple<TaggedRow, TaggedRow, float>;
using Hits = std::vector<Hit>;

/// Receives the pairs that a kernel finds, in parts when its buffer is full.
struct Collector
{
    Hits hits;
    PairBuffer buffer;

    explicit Collector(float maxGap, float minGap)
    {
        buffer.maxGap = maxGap;
        buffer.minGap = minGap;
        buffer.context = this;
        buffer.flush = [](void* context, const PairBuffer& found)
        {
            for (std::uint32_t i = 0; i < found.count; ++i)
                static_cast<Collector*>(context)->add(found.first[i], found.second[i], found.gap[i]);
        };
    }

    void add(TaggedRow a, TaggedRow b, float gap) { hits.emplace_back(std::min(a, b), std::max(a, b), gap); }

    Hits take()
    {
        buffer.deliver();
        std::sort(hits.begin(), hits.end());
        return std::move(hits);
    }
};

/// A column of random boxes, laid out by one set of kernels.
struct RandomColumn
{
    RandomColumn(const ColumnKernels& kernels, Random& random, std::uint32_t firstId, std::uint32_t count,
                 bool isBounded, std::uint32_t sortedCount = 0)
    {
        std::vector<Aabb> boxes(firstId);
        for (std::uint32_t i = 0; i < count; ++i)
        {
            const float half = random.chance(0.1f) ? 4.0f : 0.75f;
            const float z = random.between(-2, 2), y = random.between(-2, 2), x = random.between(-30, 30);
            boxes.push_back(boxAt(x, y, z, half));
            if (random.chance(0.02f))
                boxes.back().max[0] = kInfinity;
            const bool startsZ = random.chance(0.5f), startsY = random.chance(0.5f);
            proxyRows.push_back((firstId + i) | tagRow(0, startsY, startsZ));
        }
        proxyRows.resize(count + 4);
        pool.resize(count + 8);
        soa = pool.column(0, proxyRows.data(), count, isBounded);
        ColumnBuilder().build(
            kernels, {proxyRows.data(), count, sortedCount, boxes.data(), 0, -30, 30, 0.125f, nullptr}, soa);
        for (std::uint32_t i = 0; isBounded && i < count; ++i)
            soa.bounds[i] = static_cast<float>(soa.proxyRow[i] % 7) * 0.05f;
        // Entries behind the sentinel may have any value.
        for (std::uint32_t i = count + 1; i < count + 8; ++i)
            soa.x0[i] = soa.y0[i] = soa.z0[i] = -100.0f;
    }

    std::vector<TaggedRow> proxyRows;
    ColumnPool pool;
    ColumnSoa soa;
};

float gapOf(const ColumnSoa& a, std::uint32_t i, const ColumnSoa& b, std::uint32_t j)
{
    return std::max({b.x0[j] - a.x1[i], a.x0[i] - b.x1[j], b.y0[j] - a.y1[i], a.y0[i] - b.y1[j],
                     b.z0[j] - a.z1[i], a.z0[i] - b.z1[j]});
}

/// Adds a pair if the definition says so.
void addIfFound(const ColumnSoa& a, std::uint32_t i, const ColumnSoa& b, std::uint32_t j, Collector& out)
{
    const float gap = gapOf(a, i, b, j);
    const bool isNear = a.bounds != nullptr ? std::abs(gap) <= a.bounds[i] + b.bounds[j]
                                            : gap <= out.buffer.maxGap && !(gap <= out.buffer.minGap);
    if (isNear && (a.proxyRow[i] | b.proxyRow[j]) >= kOwnsPair)
        out.add(a.proxyRow[i], b.proxyRow[j], gap);
}

struct KernelCase
{
    const char* name;
    float maxGap;
    float minGap;
    bool isBounded;
};

class ColumnKernelSets : public testing::TestWithParam<KernelCase>
{
};

TEST_P(ColumnKernelSets, FindPairsOfDefinitionWithEveryWidth)
{
    constexpr std::uint32_t kCounts[] = {2, 3, 15, 16, 17, 33, 700};
    std::size_t hits = 0;
    for (const ColumnKernels* kernels : kernelsHere())
    {
        SCOPED_TRACE(kernels->name);
        Random random(31);
        for (const std::uint32_t count : kCounts)
        {
            SCOPED_TRACE(count);
            const RandomColumn a(*kernels, random, 0, count, GetParam().isBounded);
            const RandomColumn b(*kernels, random, count, count / 2 + 1, GetParam().isBounded);
            ASSERT_EQ(a.soa.count, count);
            ASSERT_TRUE(std::is_sorted(a.soa.x0, a.soa.x0 + count));
            Collector expected(GetParam().maxGap, GetParam().minGap);
            Collector found(GetParam().maxGap, GetParam().minGap);
            for (std::uint32_t i = 0; i < count; ++i)
            {
                for (std::uint32_t j = i + 1; j < count; ++j)
                    addIfFound(a.soa, i, a.soa, j, expected);
                for (std::uint32_t j = 0; j < b.soa.count; ++j)
                    addIfFound(a.soa, i, b.soa, j, expected);
            }
            kernels->scanSelf(a.soa, found.buffer);
            kernels->scanCross(a.soa, b.soa, found.buffer);
            const Hits all = found.take();
            ASSERT_EQ(all, expected.take());
            hits += all.size();
        }
    }
    EXPECT_GT(hits, 1000u * kernelsHere().size());
}

INSTANTIATE_TEST_SUITE_P(All, ColumnKernelSets,
                         testing::Values(KernelCase{"Overlapping", 0, kNoMinGap, false},
                                         KernelCase{"NearTouching", 0.25f, -0.25f, false},
                                         KernelCase{"Bounded", 0.6f, kNoMinGap, true}),
                         [](const auto& test) { return test.param.name; });

TEST(ColumnKernelSets, FindOverlapsOfOneBoxFromGivenEntryOn)
{
    std::size_t hits = 0;
    for (const ColumnKernels* kernels : kernelsHere())
    {
        SCOPED_TRACE(kernels->name);
        Random random(32);
        const RandomColumn row(*kernels, random, 0, 300, false);
        const RandomColumn queries(*kernels, random, 300, 40, false);
        for (std::uint32_t i = 0; i < queries.soa.count; ++i)
        {
            // The sentinel is no entry: queries end before infinity.
            queries.soa.x1[i] = std::min(queries.soa.x1[i], std::numeric_limits<float>::max());
            Collector expected(0, kNoMinGap);
            Collector found(0, kNoMinGap);
            for (std::uint32_t j = i; j < row.soa.count; ++j)
                addIfFound(queries.soa, i, row.soa, j, expected);
            kernels->scanOne(queries.soa, i, row.soa, i, found.buffer);
            const Hits all = found.take();
            ASSERT_EQ(all, expected.take()) << i;
            hits += all.size();
        }
    }
    EXPECT_GT(hits, 100u * kernelsHere().size());
}

struct Motions
{
    std::vector<std::uint32_t> octaves = std::vector<std::uint32_t>(256);
    std::vector<std::uint32_t> migrated;
    std::vector<std::uint32_t> motions;  // as bits
    float largest = 0;

    bool operator==(const Motions& other) const
    {
        return octaves == other.octaves && migrated == other.migrated && motions == other.motions &&
               largest == other.largest;
    }
};

/// An empty, unbounded or far box, one on the borders of cells, or any box.
Aabb randomBox(Random& random)
{
    Aabb box = boxAt(random.point(-9, 9));
    const std::uint32_t kind = random.below(12);
    if (kind == 0)
        box.max[random.below(3)] = kInfinity;
    if (kind == 1)
        box.min[random.below(3)] = kNan;
    if (kind == 2)
        box = translated(box, 0, 3e9f, -1e20f);
    if (kind > 6)
    {
        const auto max = static_cast<float>(random.below(4));
        box = cube(static_cast<float>(random.below(9)) - 4, max);
    }
    return box;
}

Motions motionsBy(const ColumnKernels& kernels, int sweepAxis, const std::vector<Aabb>& now,
                  const std::vector<Aabb>& then)
{
    std::vector<std::uint32_t> rows;
    for (std::uint32_t row = 0; row < now.size(); row += 1 + row % 2)
        rows.push_back(row);
    Motions result;
    result.migrated.resize(rows.size());
    std::vector<float> motions(now.size());
    MotionSums sums = {result.octaves.data(), result.migrated.data()};
    kernels.compareBoxes({now.data(), then.data(), sweepAxis, 0.0625f, 0.5f, 2.0f, motions.data()},
                         rows.data(), static_cast<std::uint32_t>(rows.size()), sums);
    result.migrated.resize(sums.migratedCount);
    result.largest = sums.largest;
    result.motions.resize(motions.size());
    std::memcpy(result.motions.data(), motions.data(), motions.size() * sizeof(float));
    return result;
}

TEST(ColumnKernelSets, ReportSameMotionsWithEveryWidth)
{
    Random random(34);
    std::vector<Aabb> then;
    std::vector<Aabb> now;
    for (int i = 0; i < 4000; ++i)
    {
        then.push_back(randomBox(random));
        const float stride = random.chance(0.5f) ? 0.25f : 1.0f;
        now.push_back(random.chance(0.1f)
                          ? randomBox(random)
                          : translated(then.back(), random.between(-stride, stride), 0, stride));
    }
    for (int axis = 0; axis < 3; ++axis)
    {
        const Motions expected = motionsBy(kColumnKernelsBaseline, axis, now, then);
        EXPECT_GT(expected.migrated.size(), 500u);
        EXPECT_LT(expected.migrated.size(), 2500u);
        EXPECT_GT(expected.largest, 0.9f);
        EXPECT_GT(expected.octaves[255], 100u);
        for (const ColumnKernels* kernels : kernelsHere())
            EXPECT_TRUE(motionsBy(*kernels, axis, now, then) == expected)
                << kernels->name << ", axis " << axis;
    }
}

TEST(ColumnKernelSets, LocateBoxesInSameCellsWithEveryWidth)
{
    Random random(35);
    std::vector<Aabb> boxes;
    for (int i = 0; i < 2001; ++i)
        boxes.push_back(randomBox(random));
    boxes[7].max[2] = boxes[7].min[2] + 1000.0f;
    using Cells = std::vector<std::int32_t>;
    const auto locatedBy = [&](const ColumnKernels& kernels, int axis)
    {
        std::vector<LocatedBox> block(boxes.size());
        std::vector<std::uint32_t> outliers(boxes.size());
        const LocatedCounts counts =
            kernels.locateBoxes({boxes.data(), nullptr, axis, 0.125f, 0.0625f, 0.5f, 1e9f, 8}, 0, 2001,
                                block.data(), outliers.data());
        EXPECT_EQ(counts.plain + counts.outliers, boxes.size());
        Cells all(outliers.begin(), outliers.begin() + counts.outliers);
        for (std::uint32_t i = 0; i < counts.plain; ++i)
        {
            const CellRect& cells = block[i].cells;
            all.insert(all.end(), {static_cast<std::int32_t>(block[i].proxyRow), cells.j0, cells.j1, cells.k0,
                                   cells.k1});
        }
        EXPECT_GT(counts.plain, 1000u);
        EXPECT_GT(counts.outliers, 200u);
        EXPECT_LT(counts.outliers, 800u);
        return all;
    };
    for (int axis = 0; axis < 3; ++axis)
    {
        const Cells expected = locatedBy(kColumnKernelsBaseline, axis);
        for (const ColumnKernels* kernels : kernelsHere())
            EXPECT_EQ(locatedBy(*kernels, axis), expected) << kernels->name << ", axis " << axis;
    }
}

TEST(CellBounds, PutNanIntoLowestCellWithoutConvertingIt)
{
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    const Int4 cells = cellsOfFaces(Float4{kNan, 5.0f, -kInfinity, kInfinity}, {0.0625f, 0.5f});
    constexpr auto kFarthest = static_cast<std::int32_t>(kFarthestCell);
    EXPECT_EQ(cells[0], -kFarthest);
    EXPECT_EQ(cells[1], 2);
    EXPECT_EQ(cells[2], -kFarthest);
    EXPECT_EQ(cells[3], kFarthest);
}

/// Statistics of boxes of size 1 in a cube, `movers` of which left their skins in each of the last updates.
BackendStats statsOfMovers(std::uint32_t movers, int updates)
{
    GridOptions options;
    options.threads = 1;
    options.rebuildFraction = 1;  // enters the resting mode at once
    ColumnGridBackend grid(options);
    ProxyTable table;
    Random random(33);
    for (std::uint32_t i = 0; i < 20000; ++i)
        table.create(boxAt(random.point(0, 60)), i + 1, {1, -1});
    PairDelta delta;
    for (int update = 0; update < updates; ++update)
    {
        EXPECT_EQ(grid.update(table.beginUpdate(0.0625f, false), delta), Status::Ok);
        table.endUpdate();
        for (std::uint32_t i = 0; i < movers; ++i)
            table.setBox(i * 37, translated(table.box(i * 37), 0.25f, 0.125f, 0));
    }
    return grid.stats();
}

TEST(ColumnGridBackend, VisitsOnlyColumnsOfBoxesThatMove)
{
    const BackendStats few = statsOfMovers(20, 7);
    EXPECT_STREQ(few.path, "incremental");
    // A box of size 1, grown by the skin of its list, touches at most four of the wider cells.
    EXPECT_GE(few.cellsVisited, 20u);
    EXPECT_LE(few.cellsVisited, 4u * 20u);
    EXPECT_GT(few.candidates, 0u);
    EXPECT_LT(few.candidates, 20u * 200u);
    const BackendStats more = statsOfMovers(200, 7);
    EXPECT_STREQ(more.path, "incremental");
    EXPECT_GE(more.cellsVisited, 5 * few.cellsVisited);
    EXPECT_LE(more.cellsVisited, 4u * 200u);
    EXPECT_EQ(statsOfMovers(0, 7).candidates, 0u);
}

TEST(ColumnGridBackend, VisitsSquareColumnsOfOneWidthPerLevelThatCoverAllBoxes)
{
    GridOptions options;
    options.threads = 1;
    options.flatLimit = 0;
    options.levels = 2;
    ColumnGridBackend grid(options);
    ProxyTable table;
    Random random(35);
    std::vector<Aabb> boxes;
    for (std::uint32_t i = 0; i < 4000; ++i)
    {
        boxes.push_back(boxAt(random.point(-40, 40), i % 50 == 0 ? 4.0f : 0.25f));
        table.create(boxes.back(), i + 1, {1, -1});
    }
    PairDelta delta;
    ASSERT_EQ(grid.update(table.beginUpdate(0.0f, false), delta), Status::Ok);
    ASSERT_EQ(grid.stats().levels, 2u) << "other worlds show less";

    std::vector<Aabb> columns;
    float widths[2] = {};
    grid.forEachCell(
        [&](const Aabb& column, std::uint32_t level)
        {
            ASSERT_LT(level, 2u);
            for (int axis = 0; axis < 3; ++axis)
            {
                const float width = column.max[axis] - column.min[axis];
                if (std::isinf(width))
                    continue;
                widths[level] = widths[level] == 0 ? width : widths[level];
                EXPECT_NEAR(width, widths[level], 1e-4f * widths[level]);
            }
            columns.push_back(column);
        });
    ASSERT_GT(columns.size(), 50u);
    EXPECT_GT(widths[0], 0);
    EXPECT_GT(widths[1], widths[0]);
    for (const Aabb& column : columns)
    {
        EXPECT_EQ(std::count_if(column.max, column.max + 3, [](float face) { return std::isinf(face); }), 1);
        EXPECT_TRUE(
            std::any_of(boxes.begin(), boxes.end(), [&](const Aabb& box) { return overlaps(box, column); }))
            << "a column without a box";
    }
    for (const Aabb& box : boxes)
        for (const float* corner : {box.min, box.max})
        {
            const Aabb point = {{corner[0], corner[1], corner[2]}, {corner[0], corner[1], corner[2]}};
            ASSERT_TRUE(std::any_of(columns.begin(), columns.end(),
                                    [&](const Aabb& column) { return overlaps(point, column); }));
        }
}

TEST(ColumnGridBackend, RefillsWhenBoxesMoveIntoMoreNewColumnsThanThereIsRoomFor)
{
    constexpr std::uint32_t kBoxes = 4000, kMovers = 5;
    GridOptions options;
    options.threads = 1;
    options.flatLimit = 0;
    options.settles = false;
    ColumnGridBackend grid(options);
    BruteForceBackend brute;
    ProxyTable table;
    Random random(36);
    for (std::uint32_t i = 0; i < kBoxes; ++i)
        table.create(boxAt(random.point(0, 16)), i + 1, {1, -1});
    PairDelta delta, expected;
    int follows = 0, refills = 0;
    for (std::uint32_t update = 0; update < 40; ++update)
    {
        const ProxyView view = table.beginUpdate(0.0f, false);
        ASSERT_EQ(grid.update(view, delta), Status::Ok);
        ASSERT_EQ(brute.update(view, expected), Status::Ok);
        table.endUpdate();
        ASSERT_EQ(delta.added, expected.added) << "update " << update;
        ASSERT_EQ(delta.removed, expected.removed) << "update " << update;
        const std::string reason = grid.stats().decision.reason;
        follows += reason == "few boxes came into other cells" ? 1 : 0;
        refills += reason == "the rows could not be kept" ? 1 : 0;
        // Out of the crowd, each into columns of its own.
        for (std::uint32_t i = 0; i < kMovers; ++i)
            table.setBox(update * kMovers + i, boxAt(random.point(-1000, 1000)));
    }
    EXPECT_GT(follows, 20);
    EXPECT_GT(refills, 0);
}

TEST(ColumnGridBackend, CountsTestsOfAwakeBoxesWithEachOther)
{
    GridOptions options;
    options.threads = 1;
    options.rebuildFraction = 1;  // enters the resting mode at once
    ColumnGridBackend grid(options);
    ProxyTable table;
    Random random(34);
    for (std::uint32_t i = 0; i < 5000; ++i)
        table.create(boxAt(random.point(0, 40)), i + 1, {1, -1});
    // Far from the others, and all of them overlap: 40 * 39 / 2 pairs.
    std::vector<ProxyId> awake;
    for (std::uint32_t i = 0; i < 40; ++i)
        awake.push_back(table.create(boxAt(100, 100, 100 + 0.01f * float(i)), 6000 + i, {1, -1}));
    PairDelta delta;
    int counted = 0;
    for (int update = 0; update < 12; ++update)
    {
        ASSERT_EQ(grid.update(table.beginUpdate(0.0625f, false), delta), Status::Ok);
        table.endUpdate();
        if (update > 2 && grid.stats().path == std::string("incremental"))
        {
            ++counted;
            EXPECT_GE(grid.stats().candidates, 780u) << update;
            EXPECT_LT(grid.stats().candidates, 8u * 780u) << update;
        }
        for (const ProxyId row : awake)
            table.setBox(row, translated(table.box(row), 0.05f, 0, 0));
    }
    EXPECT_GT(counted, 5);
}

TEST(ColumnGridBackend, VisitsNoColumnWhileNeighbourListsCoverMovedBoxes)
{
    const BackendStats stats = statsOfMovers(200, 6);
    EXPECT_STREQ(stats.path, "incremental");
    EXPECT_EQ(stats.cellsVisited, 0u);
    EXPECT_GT(stats.candidates, 0u);
    EXPECT_LT(stats.candidates, 200u * 20u);
}
}  // namespace
}  // namespace cullet::test
