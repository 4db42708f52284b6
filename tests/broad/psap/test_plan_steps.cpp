// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The steps that make plans, one at a time. Any plan gives the same pairs, so that a search hides a poor one.

#include "cullet/broad/psap/tiles/tile_planner.h"
#include "cullet/cuda/host/host_exec.h"
#include "cullet/tests/broad/psap/counting_search_probe.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace cullet::test
{
namespace
{
/// The statistics of some boxes.
struct SceneStatistics
{
    explicit SceneStatistics(const std::vector<Aabb>& boxes)
    {
        psap::SumBoxes{boxes.data(), boxes.size(), 1, 1, nullptr, &moments, &sizes}(0);
    }

    psap::Moments moments = {};
    psap::SizeClasses sizes = {};
};

constexpr std::uint64_t kManyBins = 1u << 22;

/// @param perBin as PlanLevels::perBin
psap::LevelPlan levelsFor(const std::vector<Aabb>& boxes, float cellScale, float binScale, double perBin,
                          std::uint64_t bins = kManyBins)
{
    const SceneStatistics scene(boxes);
    psap::LevelPlan plan = {};
    psap::PlanLevels{&scene.moments, &scene.sizes, 1.0,  PsapAxis::X, cellScale, binScale,
                     perBin,         false,        bins, 1,           &plan}(0);
    return plan;
}

TEST(PsapPlans, UseCellsAndBinsOfTheSizesThatAreAskedFor)
{
    SCOPED_TRACE("seed 31");
    Random random(31);
    const std::vector<Aabb> boxes = cubesIn(1000, 4, random);
    for (const double perBin : {0.0, 3.0})
        for (const float cell : {0.5f, 1.0f, 2.5f})
            for (const float bin : {0.25f, 1.0f, 3.0f})
            {
                SCOPED_TRACE(std::to_string(perBin) + " " + std::to_string(cell) + " " + std::to_string(bin));
                const psap::LevelPlan plan = levelsFor(boxes, cell, bin, perBin);
                const psap::PlanLevel& level = plan.levels[0];
                EXPECT_NEAR(level.limit, 1, 0.01);
                EXPECT_NEAR(1 / level.inverseU, cell * level.limit, 1e-4);
                EXPECT_NEAR(1 / level.inverseBin, bin * level.limit, 1e-4);
            }
}

/// Cells that a search visits around each box on its own level, and those around it.
struct Visits
{
    std::uint64_t visited = 0, around = 0;
};

Visits visitsWith(const psap::LevelPlan& plan, const std::vector<Aabb>& boxes)
{
    const psap::PartnerSearch<psap::EveryPair> search = {nullptr, &plan, nullptr, nullptr, {}};
    Visits visits;
    for (const Aabb& box : boxes)
    {
        const psap::SortRecord record = psap::recordOf(box, plan.axes, 0, 0);
        visits.visited += search.cellsAround(record, plan.levels[0], true).count;
        visits.around += search.cellsAround(record, plan.levels[0], false).count;
    }
    return visits;
}

TEST(PsapPlans, VisitHalfOfTheCellsAroundUnlessTheyWrap)
{
    SCOPED_TRACE("seed 32");
    Random random(32);
    const std::vector<Aabb> boxes = cubesIn(2000, 4, random);
    const Visits many = visitsWith(levelsFor(boxes, 0.5f, 0, 0), boxes);
    EXPECT_LT(10 * many.visited, 7 * many.around);
    // So few bins that the cells repeat soon, and the cells before a box may be those after it.
    const std::uint64_t few = psap::kReservedBins + 8;
    const Visits wrapping = visitsWith(levelsFor(boxes, 0.5f, 8, 0, few), boxes);
    EXPECT_EQ(wrapping.visited, wrapping.around);
}

TEST(PsapPlans, SeeRecordsOverlapByAsMuchAsTheirBoxes)
{
    SCOPED_TRACE("seed 33");
    Random random(33);
    int apart = 0, byAxis[3] = {};
    for (int trial = 0; trial < 1000; ++trial)
    {
        const Aabb a = boxAt(random.point(-1, 1)), b = boxAt(random.point(-1, 1), random.between(0, 1));
        const float expected = psap::overlapOf(a, b);
        for (const psap::Axes& axes : {psap::Axes{0, 1, 2}, psap::Axes{1, 2, 0}, psap::Axes{2, 0, 1}})
            ASSERT_EQ(psap::overlapOf(psap::recordOf(a, axes, 0, 0), psap::recordOf(b, axes, 1, 0)),
                      expected);
        apart += expected < 0 ? 1 : 0;
        for (int axis = 0; axis < 3; ++axis)
            byAxis[axis] +=
                psap::sharedLength(a.min[axis], a.max[axis], b.min[axis], b.max[axis]) == expected ? 1 : 0;
    }
    EXPECT_GT(apart, 200);
    EXPECT_GT(*std::min_element(byAxis, byAxis + 3), 200);
}

/// The tiles for so many unit cubes in a block with these sides.
psap::TilePlan tilesFor(double count, const std::array<float, 3>& sides)
{
    const SceneStatistics corners({boxAt(0, 0, 0), boxAt(sides)});
    psap::TilePlan plan = {};
    psap::ChooseTileCounts{&corners.moments, &corners.sizes, count / 2, PsapAxis::X, true, &plan}(0);
    return plan;
}

TEST(PsapTiles, PlanNearlyAsManyTilesAsThereMayBeInHugeWorldsOfAnyShape)
{
    SCOPED_TRACE("seed 34");
    Random random(34);
    constexpr std::uint32_t kMost = psap::TileShape::kMostTiles;
    std::uint32_t most = 0;
    for (int world = 0; world < 600; ++world)
    {
        std::array<float, 3> sides = random.point(2000, 4000);
        if (world % 2 != 0)
            sides[static_cast<std::size_t>(world) / 2 % 3] = 1;
        SCOPED_TRACE(testing::PrintToString(sides));
        const psap::TilePlan plan = tilesFor(1e8, sides);
        const std::uint32_t(&counts)[3] = plan.steps.counts;
        EXPECT_EQ(plan.shape.tiles, counts[0] * counts[1] * counts[2]);
        ASSERT_LE(plan.shape.tiles, kMost);
        ASSERT_GT(plan.shape.tiles, kMost * 8 / 10);
        most = std::max(most, plan.shape.tiles);
        const float edge = *std::max_element(sides.begin(), sides.end()) /
                           static_cast<float>(*std::max_element(counts, counts + 3));
        for (std::size_t axis = 0; axis < 3; ++axis)
            EXPECT_NEAR(static_cast<float>(counts[axis]), std::max(1.0f, sides[axis] / edge), 3.0f);
    }
    EXPECT_GT(most, kMost * 98 / 100);
}

TEST(PsapTiles, MeasureCornersFromTheTileThatTheyAreIn)
{
    SCOPED_TRACE("seed 35");
    Random random(35);
    const std::vector<Aabb> boxes = cubesIn(20000, 4, random);
    const SceneStatistics scene(boxes);
    psap::TilePlan plan = {};
    psap::ChooseTileCounts{&scene.moments, &scene.sizes, 1, PsapAxis::X, true, &plan}(0);
    std::vector<std::uint32_t> steps(3 * psap::TileSteps::kPerAxis);
    for (std::uint64_t i = 0; i < boxes.size(); ++i)
        psap::CountSteps{{boxes.data(), 1}, &plan, steps.data()}(i);
    for (std::uint64_t axis = 0; axis < 3; ++axis)
        psap::CutTiles{steps.data(), &plan}(axis);
    EXPECT_GT(*std::min_element(plan.steps.counts, plan.steps.counts + 3), 2u);
    for (const Aabb& box : boxes)
    {
        const psap::SortRecord record = psap::recordOf(box, plan.axes, 0, 0);
        const std::uint32_t tile = psap::tilesOf(plan.steps, plan.ofStep[0], record).home(plan.steps);
        const psap::TileFrame frame(plan, tile);
        const std::uint32_t corner = frame.lowCorner(record);
        const std::uint32_t quanta[3] = {psap::TileBox::s(corner), psap::TileBox::u(corner),
                                         psap::TileBox::v(corner)};
        const float position[3] = {record.front.s0, record.front.u0, record.back.v0};
        for (int axis = 0; axis < 3; ++axis)
            ASSERT_NEAR(frame.low[axis] + static_cast<float>(quanta[axis]) / plan.scale[axis], position[axis],
                        1.05f / plan.scale[axis])
                << axis;
    }
}

/// HostExec that records which boxes of a sample are counted in their tiles.
class TileCountingExec : public psap::HostExec
{
public:
    using HostExec::HostExec;

    template <class Step>
    void forEachFrom(std::uint64_t begin, std::uint64_t end, const Step& step)
    {
        if constexpr (std::is_same_v<Step, psap::CountTiles>)
            ranges.emplace_back(begin, end);
        HostExec::forEachFrom(begin, end, step);
    }

    std::vector<std::pair<std::uint64_t, std::uint64_t>> ranges;
};

TEST(PsapTiles, CountEachBoxOnceForEachPlan)
{
    SCOPED_TRACE("seed 36");
    Random random(36);
    const std::vector<Aabb> boxes = cubesIn(3001, 4, random);
    PsapOptions options;
    options.order = PsapOrder::Tiles;
    options.updatesPerPlan = 1;
    TileCountingExec exec(options);
    psap::TilePlanner<TileCountingExec> planner(options, options.axis);
    const psap::SearchInput input = {boxes.data(), boxes.size()};
    int plans = 0;
    // The first plan is made at once.
    std::uint64_t counted = 0;
    for (int update = 0; update < 60; ++update)
    {
        planner.poll(exec);
        planner.prepare(exec, input);
        planner.advanceNextPlan(exec, input);
        for (const auto& [begin, end] : exec.ranges)
        {
            ASSERT_EQ(begin, counted % boxes.size()) << update;
            counted = end;
            ASSERT_LE(counted, boxes.size()) << update;
            plans += counted == boxes.size() ? 1 : 0;
        }
        exec.ranges.clear();
    }
    EXPECT_GT(plans, 3);
}

// A few more may become large in later frames.
TEST(PsapTiles, LeaveAtMostHalfOfThePlacesForLargeBoxesToTheLargestOnes)
{
    constexpr std::uint32_t kHalf = psap::PlaceInTiles::kMostUnbounded / 2;
    for (const std::uint32_t large : {1u, kHalf, kHalf + 1, 4 * kHalf})
    {
        std::vector<Aabb> boxes(1000, boxAt(0, 0, 0));
        std::fill_n(boxes.begin(), large, boxAt(0, 0, 0, 2.5f));
        const SceneStatistics scene(boxes);
        psap::TilePlan plan = {};
        psap::ChooseTileCounts{&scene.moments, &scene.sizes, 1, PsapAxis::X, true, &plan}(0);
        EXPECT_NEAR(plan.limit, large <= kHalf ? 1 : 5, 0.01) << large;
    }
}

TEST(PsapTiles, DoNotPayWhenTilesAreFullOrBoxesInSeveral)
{
    constexpr std::uint64_t kSamples = 1000;
    constexpr double kMostRoom = 2300;
    const auto areUsed = [&](float fullest, std::uint32_t entries)
    {
        psap::TilePlan plan = {};
        plan.shape.tiles = 100;
        plan.fullestBits = bitsOf(fullest);
        plan.entries = entries;
        std::uint64_t word = 0;
        psap::ChooseTileRoom{kSamples, 1, kMostRoom, false, &plan, 1, &word}(0);
        return psap::ChooseTileRoom::shapeOf(word).tiles == 100;
    };
    EXPECT_TRUE(areUsed(1000, 1500));
    EXPECT_FALSE(areUsed(1000, 1700)) << "each box is in more than 1.6 tiles";
    EXPECT_TRUE(areUsed(2150, 1500));
    EXPECT_FALSE(areUsed(2250, 1500)) << "a tile has no room left";
}

TEST(PsapPlans, CountBoxesInTheWindowOnly)
{
    SCOPED_TRACE("seed 38");
    Random random(38);
    std::vector<Aabb> boxes = cubesIn(1000, 4, random);
    const SceneStatistics before(boxes);
    psap::CentreWindow window = {};
    psap::FindWindow{&before.moments, &window}(0);
    for (const Aabb& box : boxes)
        ASSERT_TRUE(window.contains(box));
    for (int axis = 0; axis < 3; ++axis)
        for (const float way : {-1000.0f, 1000.0f})
        {
            Aabb far = boxes[0];
            far.min[axis] += way;
            far.max[axis] += way;
            EXPECT_FALSE(window.contains(far)) << axis << " " << way;
            std::vector<Aabb> all = boxes;
            all.push_back(far);
            psap::Moments moments = {};
            psap::SizeClasses sizes = {};
            psap::SumBoxes{all.data(), all.size(), 1, 1, &window, &moments, &sizes}(0);
            EXPECT_EQ(moments.count, boxes.size());
            EXPECT_EQ(moments.others, 1u);
            EXPECT_EQ(moments.sum[axis], before.moments.sum[axis]);
        }
}

TEST(PsapPlans, MeasureBoxesByTheirLongestSideAlongAnyAxis)
{
    SCOPED_TRACE("seed 39");
    Random random(39);
    for (int axis = 0; axis < 3; ++axis)
    {
        SCOPED_TRACE(axis);
        Aabb bar = boxAt(3, 2, 1);
        bar.max[axis] = bar.min[axis] + 7;
        EXPECT_EQ(psap::boundedExtent(bar), 7);
        bar.max[axis] = kInfinity;
        EXPECT_EQ(psap::boundedExtent(bar), psap::kInfinity);
        // Bars beside each other, whose pairs a plan for their short sides would miss.
        std::vector<Aabb> bars;
        for (int i = 0; i < 1200; ++i)
        {
            bars.push_back(boxAt(random.point(0, 20), 0.25f));
            bars.back().max[axis] += i % 3 == 0 ? 8.0f : 4.0f;
        }
        const Pairs expected = everyPair(bars);
        EXPECT_GT(expected.size(), 500u);
        for (const PsapOrder order : {PsapOrder::Counting, PsapOrder::Bins, PsapOrder::Tiles})
        {
            WatchedSearch search(order);
            search.find(bars);
            EXPECT_EQ(search.find(bars), expected) << static_cast<int>(order);
        }
    }
}

TEST(PsapPlans, UseCellsAndBinsOfTheSizesThatAreAskedForInWarps)
{
    SCOPED_TRACE("seed 40");
    Random random(40);
    const SceneStatistics scene(cubesIn(1000, 4, random));
    for (const float cell : {2.0f, 3.0f})
        for (const float bin : {0.5f, 2.0f})
        {
            psap::LevelPlan plan = {};
            psap::PlanLevels{&scene.moments, &scene.sizes, 1.0, PsapAxis::X, cell, bin, 0,
                             true,           kManyBins,    1,   &plan}(0);
            const psap::PlanLevel& level = plan.levels[0];
            EXPECT_NEAR(1 / level.inverseBin, bin * level.limit, 1e-3);
            // A whole number of cells of equal width.
            EXPECT_NEAR(1 / level.inverseU, cell * level.limit, 0.3 * cell);
        }
}

TEST(PsapPlans, SeeNoMotionOfBoxesThatStayEmpty)
{
    const Aabb inverted = cube(2, 1);
    EXPECT_EQ(psap::distanceFromStored(psap::emptyBox(), inverted), 0);
    EXPECT_FALSE(psap::distanceFromStored(psap::emptyBox(), boxAt(0, 0, 0)) < psap::kInfinity);
    EXPECT_NEAR(psap::distanceFromStored(boxAt(0, 0, 0), boxAt(0, 3, 0)), 3, 1e-5);
}
}  // namespace
}  // namespace cullet::test
