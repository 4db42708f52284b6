// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/mesh/mesh_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace cullet::test
{
namespace
{
constexpr double kThreshold = 0.02;

MeshPoint pointAt(double x, double y, double z, double distance = 0.0,
                  const Eigen::Vector3d& normal = Eigen::Vector3d::UnitY())
{
    return {Eigen::Vector3d(x, y, z), normal, distance, {}, {}};
}

bool has(const MeshPoints& points, double x, double z)
{
    for (int i = 0; i < points.count(); ++i)
    {
        if (std::hypot(points[i].place.x() - x, points[i].place.z() - z) < 1e-9)
            return true;
    }
    return false;
}

TEST(MeshPoints, KeepCornersOfPlateOnManyTriangles)
{
    MeshPoints points(kThreshold);
    for (int i = 0; i <= 40; ++i)
    {
        for (int j = 0; j <= 40; ++j)
            points.add(pointAt(0.1 * i - 2, 0, 0.1 * j - 2));
    }
    points.reduce(4);
    ASSERT_EQ(points.count(), 4);
    // Where there is no more room, corners that come later take the place of earlier points.
    for (const double x : {-2.0, 2.0})
    {
        for (const double z : {-2.0, 2.0})
            EXPECT_TRUE(has(points, x, z)) << x << " " << z;
    }
}

TEST(MeshPoints, KeepDeepestOfThousands)
{
    std::mt19937 engine(5);
    std::uniform_real_distribution<double> place(-1, 1), depth(-0.05, 0.01);
    for (int round = 0; round < 20; ++round)
    {
        MeshPoints points(kThreshold);
        double deepest = 1;
        for (int i = 0; i < 3000; ++i)
        {
            const double x = place(engine), z = place(engine), distance = depth(engine);
            deepest = std::min(deepest, distance);
            points.add(pointAt(x, 0, z, distance));
        }
        points.reduce(4);
        ASSERT_EQ(points.count(), 4);
        // Each of some hundred selections may prefer an earlier point by a thousandth of the range.
        EXPECT_NEAR(points[0].distance, deepest, 2e-3);
    }
}

TEST(MeshPoints, KeepFloorAndBothWallsInCornerOfRoom)
{
    MeshPoints points(kThreshold);
    const Eigen::Vector3d up = Eigen::Vector3d::UnitY(), x = Eigen::Vector3d::UnitX(),
                          z = Eigen::Vector3d::UnitZ();
    for (const double a : {-0.5, 0.5})
    {
        for (const double b : {-0.5, 0.5})
        {
            points.add(pointAt(a, -0.5, b, 0, up));
            points.add(pointAt(-0.5, a, b, 0, x));
            points.add(pointAt(a, b, -0.5, 0, z));
        }
    }
    points.reduce(4);
    ASSERT_EQ(points.count(), 4);
    for (const Eigen::Vector3d& normal : {up, x, z})
    {
        bool isKept = false;
        for (int i = 0; i < points.count(); ++i)
            isKept = isKept || points[i].normal == normal;
        EXPECT_TRUE(isKept) << normal.transpose();
    }
}

TEST(MeshPoints, LeaveOutPointsBetweenOthersUnlessTheyAreDeeper)
{
    for (const double depth : {0.0, 0.01})
    {
        MeshPoints points(kThreshold);
        points.add(pointAt(-0.5, 0, 0));
        points.add(pointAt(0.1, 0, 0, -depth));
        points.add(pointAt(0.5, 0, 0));
        points.reduce(4);
        EXPECT_EQ(points.count(), depth > 0 ? 3 : 2);
    }
}

TEST(MeshPoints, LeaveOutWhatTheManifoldWouldMerge)
{
    MeshPoints points(kThreshold);
    points.add(pointAt(0, 0, 0));
    points.add(pointAt(0.5 * kThreshold, 0, 0));
    points.add(pointAt(0, 0, 1.5 * kThreshold));
    points.reduce(4);
    EXPECT_EQ(points.count(), 2);
    EXPECT_TRUE(has(points, 0, 1.5 * kThreshold));
}

TEST(MeshPoints, PreferDeepPointsToShallowOnesOfEqualSpread)
{
    MeshPoints points(kThreshold);
    points.add(pointAt(0, 0, 0, -0.01));
    points.add(pointAt(-0.5, 0, 0, 0.019));
    points.add(pointAt(0.5, 0, 0, 0.0));
    points.reduce(2);
    ASSERT_EQ(points.count(), 2);
    EXPECT_TRUE(has(points, 0.5, 0));
}
}  // namespace
}  // namespace cullet::test
