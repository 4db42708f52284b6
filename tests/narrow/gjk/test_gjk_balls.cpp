// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/narrow/gjk/isa_gjk.h"
#include "cullet/tests/narrow/search_observer.h"
#include "cullet/tests/narrow/shapes.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

/// Pairs without a cache, whose bounding balls around the origins may prove that they are separated.
namespace cullet::test
{
namespace
{
/// A hull in both precisions.
struct Shape
{
    explicit Shape(const Points& points) : narrow(hullOf<float>(points)), wide(hullOf<double>(points)) {}
    Hull<float> narrow;
    Hull<double> wide;
};

struct Place
{
    Eigen::Matrix3f basis;
    Eigen::Vector3f origin;

    PosedHull<float> of(const Shape& shape) const { return {shape.narrow, basis, origin}; }
    PosedHull<double> wideOf(const Shape& shape) const
    {
        return {shape.wide, basis.cast<double>(), origin.cast<double>()};
    }
};

struct BallTally
{
    int separated = 0, overlapping = 0, without = 0;

    /// Compares a query without a cache to a search in double.
    void check(const Shape& shapeA, const Place& placeA, const Shape& shapeB, const Place& placeB,
               float limit)
    {
        int supports = 0;
        SearchObserver observer = [&supports](const Eigen::Vector3d&, double) { ++supports; };
        GjkCache<float> cache;
        const PosedHull<float> a = placeA.of(shapeA), b = placeB.of(shapeB);
        const GjkState state = isaGjk(a, b, limit, cache, observer).state;
        GjkCache<double> wideCache;
        const GjkResult<double> truth = gjkDistance(placeA.wideOf(shapeA), placeB.wideOf(shapeB),
                                                    std::numeric_limits<double>::infinity(), wideCache);
        if (supports == 0)
        {
            ASSERT_EQ(state, GjkState::Separated);
            EXPECT_GT(truth.distance, double(limit));
            ++without;
            // The cached axis separates.
            NoObserver none;
            EXPECT_EQ(isaGjk(a, b, limit, cache, none).state, GjkState::Separated);
        }
        if (std::abs(truth.distance - double(limit)) < 1e-5 && truth.distance > 0.0)
            return;
        EXPECT_EQ(state == GjkState::Separated, truth.distance > double(limit)) << truth.distance;
        ++(truth.distance > double(limit) ? separated : overlapping);
    }
};

Eigen::Matrix3d anyBasis(std::mt19937& engine)
{
    std::uniform_real_distribution<double> scale(0.4, 2.0);
    // In the order in which GCC evaluates arguments and operands, which recorded counts rely on.
    const double z = engine() % 2 == 0 ? 1.0 : -scale(engine), y = scale(engine), x = scale(engine);
    const Eigen::Matrix3d before = randomRotation(engine), after = randomRotation(engine);
    return after * Eigen::Vector3d(x, y, z).asDiagonal() * before;
}

/// Extent of a shape's ball along a direction, after the shape's linear map.
double ballAlong(const Shape& shape, const Eigen::Matrix3d& basis, const Eigen::Vector3d& direction)
{
    return shape.wide.radius() * (basis.transpose() * direction).norm();
}

TEST(GjkBalls, ProveOnlyTrueSeparationsOfStretchedShapes)
{
    std::vector<Shape> shapes;
    for (const Points& points : {icoPoints(1), icoPoints(2), prismPoints(32, 0.4), boxPoints(0.5, 0.3, 0.7)})
        shapes.emplace_back(points);
    std::mt19937 engine(91);
    std::uniform_real_distribution<double> far(0.6, 1.5);
    BallTally tally;
    for (int i = 0; i < 4000; ++i)
    {
        SCOPED_TRACE(i);
        const Shape& shapeA = shapes[engine() % shapes.size()];
        const Shape& shapeB = shapes[engine() % shapes.size()];
        const bool isTurned = i % 2 == 0;
        const Eigen::Matrix3d basisA = isTurned ? randomRotation(engine) : anyBasis(engine);
        const Eigen::Matrix3d basisB = isTurned ? randomRotation(engine) : anyBasis(engine);
        const Eigen::Vector3d way = randomDirection(engine);
        const double reach = ballAlong(shapeA, basisA, way) + ballAlong(shapeB, basisB, way);
        tally.check(
            shapeA, {basisA.cast<float>(), Eigen::Vector3f(1, 2, 3)}, shapeB,
            {basisB.cast<float>(), (Eigen::Vector3d(1, 2, 3) + far(engine) * reach * way).cast<float>()},
            i % 3 == 0 ? 0.05f : 0.0f);
    }
    EXPECT_GT(tally.separated, 2000);
    EXPECT_GT(tally.overlapping, 500);
    EXPECT_GT(tally.without, 600) << "of " << tally.separated;
}

TEST(GjkBalls, ProveOnlyTrueSeparationsWhenTwoVerticesNearlyTouch)
{
    const Shape ball(icoPoints(2));
    std::mt19937 engine(17);
    std::normal_distribution<double> normal;
    BallTally tally;
    for (int i = 0; i < 2000; ++i)
    {
        SCOPED_TRACE(i);
        const Eigen::Vector3d way = randomDirection(engine);
        // Every other pair is stretched along the line between the origins, for which the filter by size() separates
        // them too early.
        const double stretch = i % 2;
        // Rotates a vertex of the shape into a direction.
        const auto turn = [&](const Eigen::Vector3d& direction) -> Eigen::Matrix3d
        {
            const auto vertex =
                static_cast<std::int32_t>(engine() % static_cast<unsigned>(ball.wide.vertexCount()));
            const auto turned = Eigen::Quaterniond::FromTwoVectors(ball.wide.vertex(vertex), direction);
            return (Eigen::Matrix3d::Identity() + stretch * way * way.transpose()) *
                   turned.toRotationMatrix();
        };
        const double reach = (1.0 + stretch) * 2.0 * ball.wide.radius() + 5e-4 * normal(engine);
        const Eigen::Matrix3d basisB = turn(-way), basisA = turn(way);
        tally.check(ball, {basisA.cast<float>(), Eigen::Vector3f::Zero()}, ball,
                    {basisB.cast<float>(), (reach * way).cast<float>()}, 0.0f);
    }
    EXPECT_GT(tally.separated, 500);
    EXPECT_GT(tally.overlapping, 500);
    EXPECT_GT(tally.without, 300) << "of " << tally.separated;
}
}  // namespace
}  // namespace cullet::test
