// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/hull_pairs.h"
#include "cullet/narrow/epa/epa.h"
#include "cullet/narrow/epa/exact_penetration.h"
#include "cullet/narrow/gjk/isa_gjk.h"
#include "cullet/tests/narrow/epa/depth_check.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
TEST(Penetration, HasZeroDepthAlongPlaneNormalOfCoplanarShapes)
{
    const Hull<float> square = hullOf<float>({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}});
    GjkCache<float> cache;
    const auto result = penetration(at(square, 0, 0, 0), at(square, 0.5f, 0.25f, 0), cache);
    ASSERT_EQ(result.state, GjkState::Overlapping);
    EXPECT_EQ(result.method, PenetrationMethod::Flat);
    EXPECT_EQ(result.depth, 0.0f);
    EXPECT_NEAR(std::abs(result.axis.z()), 1.0f, 1e-5f);
}

/// Distance of a point from a segment.
template <class S>
double offSegment(const PosedHull<S>& segment, const Eigen::Matrix<S, 3, 1>& point)
{
    const Eigen::Vector3d from = segment.point(0), along = segment.point(1) - from;
    const Eigen::Vector3d p = point.template cast<double>() - from;
    const double part = std::min(std::max(p.dot(along) / along.squaredNorm(), 0.0), 1.0);
    return (p - part * along).norm();
}

/// A point on a segment: at its first end, its second end, or between them.
template <class S>
void checkPointOnSegment(double tolerance)
{
    std::mt19937 engine(5);
    NormalPoints any{engine};
    int touching = 0;
    for (int i = 0; i < 3000; ++i)
    {
        SCOPED_TRACE(i);
        const Hull<S> segment = hullOf<S>({any(), any()}), dot = hullOf<S>({any()});
        const PosedHull<S> a(segment, randomRotation(engine).cast<S>(), {S(0), S(0), S(0)});
        const double part = i % 3 == 2 ? 0.3 : i % 3;
        const Eigen::Vector3d along = a.point(1) - a.point(0);
        const PosedHull<S> still(dot, randomRotation(engine).cast<S>(), {S(0), S(0), S(0)});
        const Eigen::Vector3d origin = a.point(0) + part * along - still.point(0);
        const PosedHull<S> b(dot, still.basis().template cast<S>(), origin.cast<S>());
        GjkCache<S> cache;
        const PenetrationResult<S> result = penetration(a, b, cache);
        if (result.state != GjkState::Overlapping)
            continue;
        ++touching;
        EXPECT_EQ(result.method, PenetrationMethod::Flat);
        EXPECT_NEAR(result.axis.template cast<double>().dot(along.normalized()), 0.0, tolerance);
        EXPECT_LT(offSegment(a, result.pointA), tolerance);
        const Eigen::Vector3d pointB = b.point(0) + b.origin();
        EXPECT_LT((result.pointB.template cast<double>() - pointB).norm(), tolerance);
    }
    EXPECT_GT(touching, sizeof(S) == 4 ? 10 : 1000);
}

TEST(Penetration, HasPerpendicularNormalWhenPointLiesOnSegment)
{
    checkPointOnSegment<float>(1e-5);
    checkPointOnSegment<double>(1e-6);
}

TEST(Penetration, PlacesDeepestPointsOfCoplanarShapesInBoth)
{
    const Hull<float> square = hullOf<float>({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}});
    const Hull<float> dot = hullOf<float>({{0, 0, 0}});
    const PosedHull<float> a = at(square, 0, 0, 0);
    for (const double x : {-1.0, -0.5, 0.0, 0.25, 1.0})
    {
        for (const double y : {-1.0, -0.25, 0.0, 0.5, 1.0})
        {
            SCOPED_TRACE(testing::Message() << x << " " << y);
            GjkCache<float> cache;
            const auto result = penetration(a, at(dot, x, y, 0), cache);
            ASSERT_EQ(result.method, PenetrationMethod::Flat);
            EXPECT_LT((result.pointA - Eigen::Vector3f(x, y, 0)).norm(), 1e-6f);
            EXPECT_EQ(result.pointA, result.pointB);
            GjkCache<float> turned;
            const auto reverse = penetration(at(dot, x, y, 0), a, turned);
            EXPECT_LT(reverse.pointA.norm(), 1e-6f);
            GjkCache<float> corner;
            const auto squares = penetration(a, at(square, 2 * x, 2 * y, 0), corner);
            EXPECT_LT(outsideOf(a, Eigen::Vector3d::Zero(), squares.pointA), 1e-6);
            const Eigen::Vector3f fromB = squares.pointB - Eigen::Vector3f(2 * x, 2 * y, 0);
            EXPECT_LT(squares.pointA.cwiseAbs().maxCoeff(), 1.0f + 1e-6f);
            EXPECT_LT(fromB.cwiseAbs().maxCoeff(), 1.0f + 1e-6f);
        }
    }
}

/// Checks triangles that crossed and then lie in one plane, for which the cached surface is flat, or nearly so.
///
/// @param lean remaining angle between them
template <class S>
void checkTrianglesInOnePlane(double lean, int* remembered)
{
    std::mt19937 engine(20);
    std::normal_distribution<double> normal;
    const Hull<S> triangle = hullOf<S>({{0, 0, 0}, {2, 0, 0}, {0, 0, 2}});
    const Hull<S> other = hullOf<S>({{0, 0, 0}, {-2, 0, 0}, {0, 0, -2}});
    const PosedHull<S> a = at(triangle, 0, 0, 0);
    const Eigen::Matrix3d leaning(Eigen::AngleAxisd(lean, Eigen::Vector3d(3, 0, -1).normalized()));
    for (int i = 0; i < 2000; ++i)
    {
        SCOPED_TRACE(testing::Message() << "leaning " << lean << ", pair " << i);
        const double z = 1 + 0.3 * normal(engine), y = 0.2 * normal(engine), x = 1 + 0.3 * normal(engine);
        const Eigen::Vector3d crossing(x, y, z);
        GjkCache<S> cache;
        EpaCache memory;
        const PosedHull<S> crossed(other, randomRotation(engine).cast<S>(), crossing.cast<S>());
        penetration(a, crossed, cache, &memory);
        *remembered += memory.vertexCount > 0 ? 1 : 0;
        for (const double away : {2.01, 2.2, 5.0, 1000.0})
        {
            const PosedHull<S> b(other, leaning.cast<S>(), {S(away), S(0), S(away)});
            GjkCache<S> cacheNow = cache;
            EpaCache memoryNow = memory;
            EXPECT_EQ(rememberedPenetration(a, b, cacheNow, memoryNow).state, GjkState::NotConverged) << away;
            EXPECT_EQ(memoryNow.vertexCount, 0);
        }
    }
}

TEST(Penetration, ProvesNoOverlapFromMemoryWhenTrianglesLieApartInPlane)
{
    int remembered = 0;
    for (const double lean : {0.0, 1e-12, 1e-9, 1e-7, 1e-4})
    {
        checkTrianglesInOnePlane<float>(lean, &remembered);
        checkTrianglesInOnePlane<double>(lean, &remembered);
    }
    EXPECT_GT(remembered, 5000);
}
}  // namespace
}  // namespace cullet::test
