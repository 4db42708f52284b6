// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/narrow/build/hull_builder.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <utility>
#include <vector>

namespace cullet::test
{
namespace
{
template <class S>
class Hulls : public testing::Test
{
};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Hulls, Scalars);

TEST(Orientation, IsExactWhereRoundedArithmeticIsNot)
{
    // Points on a plane through three points of doubles, and one step off it: only exact arithmetic distinguishes them.
    const Eigen::Vector3d a(0.1, 0.2, 0.3), b(1.1, 0.2, 0.3), c(0.1, 1.2, 0.3);
    const double next = std::nextafter(0.3, 1.0);
    EXPECT_EQ(orientation(a, b, c, {0.7, 0.9, 0.3}), 0);
    EXPECT_EQ(orientation(a, b, c, {0.7, 0.9, next}), 1);
    EXPECT_EQ(orientation(b, a, c, {0.7, 0.9, next}), -1);
    for (int i = -64; i <= 64; ++i)
    {
        // Points near the line x = y = z, with coordinates of full precision.
        const double t = 12.0 + i * std::pow(2.0, -48);
        const int sign = orientation({0.5, 0.5, 0.0}, {12.0, 12.0, 0.0}, {0.0, 0.0, 1.0}, {t, 12.0, 0.0});
        EXPECT_EQ(sign, (i > 0 ? 1 : 0) - (i < 0 ? 1 : 0)) << i;
    }
    EXPECT_TRUE(isCollinear({0.1, 0.1, 0.1}, {0.3, 0.3, 0.3}, {0.7, 0.7, 0.7}));
    EXPECT_FALSE(isCollinear({0.1, 0.1, 0.1}, {0.3, 0.3, 0.3}, {0.7, 0.7, std::nextafter(0.7, 1.0)}));
}

TYPED_TEST(Hulls, AreEmptyWithoutPoints)
{
    EXPECT_EQ(makeHull<TypeParam>(nullptr, 0).kind(), HullKind::Empty);
    EXPECT_EQ(makeHull<TypeParam>(nullptr, 0).vertexCount(), 0);
}

TYPED_TEST(Hulls, RefuseNonFiniteAndHugePoints)
{
    // Products of the last one would overflow in double.
    for (const double bad :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), -1e61})
    {
        Points points = icoPoints(0);
        points[7].y() = bad;
        EXPECT_EQ(hullOf<TypeParam>(points).kind(), HullKind::NotFinite);
        EXPECT_EQ(hullOf<TypeParam>(points).vertexCount(), 0);
    }
}

TYPED_TEST(Hulls, TreatCoordinatesWhoseProductsUnderflowAsZero)
{
    Points points = boxPoints(1.0, 1.0, 1.0);
    for (const double tiny : {1e-61, -1e-200, 5e-324})
        points.push_back({1.0, tiny, 2.0 * tiny});
    const Hull<TypeParam> hull = hullOf<TypeParam>(points);
    EXPECT_EQ(hull.kind(), HullKind::Solid);
    EXPECT_EQ(hull.vertexCount(), 9);
    EXPECT_EQ(hull.corners().vertexCount(), 8);
    EXPECT_EQ(hullOf<TypeParam>({{1e-61, 0, 0}, {0, 1e-70, 0}, {0, 0, 1e-80}}).kind(), HullKind::Point);
}

TYPED_TEST(Hulls, BecomePointWhenAllPointsAreEqual)
{
    const Hull<TypeParam> hull = hullOf<TypeParam>(Points(5, Eigen::Vector3d(1, 2, 3)));
    EXPECT_EQ(hull.kind(), HullKind::Point);
    EXPECT_EQ(hull.vertexCount(), 1);
    EXPECT_EQ(hull.sourceIndex(0), 0);
    EXPECT_FALSE(hull.hasNeighbours());
}

TYPED_TEST(Hulls, BecomeSegmentWhenPointsAreCollinear)
{
    Points points;
    for (int i = 0; i < 7; ++i)
        points.push_back(Eigen::Vector3d(0.25, 0.5, -0.125) * i);
    const Hull<TypeParam> hull = hullOf<TypeParam>(points);
    EXPECT_EQ(hull.kind(), HullKind::Segment);
    EXPECT_EQ(hull.vertexCount(), 7);
    EXPECT_EQ(supportVertex(hull, Eigen::Matrix<TypeParam, 3, 1>(1, 0, 0)), 6);
}

TYPED_TEST(Hulls, BecomePolygonWithTwoFacesWhenPointsAreCoplanar)
{
    Points points = {{0.5, 0.5, 2}, {0, 0, 2}, {1, 0, 2}, {0.5, 0, 2}, {1, 1, 2}, {0, 1, 2}};
    const Hull<TypeParam> hull = hullOf<TypeParam>(points);
    EXPECT_EQ(hull.kind(), HullKind::Polygon);
    EXPECT_EQ(hull.vertexCount(), 6);
    ASSERT_EQ(hull.faces().size(), 2u);
    EXPECT_EQ(hull.faces()[0].count, 4);
    EXPECT_EQ(hull.edges().size(), 4u);
    EXPECT_TRUE(hull.faces()[0].normal.isApprox(-hull.faces()[1].normal));
    EXPECT_NEAR(std::abs(hull.faces()[0].normal.z()), 1.0, 1e-12);
    EXPECT_EQ(hull.facesOf(0).size(), 0);
    EXPECT_EQ(hull.facesOf(1).size(), 2);
}

TEST(Orientation, GivesAccurateNormalsOfNeedles)
{
    const double step = std::pow(2.0, -52);
    // The last corner is off the line by one step. Rounded, the differences lose it.
    const Eigen::Vector3d a(1.0, 1.0, 0.25), b(-2.0 / 3.0, -2.0 / 3.0, 0.25);
    const Eigen::Vector3d normal = accurateCross(a, b, {1.0 / 3.0, 1.0 / 3.0 + step / 4.0, 0.25});
    EXPECT_EQ(normal, Eigen::Vector3d(0.0, 0.0, -(1.0 + 2.0 / 3.0) * step / 4.0));
    EXPECT_EQ(accurateCross(a, b, {1.0 / 3.0, 1.0 / 3.0, 0.25}), Eigen::Vector3d(0.0, 0.0, 0.0));
}

TYPED_TEST(Hulls, HaveUnitNormalsWhenPolygonIsNearlyCollinear)
{
    using Vector = Eigen::Matrix<TypeParam, 3, 1>;
    std::mt19937 engine(9);
    int polygonCount = 0;
    for (int i = 0; i < 2000; ++i)
    {
        // Three points of a line, rounded.
        const Eigen::Vector3d from = randomDirection(engine), along = randomDirection(engine);
        std::vector<Vector> points;
        for (const double t : {0.0, 1.0, 0.3})
            points.push_back((from + t * along).template cast<TypeParam>());
        const Hull<TypeParam> hull = makeHull(points);
        if (hull.kind() != HullKind::Polygon)
            continue;
        ++polygonCount;
        for (const auto& face : hull.faces())
        {
            ASSERT_EQ(face.count, 3);
            ASSERT_NEAR(face.normal.norm(), 1.0, 1e-12);
            for (const Vector& p : points)
                ASSERT_NEAR(face.normal.dot(p.template cast<double>()), face.offset, 1e-13);
        }
    }
    EXPECT_GT(polygonCount, 1000);
}

TYPED_TEST(Hulls, HaveSixRectanglesForTurnedBox)
{
    std::mt19937 engine(3);
    for (int turn = 0; turn < 20; ++turn)
    {
        const Hull<TypeParam> hull =
            hullOf<TypeParam>(moved(boxPoints(0.7, 0.5, 0.6), randomRotation(engine), {3, 1, 2}));
        ASSERT_EQ(hull.kind(), HullKind::Solid);
        EXPECT_EQ(hull.vertexCount(), 8);
        ASSERT_EQ(hull.faces().size(), 6u);
        EXPECT_EQ(hull.edges().size(), 12u);
        for (int face = 0; face < 6; ++face)
            EXPECT_EQ(hull.faceVertices(face).size(), 4);
        for (int v = 0; v < 8; ++v)
            EXPECT_EQ(hull.facesOf(v).size(), 3);
    }
}

TYPED_TEST(Hulls, MergeGridBoxIntoSixFaces)
{
    const Hull<TypeParam> hull = hullOf<TypeParam>(gridBoxPoints(5));
    EXPECT_EQ(hull.vertexCount(), 98);
    ASSERT_EQ(hull.faces().size(), 6u);
    EXPECT_EQ(hull.edges().size(), 12u);
}

TYPED_TEST(Hulls, HaveOnlyExtremePointsAsCorners)
{
    // The last shape has a corner over the middle of each face of the grid.
    Points star = gridBoxPoints(5);
    for (const Eigen::Vector3d axis :
         {Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ()})
        star.insert(star.end(), {1.25 * axis, -1.25 * axis});
    const Points plate = {{0.5, 0.5, 2}, {0, 0, 2}, {1, 0, 2}, {0.5, 0, 2}, {1, 1, 2}, {0, 1, 2}};
    const std::vector<std::pair<Points, int>> shapes = {{withDuplicatesAndInterior(gridBoxPoints(5), 5), 8},
                                                        {plate, 4},
                                                        {icoPoints(1), 42},
                                                        {withDuplicatesAndInterior(star, 6), 14}};
    for (const auto& [points, cornerCount] : shapes)
    {
        SCOPED_TRACE(points.size());
        const Hull<TypeParam> hull = hullOf<TypeParam>(points);
        const Hull<TypeParam>& corners = hull.corners();
        EXPECT_EQ(corners.vertexCount(), cornerCount);
        EXPECT_EQ(&corners.corners(), &corners);
        EXPECT_EQ(corners.kind(), hull.kind());
        EXPECT_EQ(corners.faces().size(), hull.faces().size());
        std::set<int> sources;
        for (int v = 0; v < hull.vertexCount(); ++v)
            sources.insert(hull.sourceIndex(v));
        for (int v = 0; v < corners.vertexCount(); ++v)
        {
            EXPECT_EQ(sources.count(corners.sourceIndex(v)), 1u);
            EXPECT_GE(corners.facesOf(v).size(), 2);
        }
        std::mt19937 engine(7);
        for (int i = 0; i < 1000; ++i)
        {
            const auto d = randomDirection(engine).template cast<TypeParam>().eval();
            const TypeParam ofAll = supportProduct(hull, supportVertex(hull, d), d);
            const TypeParam ofCorners = supportProduct(corners, supportVertex(corners, d), d);
            ASSERT_LE(ofCorners, ofAll);
            ASSERT_GE(ofCorners, ofAll - TypeParam(4) * std::numeric_limits<TypeParam>::epsilon());
        }
    }
}

TYPED_TEST(Hulls, DropDuplicatesAndInteriorPointsAndKeepOrder)
{
    const Points points = withDuplicatesAndInterior(icoPoints(1), 5);
    const Hull<TypeParam> hull = hullOf<TypeParam>(points);
    EXPECT_EQ(hull.vertexCount(), 42);
    for (int v = 1; v < hull.vertexCount(); ++v)
        EXPECT_LT(hull.sourceIndex(v - 1), hull.sourceIndex(v));
    for (int v = 0; v < hull.vertexCount(); ++v)
        EXPECT_EQ(hull.vertex(v), points[hull.sourceIndex(v)].template cast<TypeParam>());
}

TYPED_TEST(Hulls, EncloseAllPointsWithFacesThatSatisfyEuler)
{
    for (const NamedPoints& shape : nastyShapes())
    {
        SCOPED_TRACE(shape.name);
        const auto points = castPoints<TypeParam>(shape.points);
        const Hull<TypeParam> hull = makeHull(points);
        ASSERT_EQ(hull.kind(), HullKind::Solid);
        // 16 for the merging; the normal of a needle's face is off by a thousand roundings.
        const double tolerance =
            (20.0 * std::numeric_limits<TypeParam>::epsilon() + (shape.isThin ? 1e-13 : 0.0)) * hull.radius();
        std::set<int> corners;
        for (std::size_t face = 0; face < hull.faces().size(); ++face)
        {
            const auto& plane = hull.faces()[face];
            EXPECT_NEAR(plane.normal.norm(), 1.0, 1e-12);
            for (const auto& p : points)
                ASSERT_LE(plane.normal.dot(p.template cast<double>()), plane.offset + tolerance);
            for (const int v : hull.faceVertices(static_cast<int>(face)))
            {
                corners.insert(v);
                EXPECT_NEAR(plane.normal.dot(hull.vertex(v).template cast<double>()), plane.offset,
                            2.0 * tolerance);
            }
        }
        EXPECT_EQ(corners.size() + hull.faces().size(), hull.edges().size() + 2);
    }
}

TYPED_TEST(Hulls, GiveVerticesNonCoplanarNeighboursAndMatchingBlocks)
{
    for (const NamedPoints& shape : nastyShapes())
    {
        SCOPED_TRACE(shape.name);
        const Hull<TypeParam> hull = hullOf<TypeParam>(shape.points);
        int artificialCount = 0;
        for (int v = 0; v < hull.vertexCount(); ++v)
        {
            std::set<int> fromLists, fromBlocks;
            for (const int u : hull.neighbours(v))
                fromLists.insert(u);
            for (int index = v; index >= 0; index = hull.block(index).id[0])
            {
                const auto& block = hull.block(index);
                EXPECT_EQ(block.y[0], hull.vertex(v).y());
                for (int lane = 1; lane < 8; ++lane)
                {
                    fromBlocks.insert(block.id[lane]);
                    EXPECT_EQ(block.x[lane], hull.vertex(block.id[lane]).x());
                    EXPECT_EQ(block.z[lane], hull.vertex(block.id[lane]).z());
                }
            }
            EXPECT_EQ(fromLists, fromBlocks);
            EXPECT_EQ(fromLists.count(v), 0u);
            EXPECT_GE(hull.naturalNeighbours(v).size(), 3);
            artificialCount += hull.neighbours(v).size() - hull.naturalNeighbours(v).size();
            // The vertex and its neighbours are not coplanar: otherwise a climb could get stuck in the plane.
            double height = 0.0;
            const Eigen::Vector3d at = hull.vertex(v).template cast<double>();
            for (const int i : hull.neighbours(v))
            {
                for (const int j : hull.neighbours(v))
                {
                    const Eigen::Vector3d normal = (hull.vertex(i).template cast<double>() - at)
                                                       .cross(hull.vertex(j).template cast<double>() - at);
                    for (const int k : hull.neighbours(v))
                        height = std::max(height, normal.dot(hull.vertex(k).template cast<double>() - at));
                }
            }
            EXPECT_GT(height, 0.0);
        }
        EXPECT_GT(artificialCount + (hull.vertexCount() <= 8 ? 1 : 0), 0);
    }
}

TYPED_TEST(Hulls, AreEqualForEqualPoints)
{
    const Points points = ellipsoidPoints(200, {1.0, 0.7, 0.5}, 8);
    const Hull<TypeParam> first = hullOf<TypeParam>(points);
    const Hull<TypeParam> second = hullOf<TypeParam>(points);
    ASSERT_EQ(first.vertexCount(), second.vertexCount());
    EXPECT_EQ(first.startTable(), second.startTable());
    for (int v = 0; v < first.vertexCount(); ++v)
        EXPECT_TRUE(
            std::equal(first.neighbours(v).begin(), first.neighbours(v).end(), second.neighbours(v).begin()));
}

TYPED_TEST(Hulls, EncloseRandomClustersOnCoarseGrids)
{
    int solidCount = 0;
    int otherCount = 0;
    for (unsigned seed = 0; seed < 400; ++seed)
    {
        SCOPED_TRACE(seed);
        std::mt19937 engine(seed);
        std::uniform_int_distribution<int> coordinate(0, 1 + static_cast<int>(seed % 4));
        Points points;
        for (int i = 0; i < 4 + static_cast<int>(seed % 37); ++i)
            points.push_back(drawVector(coordinate, engine) * 0.1);
        const Hull<TypeParam> hull = hullOf<TypeParam>(points);
        if (hull.kind() != HullKind::Solid)
        {
            ++otherCount;
            continue;
        }
        ++solidCount;
        for (const auto& face : hull.faces())
        {
            EXPECT_GE(face.count, 3);
            for (const auto& p : castPoints<TypeParam>(points))
                ASSERT_LE(face.normal.dot(p.template cast<double>()),
                          face.offset + 20.0 * std::numeric_limits<TypeParam>::epsilon());
        }
    }
    EXPECT_GT(solidCount, 200);
    EXPECT_GT(otherCount, 5);
}

/// Points along the edges of a cube, `n` on each.
Points edgePoints(int n)
{
    Points points;
    for (const Eigen::Vector3d& p : gridBoxPoints(n))
    {
        if ((p.array().abs() > 0.999 * p.array().abs().maxCoeff()).count() >= 2)
            points.push_back(p);
    }
    return points;
}

/// Points near a line, so thin that most are within rounding of all triangles.
Points linePoints(int n, double thickness)
{
    std::mt19937 engine(5);
    std::uniform_real_distribution<double> along(-1.0, 1.0);
    std::normal_distribution<double> beside(0.0, thickness);
    Points points;
    for (int i = 0; i < n; ++i)
    {
        const double z = beside(engine), y = beside(engine), x = along(engine);
        points.emplace_back(x, y, z);
    }
    return points;
}

TYPED_TEST(Hulls, HaveFewNeighboursPerVertexOnCrowdedFacesAndEdges)
{
    std::mt19937 engine(3);
    for (const Points& points :
         {gridBoxPoints(17), moved(gridBoxPoints(14), randomRotation(engine), {0.0, 0.0, 0.0}),
          edgePoints(60), linePoints(300, 0.1 * std::numeric_limits<TypeParam>::epsilon())})
    {
        SCOPED_TRACE(points.size());
        const Hull<TypeParam> hull = hullOf<TypeParam>(points);
        ASSERT_GT(hull.vertexCount(), 100);
        std::int64_t neighbours = 0;
        for (std::int32_t v = 0; v < hull.vertexCount(); ++v)
            neighbours += hull.naturalNeighbours(v).size();
        // Corners of a piece in each of two triangles, at most four pieces; and the reverse neighbours.
        EXPECT_LE(neighbours, 2 * 12 * hull.vertexCount());
        std::uniform_real_distribution<double> side(-1.0, 1.0);
        for (int i = 0; i < 600; ++i)
        {
            Eigen::Vector3d d = drawVector(side, engine);
            if (i < 6)
                d = Eigen::Vector3d::Unit(i / 2) * (i % 2 == 0 ? 1.0 : -1.0);
            const Eigen::Matrix<TypeParam, 3, 1> way = d.cast<TypeParam>();
            ASSERT_EQ(supportClimbArtificial(hull, way, 0).vertex, supportLinear(hull, way)) << i;
        }
    }
}
}  // namespace
}  // namespace cullet::test
