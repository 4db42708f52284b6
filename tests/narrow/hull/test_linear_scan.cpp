// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/narrow/build/cloud_builder.h"
#include "cullet/narrow/hull/linear_scan.h"
#include "cullet/narrow/hull/support.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <vector>

namespace cullet::test
{
namespace
{
template <class S>
class LinearScans : public testing::Test
{
};
using ScanScalars = testing::Types<float, double>;
TYPED_TEST_SUITE(LinearScans, ScanScalars);

/// Points of a coarse grid, so that products are equal often.
template <class S>
Hull<S> gridCloud(int count, std::mt19937& engine)
{
    std::uniform_int_distribution<int> coordinate(-3, 3);
    std::vector<Eigen::Matrix<S, 3, 1>> points;
    for (int i = 0; i < count; ++i)
    {
        const int x = coordinate(engine), y = coordinate(engine), z = coordinate(engine);
        points.emplace_back(S(x), S(y), S(z));
    }
    return makeCloud(points);
}

TYPED_TEST(LinearScans, FindTheLowestOfEqualVertices)
{
    using S = TypeParam;
    constexpr unsigned kSeed = 43;
    SCOPED_TRACE(kSeed);
    std::mt19937 engine(kSeed);
    int tieCount = 0;
    for (int i = 0; i < 2000; ++i)
    {
        const Hull<S> cloud = gridCloud<S>(1 + i % 150, engine);
        const Eigen::Matrix<S, 3, 1> d(S(i % 3 - 1), S(i % 5 - 2), S(i % 7 - 3));
        std::int32_t expected = 0;
        for (std::int32_t v = 1; v < cloud.vertexCount(); ++v)
        {
            const S best = supportProduct(cloud, expected, d), next = supportProduct(cloud, v, d);
            tieCount += next == best ? 1 : 0;
            expected = next > best ? v : expected;
        }
        ASSERT_EQ(supportLinear(cloud, d), expected) << i;
        const SupportHit<S> hit = hitLinear(cloud, d);
        ASSERT_EQ(hit.vertex, expected) << i;
        ASSERT_EQ(hit.height, supportProduct(cloud, expected, d)) << i;
    }
    EXPECT_GT(tieCount, 1000);
}

TYPED_TEST(LinearScans, VisitAllNearVerticesButSome)
{
    using S = TypeParam;
    constexpr unsigned kSeed = 47;
    SCOPED_TRACE(kSeed);
    std::mt19937 engine(kSeed);
    std::size_t visitTotal = 0;
    for (int i = 0; i < 2000; ++i)
    {
        const Hull<S> cloud = gridCloud<S>(1 + i % 150, engine);
        const std::int32_t count = cloud.vertexCount(), from = i % count;
        const Eigen::Matrix<S, 3, 1> d(S(i % 3 - 1), S(i % 5 - 2), S(1));
        const std::array<std::int32_t, 3> but = {from, i / 2 % count, i % 2 == 0 ? -1 : i / 3 % count};
        std::vector<std::int32_t> expected, visited;
        for (std::int32_t v = 0; v < count; ++v)
        {
            if (supportProduct(cloud, v, d) >= supportProduct(cloud, from, d) - S(2) &&
                std::find(but.begin(), but.end(), v) == but.end())
                expected.push_back(v);
        }
        const auto visit = [&](std::int32_t v) { return visited.push_back(v), true; };
        ASSERT_TRUE(isTrueNear<S>(cloud, d, from, S(2), but, visit));
        ASSERT_EQ(visited, expected) << i;
        ASSERT_EQ(isTrueNear<S>(cloud, d, from, S(2), but, [](std::int32_t) { return false; }),
                  expected.empty());
        visitTotal += visited.size();
    }
    EXPECT_GT(visitTotal, 20000u);
}

TYPED_TEST(LinearScans, CountNanAsNear)
{
    using S = TypeParam;
    std::mt19937 engine(53);
    const Hull<S> cloud = gridCloud<S>(70, engine);
    const Eigen::Matrix<S, 3, 1> d(S(1), std::numeric_limits<S>::quiet_NaN(), S(1));
    EXPECT_EQ(bitsOfHigh<S>(cloud, d, S(0), 0), ~std::uint64_t(0));
}
}  // namespace
}  // namespace cullet::test
