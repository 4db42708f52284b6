// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/columns/grid_plan.h"
#include "cullet/broad/proxy_table.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace cullet::test
{
namespace
{
/// Box tests of a forward scan along x in columns that divide y and z.
double countTests(const std::vector<Aabb>& boxes, float width)
{
    std::map<std::pair<int, int>, std::vector<std::pair<float, float>>> rows;
    for (const Aabb& box : boxes)
    {
        for (int y = static_cast<int>(box.min[1] / width); y <= static_cast<int>(box.max[1] / width); ++y)
        {
            for (int z = static_cast<int>(box.min[2] / width); z <= static_cast<int>(box.max[2] / width); ++z)
                rows[{y, z}].emplace_back(box.min[0], box.max[0]);
        }
    }
    double tests = 0;
    for (auto& [cell, intervals] : rows)
    {
        std::sort(intervals.begin(), intervals.end());
        for (auto from = intervals.begin(); from != intervals.end(); ++from)
        {
            const std::pair<float, float> end = {from->second, kInfinity};
            tests += static_cast<double>(std::upper_bound(from, intervals.end(), end) - from - 1);
        }
    }
    return tests;
}

TEST(GridPlan, PredictsTestCountOfLevelWithSizesOverSixDecades)
{
    SCOPED_TRACE("seed 11");
    Random random(11);
    constexpr float kSide = 5000;
    constexpr std::uint32_t kCount = 8000;
    std::vector<Aabb> boxes;
    SizeHistogram sizes;
    for (std::uint32_t i = 0; i < kCount; ++i)
    {
        const float edge = random.logUniform(-10, 10);
        boxes.push_back({{random.between(0, kSide), random.between(0, kSide), random.between(0, kSide)}, {}});
        for (int axis = 0; axis < 3; ++axis)
            boxes.back().max[axis] = boxes.back().min[axis] + edge;
        SizeHistogram::Bin& bin = sizes.bins[static_cast<std::size_t>(octaveOf(edge) - kLowestOctave)];
        ++bin.count;
        bin.tileSum += edge;
        bin.sweepSum += edge;
    }
    const float span[3] = {kSide, kSide, kSide};
    for (const float scale : {0.0625f, 0.25f, 1.0f})
    {
        const GridPlan plan = makeGridPlan(sizes, span, 0, 1, {scale, 1});
        ASSERT_EQ(plan.levelCount, 1u);
        const double tests = countTests(boxes, plan.width[0]);
        EXPECT_GT(tests, 4.0 * kCount) << "width " << plan.width[0];
        EXPECT_NEAR(std::log2(plan.predictedCandidates / tests), 0, 1) << "width " << plan.width[0];
    }
}

TEST(GridPlan, PredictsTestCountWhenAllBoxesAreInOneColumn)
{
    SCOPED_TRACE("seed 13");
    Random random(13);
    constexpr float kSide = 5000;
    constexpr std::uint32_t kCount = 8000;
    std::vector<Aabb> boxes;
    SizeHistogram sizes;
    for (std::uint32_t i = 0; i < kCount; ++i)
        boxes.push_back(boxAt(random.between(0, kSide), 1, 1));
    sizes.bins[static_cast<std::size_t>(octaveOf(1) - kLowestOctave)] = {kCount, kCount, kCount};
    const float span[3] = {kSide, 0.5f, 0.5f};
    const GridPlan plan = makeGridPlan(sizes, span, 0, 1, {32, 1});
    const double tests = countTests(boxes, plan.width[0]);
    EXPECT_GT(tests, 1.0 * kCount);
    // The plan counts the few boxes that would stick out of a column among others.
    EXPECT_NEAR(std::log2(plan.predictedCandidates / tests), 0, 0.3);
}

TEST(GridPlan, AddsNoLevelForSingleGiantInSample)
{
    SCOPED_TRACE("seed 12");
    Random random(12);
    GridOptions options;
    options.flatLimit = 0;
    options.threads = 1;
    const auto backend = makeGridBackend(options);
    ProxyTable table;
    table.create(cube(-100, 200), 1, kEverything);  // the first row is in every sample
    for (std::uint32_t id = 2; id <= 20000; ++id)
        table.create(boxAt(random.point(0, 87)), id, kEverything);
    PairDelta delta;
    ASSERT_EQ(backend->update(table.beginUpdate(0, true), delta), Status::Ok);
    EXPECT_GT(delta.added.size(), 20000u);
    EXPECT_EQ(backend->stats().levels, 1u);
    EXPECT_LT(backend->stats().decision.cellWidth, 20.0f);
}

/// Sizes over `octaves` octaves from the largest, `many` boxes in the lowest one and fewer above.
SizeHistogram sizesOver(std::int32_t octaves, std::int32_t largest, std::uint32_t many)
{
    SizeHistogram sizes;
    for (std::int32_t o = 0; o < octaves; ++o)
    {
        const auto count = static_cast<std::uint32_t>(1 + many / (1 + o * o));
        const double edge = 0.75 * std::ldexp(1.0, largest + o - octaves + 1);
        sizes.bins[static_cast<std::size_t>(largest + o - octaves + 1 - kLowestOctave)] = {
            count, edge * count, 1.25 * edge * count};
    }
    return sizes;
}

TEST(GridPlan, HasALevelForEachOctaveUpToEight)
{
    const float span[3] = {500, 400, 300};
    for (std::int32_t octaves = 1; octaves <= 20; ++octaves)
    {
        SCOPED_TRACE(octaves);
        const GridPlan plan = makeGridPlan(sizesOver(octaves, 3, 1000), span, 0, 1, {1, kMaxLevels});
        const std::int32_t together = (octaves + 7) / 8;
        EXPECT_EQ(plan.levelCount, static_cast<std::uint32_t>((octaves + together - 1) / together));
        EXPECT_EQ(plan.cost, plan.allLevelsCost);
        for (std::uint32_t level = 0; level < plan.levelCount; ++level)
        {
            const std::int32_t top =
                std::min(3, 3 - octaves + (static_cast<std::int32_t>(level) + 1) * together);
            EXPECT_EQ(plan.width[level], std::ldexp(1.0f, top)) << level;
            EXPECT_EQ(plan.levelOfOctave[static_cast<std::size_t>(top - kLowestOctave)], level);
        }
    }
}

/// What a plan has, in few digits.
std::string textOf(const GridPlan& plan)
{
    char text[200];
    std::snprintf(text, sizeof text, "%u levels, %.4g to %.4g wide, cost %.4g (%.4g, %.4g), tests %.4g",
                  plan.levelCount, static_cast<double>(plan.width[0]),
                  static_cast<double>(plan.width[plan.levelCount - 1]), plan.cost, plan.oneLevelCost,
                  plan.allLevelsCost, plan.predictedCandidates);
    return text;
}

// A plan shows in speed alone. After a change of the cost model insert the new values, and say what they gain.
TEST(GridPlan, IsTheRecordedOneForFixedSizes)
{
    struct Recorded
    {
        std::int32_t octaves;
        std::uint32_t many;
        double density;
        const char* text;
    };
    const Recorded recorded[] = {
        {1, 1000, 1, "1 levels, 128 to 128 wide, cost 2.336e+04 (2.336e+04, 2.336e+04), tests 1.678e+04"},
        {2, 200, 1, "1 levels, 256 to 256 wide, cost 5570 (5570, 9414), tests 1722"},
        {3, 50000, 1, "1 levels, 24 to 24 wide, cost 3.038e+06 (3.038e+06, 6.063e+06), tests 4.161e+06"},
        {6, 3000, 1, "1 levels, 48 to 48 wide, cost 9.793e+04 (9.793e+04, 4.494e+05), tests 8958"},
        {6, 3000, 100, "1 levels, 16 to 16 wide, cost 1.449e+05 (1.449e+05, 4.645e+05), tests 1.559e+05"},
        {9, 100000, 1, "1 levels, 16 to 16 wide, cost 3.419e+06 (3.419e+06, 1.639e+07), tests 5.245e+05"},
        {9, 100000, 50, "2 levels, 8 to 16 wide, cost 9.59e+06 (9.844e+06, 1.868e+07), tests 9.567e+06"},
        {9, 1000000, 300, "3 levels, 2 to 16 wide, cost 3.369e+08 (3.966e+09, 3.961e+08), tests 8.958e+08"},
        {14, 1000000, 2000,
         "3 levels, 0.5 to 16 wide, cost 2.029e+08 (5.308e+09, 2.606e+08), tests 3.761e+08"},
        {12, 10000000, 0.1, "1 levels, 16 to 16 wide, cost 3.85e+08 (3.85e+08, 2.1e+09), tests 2.4e+08"},
        {20, 1000, 1000, "1 levels, 16 to 16 wide, cost 3.489e+04 (3.489e+04, 7.118e+04), tests 8277"},
        {40, 1000000, 1, "1 levels, 16 to 16 wide, cost 3.328e+07 (3.328e+07, 1.094e+08), tests 1.661e+06"},
    };
    const float span[3] = {500, 100, 300};
    std::uint32_t mostLevels = 0;
    for (const Recorded& plan : recorded)
    {
        SCOPED_TRACE(testing::Message() << plan.octaves << " octaves, " << plan.many << " boxes");
        const GridPlan made = makeGridPlan(sizesOver(plan.octaves, 4, plan.many), span, 2, plan.density, {});
        EXPECT_EQ(textOf(made), plan.text);
        mostLevels = std::max(mostLevels, made.levelCount);
    }
    EXPECT_GT(mostLevels, 2u);
}
}  // namespace
}  // namespace cullet::test
