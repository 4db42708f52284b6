// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/narrow/build/hull_builder.h"
#include "cullet/tests/narrow/support/support_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

/// Scans of clouds of very many points, against a scan of all.
namespace cullet::test
{
namespace
{
constexpr int kPoints = 5000;
constexpr unsigned kSeed = 29;

Points ball()
{
    Points points = ellipsoidPoints(kPoints, {1.0, 1.0, 1.0}, kSeed);
    std::mt19937 engine(kSeed);
    std::uniform_real_distribution<double> part(0.0, 1.0);
    for (Eigen::Vector3d& p : points)
        p *= std::cbrt(part(engine));
    return points;
}

std::vector<std::pair<std::string, Points>> clouds()
{
    Points twice = ellipsoidPoints(kPoints / 2, {1.0, 0.5, 0.25}, kSeed);
    twice.insert(twice.end(), twice.begin(), twice.end());
    Points line, plane, outlier = ball();
    for (int i = 0; i < kPoints; ++i)
    {
        line.push_back(Eigen::Vector3d(1.0, -2.0, 0.5) * (i % 1000));
        plane.push_back({0.125 * (i % 71), 0.5, 0.125 * (i / 71)});
    }
    outlier[100] = {1e4, -1e4, 1e3};
    return {{"sphere", ellipsoidPoints(kPoints, {1.0, 1.0, 1.0}, kSeed)},
            {"ball", ball()},
            {"lattice", gridBoxPoints(31)},
            {"twice", twice},
            {"line", line},
            {"plane", plane},
            {"outlier", outlier},
            {"point", Points(kPoints, Eigen::Vector3d(1, 2, 3))}};
}

/// Random directions, and those with zeros, along which many points are level.
Points directions()
{
    std::mt19937 engine(kSeed);
    Points all;
    for (int i = 0; i < 200; ++i)
        all.push_back(randomDirection(engine));
    for (int i = 0; i < 27; ++i)
        all.emplace_back(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
    return all;
}

template <class S>
class PointBlocksTest : public testing::Test
{
};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(PointBlocksTest, Scalars);

TYPED_TEST(PointBlocksTest, GiveTheSupportVertexOfAScanOfAllPoints)
{
    int firstOfSeveral = 0;
    for (const auto& [name, points] : clouds())
    {
        SCOPED_TRACE(name + ", seed " + std::to_string(kSeed));
        const auto given = castPoints<TypeParam>(points);
        const Hull<TypeParam> cloud = makeCloud(given);
        ASSERT_FALSE(cloud.pointBlocks().isEmpty());
        for (const Eigen::Vector3d& direction : directions())
        {
            const auto d = direction.template cast<TypeParam>().eval();
            const SupportHit<TypeParam> hit = hitLinear(cloud, d);
            ASSERT_EQ(hit.vertex, scanPoints(given, d)) << d.transpose();
            ASSERT_EQ(hit.vertex, supportLinear(cloud, d));
            ASSERT_EQ(hit.height, supportProduct(cloud, hit.vertex, d));
            firstOfSeveral += std::count_if(given.begin(), given.end(),
                                            [&](const auto& p) { return p.dot(d) >= hit.height; }) > 1;
        }
    }
    EXPECT_GT(firstOfSeveral, 200);
}

TYPED_TEST(PointBlocksTest, AreMostlyLeftOutInAScan)
{
    for (const Points& points : {ellipsoidPoints(40000, {1.0, 1.0, 1.0}, kSeed), ball()})
    {
        const Hull<TypeParam> cloud = makeCloud(castPoints<TypeParam>(points));
        std::int64_t tested = 0, all = 0;
        for (const Eigen::Vector3d& direction : directions())
        {
            if (direction.isZero(0.0))
                continue;
            BlockScan<TypeParam> scan(cloud.pointBlocks(), direction.template cast<TypeParam>());
            scan.highest();
            tested += scan.blockTotal();
            all += cloud.pointBlocks().blockCount();
        }
        EXPECT_LT(tested, all / 6);
        EXPECT_GT(tested, 0);
    }
}

TYPED_TEST(PointBlocksTest, VisitEveryPointThatMayBeLevelOrHigher)
{
    using S = TypeParam;
    constexpr double kSlope = 1e-9;
    std::int64_t level = 0, visits = 0;
    for (const auto& [name, points] : clouds())
    {
        SCOPED_TRACE(name + ", seed " + std::to_string(kSeed));
        const Hull<S> cloud = makeCloud(castPoints<S>(points));
        const auto point = [&](std::int32_t i) { return cloud.vertex(i).template cast<double>().eval(); };
        for (const Eigen::Vector3d& direction : directions())
        {
            const auto d = direction.template cast<S>().eval();
            const std::int32_t top = hitLinear(cloud, d).vertex;
            std::set<std::int32_t> visited;
            EXPECT_TRUE(allOfHighPoints(cloud, top, direction * 1e-3, kSlope, 0.0,
                                        [&](std::int32_t id) { return visited.insert(id), true; }));
            visits += direction.isZero(0.0) ? 0 : static_cast<std::int64_t>(visited.size());
            for (std::int32_t i = 0; i < cloud.vertexCount(); ++i)
            {
                const Eigen::Vector3d way = point(i) - point(top);
                const double rise = direction.dot(way);
                if (rise < 0.0 && rise * rise > kSlope * kSlope * direction.squaredNorm() * way.squaredNorm())
                    continue;
                ++level;
                ASSERT_EQ(visited.count(i), 1u) << i << " " << d.transpose();
            }
        }
    }
    EXPECT_GT(level, 100000);
    EXPECT_LT(visits, 2 * level);
}

TYPED_TEST(PointBlocksTest, VisitEveryPointWithinADepthBelowAVertex)
{
    using S = TypeParam;
    constexpr double kDepth = 0.001;
    // A small ball: the depth is a length, and a slope has none.
    const Hull<S> cloud = makeCloud(castPoints<S>(scaled(ball(), 0.01)));
    std::int64_t within = 0, visits = 0, all = 0;
    for (const Eigen::Vector3d& direction : directions())
    {
        if (direction.isZero(0.0))
            continue;
        const double length = direction.norm();
        const std::int32_t top = hitLinear(cloud, direction.template cast<S>().eval()).vertex;
        const auto height = [&](std::int32_t i) -> double
        { return direction.dot(cloud.vertex(i).template cast<double>()); };
        std::set<std::int32_t> visited;
        EXPECT_TRUE(allOfNeighbours(cloud, top, direction, 0.0, kDepth * length,
                                    [&](std::int32_t id) { return visited.insert(id), true; }));
        visits += static_cast<std::int64_t>(visited.size());
        all += cloud.vertexCount();
        for (std::int32_t i = 0; i < cloud.vertexCount(); ++i)
        {
            if (height(i) < height(top) - kDepth * length)
                continue;
            ++within;
            ASSERT_EQ(visited.count(i), 1u) << i << " " << direction.transpose();
        }
    }
    EXPECT_GT(within, 2000);
    EXPECT_LT(visits, all / 10);
}

TEST(PointBlocks, AreThereOnlyForVeryManyPoints)
{
    const Points points = ball();
    const Points most(points.begin(), points.begin() + Hull<float>::kMostInOneScan);
    EXPECT_TRUE(makeCloud(castPoints<float>(most)).pointBlocks().isEmpty());
    EXPECT_FALSE(makeCloud(castPoints<float>(points)).pointBlocks().isEmpty());
    EXPECT_TRUE(makeHull(castPoints<float>(points)).pointBlocks().isEmpty());
}

TEST(PointBlocks, StopWhereAVisitorSaysSo)
{
    const Hull<float> cloud = makeCloud(castPoints<float>(ball()));
    int visits = 0;
    BlockScan<float> scan(cloud.pointBlocks(), {1.0f, 0.0f, 0.0f});
    EXPECT_FALSE(scan.allAbove(0.0f, [&](std::int32_t) { return ++visits < 7; }));
    EXPECT_EQ(visits, 7);
}
}  // namespace
}  // namespace cullet::test
