// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/narrow/epa/epa.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/tests/plugin/convex/convex_contacts.h"
#include "cullet/tests/plugin/convex/core_oracle.h"

#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace cullet::test
{
namespace
{
/// A triangle and another shape near the origin. Positions are multiples of 1/16, so that both can be moved 1,000 km
/// away without rounding.
struct NearPair
{
    /// @param reach distance of the triangle's corners from the origin of its shape, as in a large mesh
    NearPair(std::mt19937& engine, double reach) : triangle(vec(0, 0, 0), vec(0, 0, 0), vec(0, 0, 0))
    {
        std::uniform_real_distribution<double> place(-1, 1);
        const btVector3 middle = drawVec(place, engine) * btScalar(reach);
        for (btVector3& corner : triangle.m_vertices1)
            corner = middle + drawVec(place, engine);
        triangle.setMargin(0);
        const btMatrix3x3 basis(randomRotation(engine));
        ofTriangle = btTransform(basis, toSixteenths(-(basis * middle)));
        const btVector3 other = toSixteenths(drawVec(place, engine) * btScalar(1.25));
        ofOther = btTransform(randomRotation(engine), other);
    }

    static btVector3 toSixteenths(const btVector3& v)
    {
        return vec(std::round(16 * double(v.x())) / 16, std::round(16 * double(v.y())) / 16,
                   std::round(16 * double(v.z())) / 16);
    }

    btTriangleShape triangle;
    btTransform ofTriangle, ofOther;
};

/// Distance of the cores, or minus the depth, in double.
double exactDistance(const CoreOracle& a, const CoreOracle& b)
{
    const PosedHull<double> posedA = a.posed(), posedB = b.posed();
    GjkCache<double> cache;
    const auto near = gjkDistance(posedA, posedB, std::numeric_limits<double>::infinity(), cache);
    return near.state == GjkState::Near ? near.distance : -penetration(posedA, posedB, cache).depth;
}

btTransform movedBy(const btTransform& transform, const btVector3& shift)
{
    return btTransform(transform.getBasis(), transform.getOrigin() + shift);
}

/// The reported distance without the margins, with the triangle first or second.
double distanceOf(ConvexBench& bench, NearPair& pair, btCollisionShape& other, const btVector3& shift,
                  bool isTriangleFirst)
{
    const btTransform a = movedBy(pair.ofTriangle, shift), b = movedBy(pair.ofOther, shift);
    const auto found = isTriangleFirst ? bench.closest(pair.triangle, a, other, b, 20)
                                       : bench.closest(other, b, pair.triangle, a, 20);
    EXPECT_TRUE(found.has_value());
    return found ? double(found->distance) + double(other.getMargin()) : 0.0;
}

struct Sample
{
    int apart = 0, overlapping = 0;
    double worst = 0.0;  ///< error of a distance between separated shapes
    double worstDepth = 0.0;
};

/// Measures pairs at distance `away` from the world's origin.
Sample measure(btCollisionShape& other, double away, double reach)
{
    ConvexBench bench;
    std::mt19937 engine(31);
    Sample sample;
    for (int i = 0; i < 120; ++i)
    {
        NearPair pair(engine, reach);
        const double exact =
            exactDistance(CoreOracle(pair.triangle, pair.ofTriangle), CoreOracle(other, pair.ofOther));
        const double found = distanceOf(bench, pair, other, vec(away, 0.3 * away, -away), i % 2 == 0);
        double& worst = exact > 0 ? sample.worst : sample.worstDepth;
        worst = std::max(worst, std::abs(found - exact));
        (exact > 0 ? sample.apart : sample.overlapping) += 1;
    }
    EXPECT_EQ(bench.registration->stats().notConvergedTotal, 0u);
    return sample;
}

/// Expects errors of some roundings for sizes of about 1; depths are certified to less.
void expectExact(btCollisionShape& other, double away, double reach)
{
    SCOPED_TRACE(testing::Message() << other.getName() << ", " << away << " m away, corners at " << reach);
    constexpr bool kIsFloat = sizeof(btScalar) == sizeof(float);
    const Sample sample = measure(other, away, reach);
    EXPECT_LT(sample.worst, kIsFloat ? 6e-7 : 1e-13);
    EXPECT_LT(sample.worstDepth, kIsFloat ? 2e-5 : 1e-10);
    EXPECT_GT(sample.apart, 30);
    EXPECT_GT(sample.overlapping, 5);
}
}  // namespace

TEST(FarTriangles, HaveExactDistancesFromHullsAndBoxesFarFromOrigin)
{
    auto round = makeHullShape(ballPoints(20, 0.5, 9));
    auto scaled = makeHullShape(ballPoints(40, 0.5, 10));
    scaled->setLocalScaling(vec(1.5, 0.75, 2));
    btBoxShape box(vec(0.4, 0.6, 0.5));
    for (const double away : {0.0, 100.0, 1e4, 1e6})
    {
        for (btCollisionShape* other :
             {static_cast<btCollisionShape*>(round.get()), static_cast<btCollisionShape*>(scaled.get()),
              static_cast<btCollisionShape*>(&box)})
            expectExact(*other, away, 0.0);
    }
}

TEST(FarTriangles, HaveExactDistancesFromTriangles)
{
    btTriangleShape other(vec(-0.5, 0.25, -0.25), vec(0.75, -0.125, -0.5), vec(0.125, 0.25, 0.875));
    other.setMargin(0);
    for (const double away : {0.0, 100.0, 1e4, 1e6})
    {
        expectExact(other, away, 0.0);
        expectExact(other, away, 8.0);
    }
}

TEST(FarTriangles, HaveExactDistancesWhenTheyAreLarge)
{
    // Not rotated, so that no corner is rounded.
    ConvexBench bench;
    auto round = makeHullShape(ballPoints(20, 0.5, 9));
    std::mt19937 engine(12);
    std::uniform_real_distribution<double> place(-100, 100);
    const auto any = [&] { return NearPair::toSixteenths(drawVec(place, engine)); };
    double worst = 0.0;
    for (int i = 0; i < 200; ++i)
    {
        const btVector3 corners[] = {any(), any(), any()};
        btTriangleShape triangle(corners[0], corners[1], corners[2]);
        triangle.setMargin(0);
        const btTransform identity = btTransform::getIdentity();
        const btVector3 middle = (corners[0] + corners[1] + corners[2]) / btScalar(3);
        const btVector3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
        const btTransform at(randomRotation(engine), middle + normal * btScalar(1.5));
        const auto found = i % 2 == 0 ? bench.closest(triangle, identity, *round, at, 200)
                                      : bench.closest(*round, at, triangle, identity, 200);
        ASSERT_TRUE(found.has_value());
        const double exact = exactDistance(CoreOracle(triangle, identity), CoreOracle(*round, at));
        // One rounding of the distance itself remains.
        if (exact > 0 && exact < 8)
            worst = std::max(worst, std::abs(double(found->distance) + double(round->getMargin()) - exact));
    }
    EXPECT_LT(worst, sizeof(btScalar) == sizeof(float) ? 1.2e-6 : 1e-12);
    EXPECT_GT(worst, 0.0);
}

TEST(FarTriangles, AreTouchedBelowATipThoughTheirFirstCornerIsFarAway)
{
    // A tip at the bottom of a hull, whose place on the triangle is known.
    btConvexHullShape spike;
    for (const btVector3& point :
         {vec(0, -0.5, 0), vec(0.5, 0.5, 0), vec(-0.3, 0.5, 0.4), vec(-0.3, 0.5, -0.4)})
        spike.addPoint(point);
    btTriangleShape triangle(vec(1e5, 0, 0.3), vec(-1e5, 0, -1e5), vec(-1e5, 0, 1e5));
    triangle.setMargin(0);
    constexpr double kTolerance = sizeof(btScalar) == sizeof(float) ? 1e-5 : 1e-13;
    ConvexBench bench;
    std::mt19937 engine(13);
    std::uniform_real_distribution<double> place(-1, 1);
    double worst = 0.0;
    for (int i = 0; i < 100; ++i)
    {
        const double x = place(engine), z = place(engine);
        const btTransform identity = btTransform::getIdentity();
        const btTransform at(btQuaternion::getIdentity(), vec(x, 0.75, z));
        const auto found = i % 2 == 0 ? bench.closest(triangle, identity, spike, at, 1)
                                      : bench.closest(spike, at, triangle, identity, 1);
        ASSERT_TRUE(found.has_value());
        const btVector3 off = found->onB - at.getOrigin();
        worst = std::max({worst, std::abs(double(off.x())), std::abs(double(off.z()))});
    }
    EXPECT_LT(worst, kTolerance);
}

TEST(FarTriangles, HaveExactDistancesWhenTheirMeshIsLarge)
{
    auto round = makeHullShape(ballPoints(20, 0.5, 9));
    for (const double away : {0.0, 1e4, 1e6})
        expectExact(*round, away, 100.0);
}
}  // namespace cullet::test
