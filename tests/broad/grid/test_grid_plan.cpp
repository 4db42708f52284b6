// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/columns/grid_plan.h"
#include "cullet/broad/proxy_table.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
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
}  // namespace
}  // namespace cullet::test
