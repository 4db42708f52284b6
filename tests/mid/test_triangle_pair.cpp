// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/mid/triangle_pair.h"
#include "cullet/tests/support/random.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace cullet
{
namespace
{
using Eigen::Vector3d;

struct Pair
{
    TriangleCorners a, b;
    double size = 1;  ///< of both
};

/// Triangles of several sizes and shapes: ordinary ones, needles, segments, points, level and parallel ones.
class RandomPairs
{
public:
    explicit RandomPairs(std::uint32_t seed) : m_random(seed) {}

    void make(Pair& pair)
    {
        pair.size = std::pow(10.0, uniform(-2, 2));
        fill(pair.a, pair.size, Vector3d::Zero());
        const double far = pair.size * uniform(0, 2);
        const Vector3d direction = vector().normalized();
        fill(pair.b, pair.size, direction * far);
        const double kind = uniform(0, 1);
        if (kind < 0.1)
            makeParallel(pair);
        else if (kind < 0.2)
            shareEdgeDirection(pair);
        else if (kind < 0.3)
            degenerate(pair.b);
    }

    double uniform(double low, double high) { return low + (high - low) * double(m_random.unit()); }

private:
    Vector3d vector()
    {
        Vector3d v;
        for (int i = 0; i < 3; ++i)
            v[i] = uniform(-1, 1);
        return v;
    }

    void fill(TriangleCorners& corners, double size, const Vector3d& place)
    {
        for (Vector3d& corner : corners)
            corner = place + size * vector();
    }

    /// The planes are level, with a gap.
    void makeParallel(Pair& pair)
    {
        const double gap = pair.size * uniform(0.01, 0.2);
        for (int i = 0; i < 3; ++i)
        {
            pair.a[i][1] = 0;
            pair.b[i][1] = gap;
        }
    }

    void shareEdgeDirection(Pair& pair) { pair.b[1] = pair.b[0] + (pair.a[1] - pair.a[0]) * uniform(0.2, 2); }

    void degenerate(TriangleCorners& corners)
    {
        const double kind = uniform(0, 1);
        if (kind < 0.3)
            corners[2] = corners[1];
        else if (kind < 0.5)
            corners[1] = corners[2] = corners[0];
        else
            corners[2] = corners[0] + (corners[1] - corners[0]) * uniform(-1, 2);
    }

    test::Random m_random;
};

double lowestAlong(const TriangleCorners& corners, const Vector3d& direction)
{
    return std::min({corners[0].dot(direction), corners[1].dot(direction), corners[2].dot(direction)});
}

double highestAlong(const TriangleCorners& corners, const Vector3d& direction)
{
    return -lowestAlong(corners, -direction);
}

/// The square of the distance of a point from a triangle, by bisection of its corners' weights.
double distanceTo(const TriangleCorners& triangle, const Vector3d& point)
{
    TriangleCorners now = {triangle[0], triangle[1], triangle[2]};
    // The least of a convex function on an edge, and of that over the edges of a fan.
    const auto onSegment = [&](const Vector3d& from, const Vector3d& to)
    {
        const Vector3d edge = to - from;
        const double length2 = edge.squaredNorm();
        const double part = length2 > 0 ? std::clamp(edge.dot(point - from) / length2, 0.0, 1.0) : 0.0;
        return (from + part * edge - point).norm();
    };
    double low = 0, high = 1;
    const auto at = [&](double part) { return onSegment(now[0], now[1] + part * (now[2] - now[1])); };
    for (int i = 0; i < 60; ++i)
    {
        const double first = low + (high - low) / 3, second = high - (high - low) / 3;
        (at(first) < at(second) ? high : low) = at(first) < at(second) ? second : first;
    }
    return std::min({at(low), at(0), at(1), onSegment(now[1], now[2])});
}

/// Whether an edge of a triangle passes through another triangle, or nearly.
bool pierces(const TriangleCorners& edges, const TriangleCorners& face, double tolerance)
{
    for (int i = 0; i < 3; ++i)
    {
        double low = 0, high = 1;
        const auto at = [&](double part)
        { return distanceTo(face, edges[i] + part * (edges[(i + 1) % 3] - edges[i])); };
        for (int k = 0; k < 60; ++k)
        {
            const double first = low + (high - low) / 3, second = high - (high - low) / 3;
            (at(first) < at(second) ? high : low) = at(first) < at(second) ? second : first;
        }
        if (at(low) <= tolerance)
            return true;
    }
    return false;
}

constexpr std::uint32_t kSeed = 41;

TEST(TrianglePair, HasClosestPointsThatNoCornerIsAheadOf)
{
    RandomPairs pairs(kSeed);
    int near = 0, corners = 0;
    for (int i = 0; i < 100000; ++i)
    {
        Pair pair;
        pairs.make(pair);
        TrianglePairTouch touch;
        if (findTouch(pair.a, pair.b, 10 * pair.size, touch) != TrianglePairState::Near)
            continue;
        SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", pair " << i);
        const double tolerance = 1e-9 * pair.size;
        const Vector3d onA = touch.onB + touch.distance * touch.normal;
        ASSERT_NEAR(touch.normal.norm(), 1, 1e-12);
        ASSERT_GE(lowestAlong(pair.a, touch.normal), touch.normal.dot(onA) - tolerance);
        ASSERT_LE(highestAlong(pair.b, touch.normal), touch.normal.dot(touch.onB) + tolerance);
        ASSERT_NEAR(pair.a[touch.cornerA].dot(touch.normal), lowestAlong(pair.a, touch.normal), tolerance);
        ASSERT_NEAR(pair.b[touch.cornerB].dot(touch.normal), highestAlong(pair.b, touch.normal), tolerance);
        if (touch.areCorners)
        {
            ++corners;
            ASSERT_NEAR((pair.a[touch.cornerA] - onA).norm(), 0, tolerance);
            ASSERT_NEAR((pair.b[touch.cornerB] - touch.onB).norm(), 0, tolerance);
        }
        if (i % 20 == 0)
        {
            // By thirds of an interval, good to the root of a rounding.
            ASSERT_LT(distanceTo(pair.a, onA), 1e-6 * pair.size);
            ASSERT_LT(distanceTo(pair.b, touch.onB), 1e-6 * pair.size);
        }
        ++near;
    }
    EXPECT_GT(near, 60000);
    EXPECT_GT(corners, 2000);
}

/// Calls use(pair, touch, limit, index) for those of `count` pairs that have a state.
///
/// @param most times the size: the largest limit
template <class Use>
int forEachPairOf(TrianglePairState state, std::uint32_t seed, int count, double most, const Use& use)
{
    RandomPairs pairs(seed);
    int found = 0;
    for (int i = 0; i < count; ++i)
    {
        Pair pair;
        pairs.make(pair);
        const double limit = pair.size * pairs.uniform(0, most);
        TrianglePairTouch touch;
        if (findTouch(pair.a, pair.b, limit, touch) != state)
            continue;
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", pair " << i);
        use(pair, touch, limit, found++);
    }
    return found;
}

TEST(TrianglePair, IsApartOnlyWhenPlaneProvesIt)
{
    const int apart =
        forEachPairOf(TrianglePairState::Apart, kSeed + 1, 100000, 0.5,
                      [](const Pair& pair, const TrianglePairTouch& touch, double limit, int)
                      {
                          ASSERT_GT(lowestAlong(pair.a, touch.normal) - highestAlong(pair.b, touch.normal),
                                    limit - 1e-9 * pair.size);
                      });
    EXPECT_GT(apart, 40000);
}

TEST(TrianglePair, IsUnknownOnlyWhenTrianglesTouch)
{
    const int unknown = forEachPairOf(
        TrianglePairState::Unknown, kSeed + 2, 20000, 1.0,
        [](const Pair& pair, const TrianglePairTouch&, double, int i)
        {
            const double tolerance = 1e-5 * pair.size;
            const bool isTried = i < 60;
            EXPECT_TRUE(!isTried || pierces(pair.a, pair.b, tolerance) || pierces(pair.b, pair.a, tolerance));
        });
    EXPECT_GT(unknown, 300);
}

TEST(TrianglePair, IsUnknownWhenEdgePassesThroughMiddleOfLargeTriangle)
{
    const TriangleCorners large = {{-10, 0, -10}, {10, 0, -10}, {0, 0, 10}};
    const TriangleCorners small = {{0, 1, 0}, {0.1, -1, 0}, {-0.1, -1, 0}};
    TrianglePairTouch touch;
    // The closest corner is a metre above the large one.
    EXPECT_EQ(findTouch(large, small, 0.1, touch), TrianglePairState::Unknown);
    EXPECT_EQ(findTouch(small, large, 0.1, touch), TrianglePairState::Unknown);
}

TEST(TrianglePair, HasNormalOfFaceWhenTrianglesAreLevel)
{
    const TriangleCorners below = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}};
    const TriangleCorners above = {{0.1, 0.25, 0.1}, {2, 0.25, 0.2}, {0.3, 0.25, 3}};
    TrianglePairTouch touch;
    ASSERT_EQ(findTouch(above, below, 0.5, touch), TrianglePairState::Near);
    EXPECT_EQ(touch.normal, Vector3d::UnitY());
    EXPECT_DOUBLE_EQ(touch.distance, 0.25);
    EXPECT_EQ(findTouch(above, below, 0.2, touch), TrianglePairState::Apart);
}
}  // namespace
}  // namespace cullet
