// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/narrow/build/hull_builder.h"
#include "cullet/narrow/math/simplex.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <utility>
#include <vector>

/// Merged faces of hulls with many points in one plane, where rounding decides about every sliver.
namespace cullet::test
{
namespace
{
template <class S>
class HullFaces : public testing::Test
{
};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(HullFaces, Scalars);

int upTo(std::mt19937& engine, int count)
{
    return std::uniform_int_distribution<int>(0, count - 1)(engine);
}

double between(std::mt19937& engine, double low, double high)
{
    return std::uniform_real_distribution<double>(low, high)(engine);
}

Points turned(const Points& points, double size, std::mt19937& engine)
{
    return moved(points, size * randomRotation(engine), {0.0, 0.0, 0.0});
}

/// Two grids of a x b points, one above the other.
Points gridSlab(int a, int b, double height)
{
    Points points;
    for (int i = 0; i < a; ++i)
    {
        for (int j = 0; j < b; ++j)
            points.insert(points.end(), {{1.0 * i, 1.0 * j, 0.0}, {1.0 * i, 1.0 * j, height}});
    }
    return points;
}

/// Rings of points, each in one plane and straight above the ring below.
Points ringedPrism(int sides, int rings)
{
    Points points;
    for (int ring = 0; ring < rings; ++ring)
    {
        for (int i = 0; i < sides; ++i)
        {
            const double angle = 2.0 * 3.14159265358979323846 * i / sides;
            points.push_back({std::cos(angle), std::sin(angle), 0.5 * ring});
        }
    }
    return points;
}

Points latticeCloud(int count, int cells, std::mt19937& engine)
{
    Points points;
    for (int i = 0; i < count; ++i)
        points.push_back({1.0 * upTo(engine, cells), 1.0 * upTo(engine, cells), 1.0 * upTo(engine, cells)});
    return points;
}

using Faces = std::vector<std::vector<std::int32_t>>;

/// The faces of each side; each face has to be a closed walk that visits no vertex twice.
std::map<std::pair<int, int>, std::set<int>> sidesOf(const Faces& faces)
{
    std::map<std::pair<int, int>, std::set<int>> sides;
    for (std::size_t face = 0; face < faces.size(); ++face)
    {
        const std::vector<std::int32_t>& corners = faces[face];
        EXPECT_GE(corners.size(), 3u);
        EXPECT_EQ(std::set<int>(corners.begin(), corners.end()).size(), corners.size());
        for (std::size_t i = 0; i < corners.size(); ++i)
            sides[{corners[i], corners[(i + 1) % corners.size()]}].insert(static_cast<int>(face));
    }
    return sides;
}

/// Expects faces and edges of a polyhedron: each side of a face is an edge to one other face.
template <class Edges>
void expectPolyhedron(const Faces& faces, const Edges& edges)
{
    const auto sides = sidesOf(faces);
    std::size_t sideCount = 0;
    std::set<int> corners;
    for (const auto& [ends, facesThere] : sides)
    {
        sideCount += facesThere.size();
        corners.insert(ends.first);
    }
    EXPECT_EQ(sideCount, 2 * edges.size());
    EXPECT_EQ(corners.size() + faces.size(), edges.size() + 2);
    const auto isSideOf = [&sides](int from, int to, int face)
    {
        const auto side = sides.find({from, to});
        return side != sides.end() && side->second.count(face) == 1;
    };
    for (const auto& edge : edges)
    {
        EXPECT_NE(edge.left, edge.right);
        EXPECT_TRUE(isSideOf(edge.from, edge.to, edge.left));
        EXPECT_TRUE(isSideOf(edge.to, edge.from, edge.right));
    }
}

/// Expects unit outward normals, coplanar corners in counter-clockwise order, and no vertex outside.
template <class S>
void expectOutwardFaces(const Hull<S>& hull)
{
    // 16 for the merging.
    const double tolerance = 20.0 * std::numeric_limits<S>::epsilon() * hull.radius();
    for (int face = 0; face < static_cast<int>(hull.faces().size()); ++face)
    {
        const auto& plane = hull.faces()[face];
        EXPECT_NEAR(plane.normal.norm(), 1.0, 1e-12);
        for (int v = 0; v < hull.vertexCount(); ++v)
            EXPECT_LE(plane.normal.dot(hull.vertex(v).template cast<double>()), plane.offset + tolerance);
        Eigen::Vector3d area = Eigen::Vector3d::Zero();
        const auto corners = hull.faceVertices(face);
        for (int i = 0; i < corners.size(); ++i)
        {
            const Eigen::Vector3d p = hull.vertex(corners[i]).template cast<double>();
            const Eigen::Vector3d q = hull.vertex(corners[(i + 1) % corners.size()]).template cast<double>();
            EXPECT_NEAR(plane.normal.dot(p), plane.offset, 2.0 * tolerance);
            area += p.cross(q);
        }
        EXPECT_GT(area.dot(plane.normal), 0.0);
    }
}

template <class S>
void expectFaces(const Hull<S>& hull)
{
    Faces faces;
    for (int face = 0; face < static_cast<int>(hull.faces().size()); ++face)
        faces.emplace_back(hull.faceVertices(face).begin(), hull.faceVertices(face).end());
    expectPolyhedron(faces, hull.edges());
    expectOutwardFaces(hull);
}

TYPED_TEST(HullFaces, FormSixRectanglesForTurnedGridBoxes)
{
    std::mt19937 engine(61);
    for (int i = 0; i < 1000 && !this->HasFailure(); ++i)
    {
        SCOPED_TRACE(i);
        // In the order in which GCC evaluates arguments, which recorded counts rely on.
        const double height = between(engine, 0.5, 9.0);
        const int b = 2 + upTo(engine, 9), a = 2 + upTo(engine, 9);
        const Points points = gridSlab(a, b, height);
        const auto hull =
            hullOf<TypeParam>(turned(points, std::pow(10.0, between(engine, -3.0, 3.0)), engine));
        for (const auto* body : {&hull, &hull.corners()})
        {
            expectFaces(*body);
            EXPECT_EQ(body->faces().size(), 6u);
            EXPECT_EQ(body->edges().size(), 12u);
        }
    }
}

TYPED_TEST(HullFaces, FormSidesAndTwoEndsForTurnedRingedPrisms)
{
    std::mt19937 engine(62);
    for (int i = 0; i < 1000 && !this->HasFailure(); ++i)
    {
        SCOPED_TRACE(i);
        const int sides = 3 + upTo(engine, 14);
        const auto hull = hullOf<TypeParam>(turned(ringedPrism(sides, 2 + upTo(engine, 5)), 1.0, engine));
        for (const auto* body : {&hull, &hull.corners()})
        {
            expectFaces(*body);
            EXPECT_EQ(body->faces().size(), static_cast<std::size_t>(sides + 2));
            EXPECT_EQ(body->edges().size(), static_cast<std::size_t>(3 * sides));
        }
    }
}

TYPED_TEST(HullFaces, HaveSimpleOutlinesForLatticeClouds)
{
    std::mt19937 engine(63);
    int solidCount = 0;
    for (int i = 0; i < 3000 && !this->HasFailure(); ++i)
    {
        SCOPED_TRACE(i);
        const int count = 5 + upTo(engine, 60);
        Points points = latticeCloud(count, 2 + upTo(engine, 6), engine);
        if (i % 2 == 0)
            points = turned(points, 1.0, engine);
        const auto hull = hullOf<TypeParam>(points);
        if (hull.kind() != HullKind::Solid)
            continue;
        ++solidCount;
        for (const auto* body : {&hull, &hull.corners()})
            expectFaces(*body);
    }
    EXPECT_GT(solidCount, 2500);
}

TEST(FaceMerger, MakesSimpleOutlinesForEveryTolerance)
{
    std::mt19937 engine(64);
    for (int i = 0; i < 4000 && !HasFailure(); ++i)
    {
        SCOPED_TRACE(i);
        const double z = between(engine, 0.01, 1.0), y = between(engine, 0.01, 1.0);
        const Eigen::Vector3d axes(1.0, y, z);
        const unsigned seed = i % 2 == 0 ? static_cast<unsigned>(engine()) : 0;
        const Points points =
            i % 2 == 0 ? ellipsoidPoints(5 + upTo(engine, 60), axes, seed)
                       : moved(gridBoxPoints(2 + upTo(engine, 4)), axes.asDiagonal(), {0.0, 0.0, 0.0});
        const Quickhull surface(points, seedOf(points));
        const FaceMerger merged(points, surface.triangles(), std::pow(10.0, between(engine, -4.0, 0.5)));
        ASSERT_GE(merged.polygons().size(), 2u);
        Faces faces;
        for (const FaceMerger::Polygon& polygon : merged.polygons())
            faces.emplace_back(&merged.corners()[polygon.begin],
                               &merged.corners()[polygon.begin] + polygon.count);
        expectPolyhedron(faces, merged.edges());
    }
}

/// From a point to the nearest triangle of the fans of all polygons.
double distanceToPolygons(const Points& points, const FaceMerger& merged, const Eigen::Vector3d& p)
{
    double least2 = std::numeric_limits<double>::infinity();
    for (const FaceMerger::Polygon& polygon : merged.polygons())
    {
        const std::int32_t* const corners = &merged.corners()[polygon.begin];
        for (std::int32_t i = 2; i < polygon.count; ++i)
        {
            const SimplexPoints fan = {
                points[corners[0]] - p, points[corners[i - 1]] - p, points[corners[i]] - p, {}};
            least2 = std::min(least2, closestOnSimplex(fan, 3).length2);
        }
    }
    return std::sqrt(least2);
}

TEST(FaceMerger, LeavesEveryVertexNearThePolygons)
{
    constexpr unsigned kSeed = 65;
    std::mt19937 engine(kSeed);
    int left = 0, dropped = 0;
    double worst = 0.0;
    for (int i = 0; i < 600; ++i)
    {
        // A lens: its two sides merge to one polygon each, and its rim has hardly a corner of its own.
        const double height = between(engine, 0.002, 0.02), tolerance = height * between(engine, 1.5, 3.0);
        const unsigned seed = static_cast<unsigned>(engine());
        const Points points =
            ellipsoidPoints(20 + upTo(engine, 60), {1.0, between(engine, 0.3, 1.0), height}, seed);
        const Quickhull surface(points, seedOf(points));
        const FaceMerger merged(points, surface.triangles(), tolerance);
        std::set<std::int32_t> vertices;
        for (const Quickhull::Triangle& triangle : surface.triangles())
            vertices.insert(triangle.vertex.begin(), triangle.vertex.end());
        const std::set<std::int32_t> corners(merged.corners().begin(), merged.corners().end());
        left += static_cast<int>(corners.size());
        dropped += static_cast<int>(vertices.size() - corners.size());
        for (const std::int32_t vertex : vertices)
            worst = std::max(worst, distanceToPolygons(points, merged, points[vertex]) / tolerance);
    }
    // Four across an edge, and one from the plane.
    EXPECT_LE(worst, 5.0) << "seed " << kSeed;
    EXPECT_GT(left, 1000);
    EXPECT_GT(dropped, 1000);
}

TEST(ScaledNormal, HasTheSameBitsFromWhicheverCornerATriangleStarts)
{
    constexpr unsigned kSeed = 41;
    std::mt19937 engine(kSeed);
    int differing = 0;
    for (int i = 0; i < 1000; ++i)
    {
        // Two sides are longest, and often equally long when rounded; the products at either end of the third differ.
        const Eigen::Vector3d b = randomDirection(engine), c = randomDirection(engine);
        const Points points = {0.5 * (b + c) + 3.0 * (c - b).unitOrthogonal(), b, c};
        Quickhull::Triangle triangle = {{0, 1, 2}, {}};
        const Eigen::Vector3d first = scaledNormal(points, triangle);
        for (const std::array<std::int32_t, 3>& corners : {std::array<std::int32_t, 3>{1, 2, 0}, {2, 0, 1}})
        {
            triangle.vertex = corners;
            EXPECT_EQ(scaledNormal(points, triangle), first) << "seed " << kSeed << ", triangle " << i;
            differing +=
                scaledNormal(points[corners[0]], points[corners[1]], points[corners[2]]) != first ? 1 : 0;
        }
    }
    // Else no order would be seen in the bits.
    EXPECT_GT(differing, 100);
}
}  // namespace
}  // namespace cullet::test
