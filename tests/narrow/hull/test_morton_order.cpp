// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/narrow/build/morton_order.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <random>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr unsigned kMortonSeed = 37;

/// The points of a cubic grid, mixed.
Points mixedGrid(int edge)
{
    Points points;
    for (int i = 0; i < edge * edge * edge; ++i)
        points.emplace_back(0.25 * (i % edge) - 1.0, 0.25 * (i / edge % edge) + 3.0,
                            0.25 * (i / edge / edge));
    std::mt19937 engine(kMortonSeed);
    std::shuffle(points.begin(), points.end(), engine);
    return points;
}

TEST(MortonOrder, VisitsEachCubeOfAGridBeforeTheNext)
{
    SCOPED_TRACE("seed " + std::to_string(kMortonSeed));
    constexpr int kEdge = 32;
    const Points points = mixedGrid(kEdge);
    const MortonOrder order(points);
    for (int cube = 2; cube <= kEdge; cube *= 2)
    {
        const std::size_t size = static_cast<std::size_t>(cube) * cube * cube;
        for (std::size_t begin = 0; begin < points.size(); begin += size)
        {
            Eigen::Vector3d low = points[order.points()[begin]], high = low;
            for (std::size_t place = begin; place < begin + size; ++place)
            {
                low = low.cwiseMin(points[order.points()[place]]);
                high = high.cwiseMax(points[order.points()[place]]);
            }
            ASSERT_EQ((high - low).maxCoeff(), 0.25 * (cube - 1)) << cube << " from " << begin;
        }
    }
}

TEST(MortonOrder, HasEachPointOnceAtItsPlace)
{
    for (const Points& points :
         {mixedGrid(3), mixedGrid(20), ellipsoidPoints(5000, {3.0, 1.0, 0.0}, kMortonSeed)})
    {
        const MortonOrder order(points);
        std::vector<std::int32_t> sorted = order.points();
        for (std::size_t place = 0; place < sorted.size(); ++place)
            EXPECT_EQ(order.placeOf(sorted[place]), static_cast<std::int32_t>(place));
        std::sort(sorted.begin(), sorted.end());
        std::vector<std::int32_t> all(points.size());
        std::iota(all.begin(), all.end(), 0);
        EXPECT_EQ(sorted, all);
    }
}

TEST(MortonOrder, KeepsTheOrderOfFewPointsAndOfPointsOfOneCell)
{
    for (const Points& points : {mixedGrid(15), Points(5000, Eigen::Vector3d(1, 2, 3))})
    {
        const MortonOrder order(points);
        EXPECT_TRUE(std::is_sorted(order.points().begin(), order.points().end())) << points.size();
    }
    EXPECT_TRUE(MortonOrder(Points()).points().empty());
}

TEST(MortonOrder, KnowsTheExtentOfThePoints)
{
    EXPECT_EQ(MortonOrder(mixedGrid(17)).extent(), Eigen::Vector3d(4, 4, 4));
    EXPECT_EQ(MortonOrder({{1, 2, 3}, {0, 4, 3}}).extent(), Eigen::Vector3d(1, 2, 0));
    EXPECT_EQ(MortonOrder(Points()).extent(), Eigen::Vector3d(0, 0, 0));
}
}  // namespace
}  // namespace cullet::test
