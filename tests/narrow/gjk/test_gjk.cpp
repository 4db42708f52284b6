// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/hull_pairs.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/narrow/gjk/isa_gjk.h"
#include "cullet/tests/narrow/search_observer.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <random>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr float kInfinity = std::numeric_limits<float>::infinity();

const Hull<float>& unitBox()
{
    static const Hull<float> hull = hullOf<float>(boxPoints(0.5, 0.5, 0.5));
    return hull;
}

PosedHull<float> at(const Hull<float>& hull, float x, float y, float z)
{
    return {hull, Eigen::Matrix3f::Identity(), Eigen::Vector3f(x, y, z)};
}

/// A ball: a convex shape without vertices.
class Ball
{
public:
    Ball(const Eigen::Vector3d& origin, double radius) : m_origin(origin), m_radius(radius) {}
    const Eigen::Vector3d& origin() const { return m_origin; }
    Eigen::Vector3d centre() const { return Eigen::Vector3d::Zero(); }
    std::int32_t vertexCount() const { return 0; }
    Eigen::Vector3d point(std::int32_t) const { return Eigen::Vector3d::Zero(); }
    SupportPoint support(const Eigen::Vector3d& direction, std::int32_t) const
    {
        return {m_radius * direction.normalized(), -1};
    }

private:
    Eigen::Vector3d m_origin;
    double m_radius;
};

/// A segment along z with a radius.
class Capsule
{
public:
    Capsule(double halfLength, double radius) : m_halfLength(halfLength), m_radius(radius) {}
    Eigen::Vector3d origin() const { return Eigen::Vector3d::Zero(); }
    Eigen::Vector3d centre() const { return Eigen::Vector3d::Zero(); }
    std::int32_t vertexCount() const { return 0; }
    Eigen::Vector3d point(std::int32_t) const { return Eigen::Vector3d::Zero(); }
    SupportPoint support(const Eigen::Vector3d& direction, std::int32_t) const
    {
        const double end = direction.z() > 0.0 ? m_halfLength : -m_halfLength;
        return {m_radius * direction.normalized() + Eigen::Vector3d(0.0, 0.0, end), -1};
    }
    /// Distance to a point; negative inside.
    double distanceTo(const Eigen::Vector3d& p) const
    {
        const double along = std::min(std::max(p.z(), -m_halfLength), m_halfLength);
        return (p - Eigen::Vector3d(0.0, 0.0, along)).norm() - m_radius;
    }

private:
    double m_halfLength, m_radius;
};

TEST(Gjk, FindsGapBetweenFacesOfTwoBoxes)
{
    GjkCache<float> cache;
    const auto result =
        gjkDistance(at(unitBox(), 0, 0, 0), at(unitBox(), -1.25f, 0.25f, 0), kInfinity, cache);
    ASSERT_EQ(result.state, GjkState::Near);
    EXPECT_FLOAT_EQ(result.distance, 0.25f);
    EXPECT_TRUE(result.axis.isApprox(Eigen::Vector3f(1, 0, 0)));
    EXPECT_FLOAT_EQ(result.pointA.x(), -0.5f);
    EXPECT_FLOAT_EQ(result.pointB.x(), -0.75f);
    EXPECT_FLOAT_EQ(result.pointA.y(), result.pointB.y());
}

TEST(Gjk, DividesSeparatedFromNearAtMaxDistance)
{
    const auto a = at(unitBox(), 0, 0, 0);
    const auto b = at(unitBox(), 1.5f, 0, 0);
    for (const bool isWarm : {false, true})
    {
        GjkCache<float> cache;
        for (int i = 0; i < (isWarm ? 3 : 1); ++i)
        {
            EXPECT_EQ(gjkDistance(a, b, 0.49f, cache).state, GjkState::Separated);
            EXPECT_EQ(isaGjk(a, b, 0.49f, cache).state, GjkState::Separated);
            EXPECT_EQ(gjkDistance(a, b, 0.51f, cache).state, GjkState::Near);
            EXPECT_EQ(isaGjk(a, b, 0.51f, cache).state, GjkState::Near);
        }
    }
    GjkCache<float> cache;
    for (const float limit : {0.0f, -1.0f, std::numeric_limits<float>::quiet_NaN()})
    {
        EXPECT_EQ(gjkDistance(a, b, limit, cache).state, GjkState::Separated);
        EXPECT_EQ(isaGjk(a, b, limit, cache).state, GjkState::Separated);
    }
    EXPECT_EQ(isaGjk(a, b, kInfinity, cache).state, GjkState::Near);
}

TEST(Gjk, KeepsMaxDistanceWhoseSquareUnderflows)
{
    // Tiny shapes, so that the distance is that of the origins.
    Points points = icoPoints(0);
    for (Eigen::Vector3d& p : points)
        p *= 1e-27;
    const Hull<float> hull = hullOf<float>(points);
    std::mt19937 engine(71);
    std::uniform_real_distribution<double> exponent(-24.0, -16.0);
    for (int i = 0; i < 20000; ++i)
    {
        const double distance = std::pow(10.0, exponent(engine));
        const Eigen::Vector3f p = (distance * randomDirection(engine)).cast<float>();
        const auto a = at(hull, 0, 0, 0);
        const auto b = at(hull, p.x(), p.y(), p.z());
        GjkCache<float> cache;
        ASSERT_EQ(isaGjk(a, b, static_cast<float>(1.005 * distance), cache).state, GjkState::Near)
            << distance;
        ASSERT_EQ(isaGjk(a, b, static_cast<float>(0.99 * distance), cache).state, GjkState::Separated)
            << distance;
    }
}

TEST(Gjk, ProvesNoFalseOverlapWhenTetrahedronVolumeUnderflows)
{
    std::mt19937 engine(72);
    std::normal_distribution<double> coordinate;
    const auto cloud = [&]
    {
        Points points;
        for (int i = 0; i < 6; ++i)
            points.push_back(1e-15 * drawVector(coordinate, engine));
        return hullOf<float>(points);
    };
    int overlapCount = 0;
    for (int i = 0; i < 20000; ++i)
    {
        const Hull<float> first = cloud(), second = cloud();
        const auto a = at(first, 0, 0, 0);
        GjkCache<float> cache;
        if (isaGjk(a, at(second, 0, 0, 0), 0.0f, cache).state != GjkState::Overlapping)
            continue;
        const Eigen::Vector3f p = (1e-15 * randomDirection(engine)).cast<float>();
        const auto b = at(second, p.x(), p.y(), p.z());
        if (isaGjk(a, b, 0.0f, cache).state != GjkState::Overlapping)
            continue;
        ++overlapCount;
        GjkCache<float> fresh;
        const auto apart = gjkDistance(a, b, kInfinity, fresh);
        ASSERT_TRUE(apart.state == GjkState::Overlapping || apart.distance < 1e-21f) << i;
    }
    EXPECT_GT(overlapCount, 3000);
}

TEST(Gjk, ReportsTouchingBoxesAsOverlapping)
{
    for (const Eigen::Vector3f& d :
         {Eigen::Vector3f(1, 0, 0), Eigen::Vector3f(1, 1, 0), Eigen::Vector3f(1, 1, 1),
          Eigen::Vector3f(1, 0.5f, 0.25f), Eigen::Vector3f(1, 1, 0.25f)})
    {
        GjkCache<float> cache;
        const auto a = at(unitBox(), 0, 0, 0);
        const auto b = at(unitBox(), d.x(), d.y(), d.z());
        EXPECT_EQ(isaGjk(a, b, 0.0f, cache).state, GjkState::Overlapping) << d.transpose();
        EXPECT_EQ(isaGjk(a, b, 0.0f, cache).state, GjkState::Overlapping) << d.transpose();
        EXPECT_EQ(gjkDistance(a, b, kInfinity, cache).state, GjkState::Overlapping) << d.transpose();
    }
}

TEST(Gjk, ReportsCoincidentShapesAsOverlapping)
{
    for (const NamedPoints& shape : queryShapes())
    {
        SCOPED_TRACE(shape.name);
        const Hull<float> hull = hullOf<float>(shape.points);
        GjkCache<float> cache;
        EXPECT_EQ(isaGjk(at(hull, 1, 2, 3), at(hull, 1, 2, 3), 0.0f, cache).state, GjkState::Overlapping);
        EXPECT_EQ(gjkDistance(at(hull, 1, 2, 3), at(hull, 1, 2, 3), 0.0f, cache).state,
                  GjkState::Overlapping);
    }
}

TEST(Gjk, FindsDistancesOfPointsSegmentsAndPolygons)
{
    const Hull<float> point = hullOf<float>({{0, 0, 0}});
    const Hull<float> segment = hullOf<float>({{-1, 0, 0}, {1, 0, 0}});
    const Hull<float> square = hullOf<float>({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}});
    GjkCache<float> cache;
    EXPECT_FLOAT_EQ(gjkDistance(at(point, 0, 0, 0), at(point, 3, 4, 0), kInfinity, cache).distance, 5.0f);
    EXPECT_EQ(gjkDistance(at(point, 3, 4, 0), at(point, 3, 4, 0), kInfinity, cache).state,
              GjkState::Overlapping);
    cache = {};
    EXPECT_FLOAT_EQ(gjkDistance(at(segment, 0, 0, 0), at(point, 3, 0, 0), kInfinity, cache).distance, 2.0f);
    cache = {};
    EXPECT_EQ(gjkDistance(at(segment, 0, 0, 0), at(segment, 0.5f, 0, 0), kInfinity, cache).state,
              GjkState::Overlapping);
    cache = {};
    EXPECT_FLOAT_EQ(gjkDistance(at(square, 0, 0, 0), at(square, 0.5f, 0, 2), kInfinity, cache).distance,
                    2.0f);
    cache = {};
    EXPECT_EQ(gjkDistance(at(square, 0, 0, 0), at(square, 0.5f, 0, 0), kInfinity, cache).state,
              GjkState::Overlapping);
}

TEST(Gjk, ConvergesForBallsWithoutVertices)
{
    std::mt19937 engine(5);
    int nearCount = 0;
    int overlapCount = 0;
    for (int i = 0; i < 2000; ++i)
    {
        SCOPED_TRACE(i);
        std::uniform_real_distribution<double> place(-2.0, 2.0);
        const Ball a({place(engine), place(engine), place(engine)}, 1.0);
        const Ball b({place(engine), place(engine), place(engine)}, 0.5);
        const double expected = (a.origin() - b.origin()).norm() - 1.5;
        if (std::abs(expected) < 1e-3)
            continue;
        GjkCache<double> cache;
        const auto result = gjkDistance(a, b, std::numeric_limits<double>::infinity(), cache);
        EXPECT_EQ(result.state, expected > 0.0 ? GjkState::Near : GjkState::Overlapping);
        EXPECT_EQ(isaGjk(a, b, 0.0, cache).state,
                  expected > 0.0 ? GjkState::Separated : GjkState::Overlapping);
        nearCount += expected > 0.0;
        overlapCount += expected < 0.0;
        if (expected > 0.0)
        {
            EXPECT_NEAR(result.distance, expected, 1e-7);
        }
    }
    EXPECT_GT(nearCount, 200);
    EXPECT_GT(overlapCount, 200);
}

TEST(Gjk, FindsExactDistanceOfBallFromBoxAndCapsule)
{
    const Hull<double> box = hullOf<double>(boxPoints(0.7, 0.5, 0.6));
    const PosedHull<double> boxAtOrigin(box, Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero());
    const Capsule capsule(0.8, 0.3);
    std::mt19937 engine(6);
    std::uniform_real_distribution<double> place(-2.0, 2.0);
    int nearCount = 0, overlapCount = 0;
    const auto check = [&](const auto& shape, const Ball& ball, double expected)
    {
        if (std::abs(expected) < 1e-3)
            return;
        GjkCache<double> cache;
        const auto result = gjkDistance(shape, ball, std::numeric_limits<double>::infinity(), cache);
        ASSERT_EQ(result.state, expected > 0.0 ? GjkState::Near : GjkState::Overlapping);
        ++(expected > 0.0 ? nearCount : overlapCount);
        if (expected > 0.0)
        {
            EXPECT_NEAR(result.distance, expected, 1e-7);
        }
    };
    for (int i = 0; i < 2000; ++i)
    {
        SCOPED_TRACE(i);
        const Eigen::Vector3d p = drawVector(place, engine);
        const Ball ball(p, 0.4);
        const Eigen::Vector3d beyond = p.cwiseAbs() - Eigen::Vector3d(0.7, 0.5, 0.6);
        check(boxAtOrigin, ball, beyond.cwiseMax(0.0).norm() - 0.4);
        check(capsule, ball, capsule.distanceTo(p) - 0.4);
    }
    EXPECT_GT(nearCount, 2000);
    EXPECT_GT(overlapCount, 200);
}

TEST(Gjk, GivesRightAnswerFromAnyCache)
{
    const Hull<float> ico = hullOf<float>(icoPoints(1));
    const Hull<float> box = hullOf<float>(boxPoints(0.7, 0.5, 0.6));
    std::mt19937 engine(8);
    int overlapCount = 0;
    for (int i = 0; i < 20000; ++i)
    {
        SCOPED_TRACE(i);
        const double gap = i % 2 == 0 ? 0.01 : -0.02;
        const PairScene<float> scene = randomPair(ico, box, gap, 0.0, engine);
        GjkCache<float> cache;
        for (int k = 0; k < 4; ++k)
        {
            // 0x3f: sometimes a vertex that the box does not have; equal ones; unknown ones.
            cache.verticesA[k] = static_cast<std::uint16_t>(engine() & 0x3fu);
            cache.verticesB[k] = static_cast<std::uint16_t>(engine() % 9u == 0 ? 0xffffu : engine() & 0xfu);
        }
        cache.startA = static_cast<std::uint16_t>(engine() & 0x3fu);
        cache.startB = static_cast<std::uint16_t>(engine() & 0x3fu);
        cache.count = static_cast<std::uint8_t>(engine() % 5u);
        cache.state = static_cast<GjkState>(engine() % 4u);
        for (float& component : cache.axis)
            component = static_cast<float>(randomDirection(engine).x());
        GjkCache<float> other = cache;
        const GjkState expected = gap > 0.0 ? GjkState::Separated : GjkState::Overlapping;
        ASSERT_EQ(isaGjk(scene.posedA(), scene.posedB(), 0.0f, cache).state, expected);
        const auto result = gjkDistance(scene.posedA(), scene.posedB(), kInfinity, other);
        ASSERT_EQ(result.state == GjkState::Near, gap > 0.0);
        overlapCount += gap < 0.0;
        if (gap > 0.0)
        {
            ASSERT_NEAR(result.distance, gap, 1e-6);
        }
    }
    EXPECT_EQ(overlapCount, 10000);
}

TEST(Gjk, DoesNotConvergeForNonFiniteInputs)
{
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const Hull<float> ico = hullOf<float>(icoPoints(2));
    for (const float bad : {nan, kInfinity, -kInfinity})
    {
        for (const Hull<float>* hull : {&ico, &unitBox()})
        {
            GjkCache<float> cache;
            const auto a = at(*hull, 0, 0, 0);
            EXPECT_EQ(isaGjk(a, at(*hull, bad, 0, 0), 0.0f, cache).state, GjkState::NotConverged) << bad;
            EXPECT_EQ(gjkDistance(a, at(*hull, bad, 0, 0), kInfinity, cache).state, GjkState::NotConverged)
                << bad;
            for (const GjkStart start : {GjkStart::Axis, GjkStart::FourDirections})
            {
                NoObserver observer;
                const auto b = at(*hull, bad, 0, 0);
                EXPECT_EQ(isaGjk(a, b, 0.0f, cache, observer, IsaGjkVariant{start, 0}).state,
                          GjkState::NotConverged);
                EXPECT_EQ(gjkDistance(a, b, kInfinity, cache, observer, start).state, GjkState::NotConverged);
            }
            const PosedHull<float> turned(*hull, Eigen::Matrix3f::Constant(bad), Eigen::Vector3f::Zero());
            EXPECT_EQ(isaGjk(a, turned, 0.0f, cache).state, GjkState::NotConverged) << bad;
            // A warm cache has no influence on that.
            EXPECT_EQ(isaGjk(a, at(*hull, 5, 0, 0), 0.0f, cache).state, GjkState::Separated);
            EXPECT_EQ(isaGjk(a, at(*hull, bad, 0, 0), 0.0f, cache).state, GjkState::NotConverged) << bad;
            EXPECT_EQ(isaGjk(a, at(*hull, 0.1f, 0, 0), 0.0f, cache).state, GjkState::Overlapping);
            EXPECT_EQ(isaGjk(a, at(*hull, bad, 0, 0), 0.0f, cache).state, GjkState::NotConverged) << bad;
        }
    }
}

TEST(Gjk, TakesScaledAndMirroredBases)
{
    const Hull<float> ico = hullOf<float>(icoPoints(2));
    Eigen::Matrix3f basis = Eigen::Vector3f(-2.0f, 0.5f, 1.0f).asDiagonal();
    const PosedHull<float> a(ico, basis, Eigen::Vector3f(0, 0, 0));
    Points scaled = icoPoints(2);
    for (Eigen::Vector3d& p : scaled)
        p = basis.cast<double>() * p;
    const Hull<float> direct = hullOf<float>(scaled);
    GjkCache<float> first, second;
    const auto result = gjkDistance(a, at(unitBox(), 1.0f, 2.0f, 1.5f), kInfinity, first);
    const auto expected =
        gjkDistance(at(direct, 0, 0, 0), at(unitBox(), 1.0f, 2.0f, 1.5f), kInfinity, second);
    ASSERT_EQ(result.state, GjkState::Near);
    EXPECT_FLOAT_EQ(result.distance, expected.distance);
    EXPECT_GT(result.distance, 0.5f);
}

TEST(Gjk, ShowsObserverBoundsThatConverge)
{
    const Hull<float> ico = hullOf<float>(icoPoints(2));
    std::vector<double> upper;
    std::vector<double> lower;
    SearchObserver observer = [&](const Eigen::Vector3d& v, double along)
    {
        upper.push_back(v.norm());
        lower.push_back(along / v.norm());
    };
    GjkCache<float> cache;
    const auto result =
        gjkDistance(at(ico, 0, 0, 0), at(unitBox(), 1.6f, 0.6f, 0.3f), kInfinity, cache, observer);
    ASSERT_EQ(result.state, GjkState::Near);
    ASSERT_GE(upper.size(), 2u);
    for (std::size_t i = 1; i < upper.size(); ++i)
        EXPECT_LT(upper[i], upper[i - 1]);
    EXPECT_NEAR(lower.back(), result.distance, 1e-6);
    EXPECT_NEAR(upper.back(), result.distance, 1e-6);
}

}  // namespace
}  // namespace cullet::test
