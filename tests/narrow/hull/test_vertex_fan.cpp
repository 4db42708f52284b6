// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/narrow/build/hull_builder.h"
#include "cullet/narrow/hull/corner_projection.h"
#include "cullet/narrow/hull/vertex_fan.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
template <class S>
class VertexFanTest : public testing::Test
{
};
using FanScalars = testing::Types<float, double>;
TYPED_TEST_SUITE(VertexFanTest, FanScalars);

template <class S>
using PointsOf = std::vector<Eigen::Matrix<S, 3, 1>>;

/// Points on a ball, in it, flattened, in a grid, or in two planes up to `rise`.
template <class S>
PointsOf<S> fanPoints(int kind, int count, double rise, std::mt19937& engine)
{
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> part(0.7, 1.0), within(-rise, rise);
    PointsOf<S> points;
    for (int i = 0; i < count; ++i)
    {
        Eigen::Vector3d p = drawVector(normal, engine).normalized();
        if (kind == 1)
            p *= part(engine);
        if (kind == 2)
            p[1] *= 0.02;
        if (kind == 3)
            p = (p * 3.0).array().round();
        if (kind == 4)
            p[1] = std::copysign(0.5, p[1]) + within(engine);
        points.push_back(p.template cast<S>());
    }
    return points;
}

/// Expects every face of one hull at its index in the other.
template <class S>
void expectSameFaces(const VertexFan<S>& fan, const Hull<S>& hull, std::int32_t vertex)
{
    const auto faces = hull.facesOf(vertex);
    ASSERT_EQ(fan.end() - fan.begin(), faces.size());
    for (std::int32_t i = 0; i < faces.size(); ++i)
    {
        const ClearFace& face = fan.begin()[i];
        const auto corners = hull.faceVertices(faces[i]);
        ASSERT_EQ(corners.size(), 3);
        for (std::int32_t k = 0; k < 3; ++k)
            EXPECT_EQ(face.corners[static_cast<std::size_t>(k)], hull.sourceIndex(corners[k]));
        EXPECT_EQ(face.normal, hull.faces()[static_cast<std::size_t>(faces[i])].normal);
    }
}

TYPED_TEST(VertexFanTest, HasTheFacesOfTheHullOrIsNotKnown)
{
    using S = TypeParam;
    constexpr unsigned kSeed = 29;
    SCOPED_TRACE(kSeed);
    std::mt19937 engine(kSeed);
    const double eps = std::numeric_limits<S>::epsilon();
    int known[5] = {}, asked[5] = {};
    for (int i = 0; i < 1500; ++i)
    {
        const int kind = i % 5;
        // Heights on both sides of the tolerance of merging.
        const double rise = eps * std::pow(10.0, 0.002 * i);
        const PointsOf<S> points = fanPoints<S>(kind, 4 + i % 60, rise, engine);
        const Hull<S> hull = makeCornerHull(points), cloud = makeCloud(points);
        if (hull.kind() != HullKind::Solid)
            continue;
        for (std::int32_t v = 0; v < hull.vertexCount(); ++v)
        {
            Eigen::Vector3d outward = Eigen::Vector3d::Zero();
            for (const std::int32_t face : hull.facesOf(v))
                outward += hull.faces()[static_cast<std::size_t>(face)].normal;
            const VertexFan<S> fan(cloud, hull.sourceIndex(v), outward);
            ++asked[kind];
            if (!fan.isKnown())
                continue;
            ++known[kind];
            expectSameFaces(fan, hull, v);
            ASSERT_FALSE(testing::Test::HasFailure()) << "points " << i << " vertex " << v;
        }
    }
    for (const int kind : {0, 1})
        EXPECT_GT(known[kind], asked[kind] * 8 / 10) << kind;
    EXPECT_GT(known[2], 100);
    EXPECT_GT(known[4], 100);
    EXPECT_LT(known[4], asked[4]);
    EXPECT_GT(asked[3], 1000);
}

/// The ends of the edges at a vertex, ascending.
template <class S>
std::vector<std::int32_t> endsOfEdges(const Hull<S>& hull, std::int32_t vertex)
{
    std::vector<std::int32_t> ends;
    for (const auto& edge : hull.edges())
    {
        if (edge.from == vertex || edge.to == vertex)
            ends.push_back(hull.sourceIndex(edge.from == vertex ? edge.to : edge.from));
    }
    std::sort(ends.begin(), ends.end());
    return ends;
}

TYPED_TEST(VertexFanTest, HasItsEdgesShownByAProjectionFromTheCentre)
{
    using S = TypeParam;
    constexpr unsigned kSeed = 30;
    SCOPED_TRACE(kSeed);
    std::mt19937 engine(kSeed);
    int shown[2] = {}, asked[2] = {};
    for (int i = 0; i < 200; ++i)
    {
        const int kind = i % 2;
        const PointsOf<S> points = fanPoints<S>(kind, 4 + i % 60, 0.0, engine);
        const Hull<S> hull = makeCornerHull(points), cloud = makeCloud(points);
        for (std::int32_t v = 0; v < hull.vertexCount(); ++v)
        {
            const std::int32_t vertex = hull.sourceIndex(v);
            const Eigen::Vector3d way = cloud.vertex(vertex).template cast<double>() - cloud.centre();
            const CornerProjection<S> projection(cloud, vertex, way.normalized());
            std::vector<std::int32_t> ends(projection.begin(), projection.end());
            std::sort(ends.begin(), ends.end());
            ++asked[kind];
            shown[kind] += ends == endsOfEdges(hull, v) ? 1 : 0;
        }
    }
    // Some corners, more of a rough ball, are not the farthest points along the way from the centre.
    EXPECT_GT(shown[0], asked[0] * 8 / 10) << asked[0];
    EXPECT_GT(shown[1], asked[1] / 2) << asked[1];
    EXPECT_GT(asked[1], 1000);
}

TYPED_TEST(VertexFanTest, HasTheFacesOfTheHullWhenThereAreTooManyPointsToProject)
{
    using S = TypeParam;
    constexpr unsigned kSeed = 31;
    SCOPED_TRACE(kSeed);
    std::mt19937 engine(kSeed);
    int known = 0, asked = 0;
    for (int i = 0; i < 4; ++i)
    {
        const PointsOf<S> points =
            fanPoints<S>(0, CornerProjection<S>::kMostPoints + 1 + 40 * i, 0.0, engine);
        const Hull<S> hull = makeCornerHull(points), cloud = makeCloud(points);
        for (std::int32_t v = 0; v < hull.vertexCount(); v += 3)
        {
            const std::int32_t vertex = hull.sourceIndex(v);
            const VertexFan<S> fan(cloud, vertex, cloud.vertex(vertex).template cast<double>());
            ++asked;
            if (!fan.isKnown())
                continue;
            ++known;
            expectSameFaces(fan, hull, v);
            ASSERT_FALSE(testing::Test::HasFailure()) << "points " << i << " vertex " << v;
        }
    }
    EXPECT_GT(asked, 300);
    EXPECT_GT(known, asked * 8 / 10);
}

TYPED_TEST(VertexFanTest, FindsAClearFaceByItsCornersInAnyOrder)
{
    using S = TypeParam;
    constexpr unsigned kSeed = 37;
    SCOPED_TRACE(kSeed);
    std::mt19937 engine(kSeed);
    const PointsOf<S> points = fanPoints<S>(0, 40, 0.0, engine);
    const Hull<S> hull = makeCornerHull(points), cloud = makeCloud(points);
    int orders = 0;
    for (std::size_t f = 0; f < hull.faces().size(); ++f)
    {
        std::array<std::int32_t, 3> corners;
        const auto vertices = hull.faceVertices(static_cast<std::int32_t>(f));
        ASSERT_EQ(vertices.size(), 3);
        for (std::int32_t k = 0; k < 3; ++k)
            corners[static_cast<std::size_t>(k)] = hull.sourceIndex(vertices[k]);
        std::sort(corners.begin(), corners.end());
        do
        {
            ClearFace face;
            ASSERT_TRUE(findClearFace(cloud, corners, face));
            EXPECT_EQ(face.normal, hull.faces()[f].normal) << "normals point outwards";
            ++orders;
        } while (std::next_permutation(corners.begin(), corners.end()));
    }
    EXPECT_GT(orders, 6 * 50);
}

/// The tip of a cone over a polygon whose sides all differ.
template <class S>
PointsOf<S> conePoints(std::size_t sides)
{
    PointsOf<S> points = {{0, 1, 0}};
    for (std::size_t i = 0; i < sides; ++i)
    {
        const double part = double(i) / double(sides), angle = 6.2 * part * (0.7 + 0.3 * part);
        points.push_back({S(std::cos(angle)), S(0), S(std::sin(angle))});
    }
    return points;
}

TYPED_TEST(VertexFanTest, IsKnownAtATipWithUpToSixteenFaces)
{
    using S = TypeParam;
    for (std::size_t sides = 3; sides < 40; ++sides)
    {
        const Hull<S> cloud = makeCloud(conePoints<S>(sides));
        const VertexFan<S> fan(cloud, 0, Eigen::Vector3d::UnitY());
        EXPECT_EQ(fan.isKnown(), sides <= 16) << sides;
        EXPECT_EQ(fan.end() - fan.begin(), sides <= 16 ? static_cast<std::ptrdiff_t>(sides) : 0);
    }
}

TYPED_TEST(VertexFanTest, HasNoEdgesInAProjectionWithPointsLevelOrAbove)
{
    using S = TypeParam;
    const PointsOf<S> octahedron = {{1, 0, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}, {0, 1, 0}};
    const Hull<S> cloud = makeCloud(octahedron);
    const auto count = [&](const Eigen::Vector3d& axis)
    {
        const CornerProjection<S> projection(cloud, 5, axis);
        return projection.end() - projection.begin();
    };
    EXPECT_EQ(count(Eigen::Vector3d::UnitY()), 4);
    EXPECT_EQ(count(Eigen::Vector3d(1, 2, 0).normalized()), 4);
    EXPECT_EQ(count(Eigen::Vector3d(1, 1, 0).normalized()), 0);
    EXPECT_EQ(count(-Eigen::Vector3d::UnitY()), 0);
    EXPECT_EQ(count(Eigen::Vector3d::Zero()), 0);
}

TYPED_TEST(VertexFanTest, IsNotKnownWhenPointsSpanNoVolume)
{
    using S = TypeParam;
    const Eigen::Vector3d up = Eigen::Vector3d::UnitY();
    const PointsOf<S> line = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
    const PointsOf<S> square = {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}, {0, 0, 0}};
    const PointsOf<S> equal(5, {1, 2, 3});
    const PointsOf<S> triangle = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}};
    for (const PointsOf<S>& points : {line, square, equal, triangle})
    {
        const Hull<S> cloud = makeCloud(points);
        for (std::int32_t v = 0; v < cloud.vertexCount(); ++v)
        {
            for (const double size : {1.0, -1.0, 0.0})
                EXPECT_FALSE((VertexFan<S>(cloud, v, size * up).isKnown()));
        }
    }
}
}  // namespace
}  // namespace cullet::test
