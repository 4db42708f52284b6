// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/mesh/mesh_points.h"
#include "cullet/plugin/mesh/triangle_batch.h"

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

// Shapes of the application may give one name to all of them.
TEST(TriangleBatch, TellsTrianglesOfOneNameApartByEachCorner)
{
    const TriangleBatch::Triangle one = {{btVector3(0, 0, 0), btVector3(1, 0, 0), btVector3(0, 0, 1)}, 2, 7};
    EXPECT_TRUE(areSame(one, one));
    for (int corner = 0; corner < 3; ++corner)
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            TriangleBatch::Triangle other = one;
            other.corners[corner][axis] += 1;
            EXPECT_FALSE(areSame(one, other)) << corner << ", " << axis;
        }
    }
    TriangleBatch::Triangle other = one;
    other.part = 3;
    EXPECT_FALSE(areSame(one, other));
    other = one;
    other.index = 8;
    EXPECT_FALSE(areSame(one, other));
}

// A point on the ridge of two triangles touches both; the second one leads down from it.
TEST(TriangleBatch, DropsNeighbourAcrossTheTouchedEdgeHoweverBothAreTurned)
{
    const btTransform identity = btTransform::getIdentity();
    const CoreFrame frame(identity, identity, FrameAxes::World);
    const btVector3 low(0, 0, -1), high(0, 0, 1), left(-1, -1, 0), right(1, -1, 0);
    const btVector3 first[] = {low, high, left}, second[] = {high, low, right};
    for (int turnA = 0; turnA < 3; ++turnA)
    {
        for (int turnB = 0; turnB < 3; ++turnB)
        {
            TriangleBatch batch;
            const auto addTurned = [&](const btVector3* corners, int turn, int index)
            {
                const btVector3 turned[] = {corners[turn], corners[(turn + 1) % 3], corners[(turn + 2) % 3]};
                batch.add(turned, 0, index);
            };
            addTurned(first, turnA, 0);
            addTurned(second, turnB, 1);
            batch.placeAll(frame);
            batch.dropRepeats(0, Eigen::Vector3d::UnitY(), Eigen::Vector3d::Zero());
            EXPECT_TRUE(batch.isNear(0));
            EXPECT_FALSE(batch.isNear(1)) << turnA << ", " << turnB;
        }
    }
}
}  // namespace
}  // namespace cullet::test
