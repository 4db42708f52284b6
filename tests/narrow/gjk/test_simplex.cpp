// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/narrow/simplex_johnson.h"
#include "cullet/demos/bench/narrow/simplex_signed_volumes.h"
#include "cullet/narrow/math/simplex.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <utility>

namespace cullet::test
{
namespace
{
double lengthOf(const ClosestOnSimplex& c)
{
    return c.isInside ? 0.0 : c.point.norm();
}

double segmentDistance(const Eigen::Vector3d& from, const Eigen::Vector3d& to)
{
    return closestOnSimplex({from, to}, 2).point.norm();
}

/// Distance of the point of a triangle's plane that is closest to the origin, if it is in the triangle, else infinity.
/// It is a point of the triangle even where it is not quite the closest.
double faceDistance(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c)
{
    using Vector = Eigen::Matrix<long double, 3, 1>;
    const Vector p = a.cast<long double>(), u = b.cast<long double>() - p, v = c.cast<long double>() - p;
    const Vector along = u.normalized();
    const Vector height = v - v.dot(along) * along;
    const long double ofV = -p.dot(height) / height.squaredNorm();
    const long double ofU = -(p + ofV * v).dot(along) / u.norm();
    if (!(ofU >= 0 && ofV >= 0 && ofU + ofV <= 1))
        return std::numeric_limits<double>::infinity();
    return static_cast<double>((p + ofU * u + ofV * v).norm());
}

SimplexPoints randomSimplex(std::mt19937& engine, double shift)
{
    SimplexPoints points;
    const Eigen::Vector3d offset = shift * randomDirection(engine);
    for (Eigen::Vector3d& p : points)
        p = randomDirection(engine) + offset;
    return points;
}

void expectConsistent(const SimplexPoints& points, int count, const ClosestOnSimplex& c)
{
    if (c.isInside)
        return;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double total = 0.0;
    const std::array<double, 4> weights = simplexWeights(points, c.subset);
    for (int i = 0; i < 4; ++i)
    {
        EXPECT_GE(weights[i], 0.0);
        EXPECT_EQ(weights[i] > 0.0, (c.subset >> i & 1u) != 0) << "point " << i << " of " << count;
        total += weights[i];
        if (i < count)
            sum += weights[i] * points[i];
    }
    EXPECT_NEAR(total, 1.0, 1e-12);
    EXPECT_LT((sum - c.point).norm(), 1e-12 * (1.0 + points[0].norm()));
}

TEST(Simplex, AgreesWithJohnsonAndSignedVolumesInEveryRegion)
{
    std::map<std::pair<int, unsigned>, int> regions;
    for (unsigned seed = 0; seed < 20000; ++seed)
    {
        std::mt19937 engine(seed);
        const SimplexPoints points = randomSimplex(engine, 0.05 * (seed % 30));
        for (int count = 1; count <= 4; ++count)
        {
            SCOPED_TRACE(testing::Message() << "seed " << seed << " count " << count);
            const ClosestOnSimplex mine = closestOnSimplex(points, count);
            expectConsistent(points, count, mine);
            const double johnson = lengthOf(closestByJohnson(points, count));
            ASSERT_NEAR(lengthOf(mine), johnson, 1e-11);
            ASSERT_NEAR(lengthOf(mine), lengthOf(closestBySignedVolumes(points, count)), 1e-9);
            ++regions[{count, mine.isInside ? 15u : mine.subset}];
        }
    }
    // 1 + 3 + 7 + 15 regions, each of which occurs.
    EXPECT_EQ(regions.size(), 26u);
    for (const auto& [region, seen] : regions)
        EXPECT_GE(seen, 10) << region.first << " points, subset " << region.second;
}

TEST(Simplex, AgreesWithReducedSolverWhenNewestPointIsSupportPoint)
{
    // GJK on random tetrahedra and boxes: each step's last point is a support point against the closest one.
    std::map<int, int> countOf;
    std::map<unsigned, int> regions;  ///< of tetrahedra, by the subset that has the closest point
    for (unsigned seed = 0; seed < 20000; ++seed)
    {
        SCOPED_TRACE(seed);
        std::mt19937 engine(seed);
        Points cloud;
        const Eigen::Vector3d offset = 0.1 * (seed % 15) * randomDirection(engine);
        for (int i = 0; i < 12; ++i)
            cloud.push_back(randomDirection(engine) + offset);
        SimplexPoints points = {cloud[0]};
        int count = 1;
        Eigen::Vector3d v = cloud[0];
        for (int step = 0; step < 20; ++step)
        {
            const auto w =
                std::min_element(cloud.begin(), cloud.end(),
                                 [&v](const auto& l, const auto& r) { return v.dot(l) < v.dot(r); });
            if (v.squaredNorm() - v.dot(*w) <= 1e-12 * v.squaredNorm())
                break;
            points[count++] = *w;
            const ClosestOnSimplex reduced = closestOnSimplexNewest(points, count);
            const ClosestOnSimplex full = closestOnSimplex(points, count);
            ++countOf[count];
            if (count == 4 && !reduced.isInside)
                ++regions[reduced.subset];
            expectConsistent(points, count, reduced);
            ASSERT_EQ(reduced.isInside, full.isInside);
            ASSERT_NEAR(lengthOf(reduced), lengthOf(full), 1e-13);
            if (reduced.isInside)
                break;
            ASSERT_NE(reduced.subset >> (count - 1) & 1u, 0u) << "theorem 2: the newest point is needed";
            int kept = 0;
            for (int i = 0; i < count; ++i)
            {
                if ((reduced.subset >> i & 1u) != 0)
                    points[kept++] = points[i];
            }
            count = kept;
            v = reduced.point;
        }
    }
    for (int count = 2; count <= 4; ++count)
        EXPECT_GT(countOf[count], 5000);
    // Of the fourteen regions around a tetrahedron seven: the newest point, three edges and three faces. All others are
    // those without it, which the subsets above exclude. The point alone is never the closest of GJK's tetrahedra.
    EXPECT_GE(regions.size(), 6u);
    EXPECT_LE(regions.size(), 7u);
}

/// A case that rounding may create if the newest point is barely a support point: the origin is beyond only the face
/// without that point, and closest to the edge of it that the newest point's own regions exclude.
TEST(Simplex, FindsTheEdgeFarthestFromTheNewestPointWhenOnlyItsFaceIsLeft)
{
    const SimplexPoints points = {Eigen::Vector3d(-1, 1, 0), Eigen::Vector3d(1, 1, 0),
                                  Eigen::Vector3d(0, 2, 1), Eigen::Vector3d(0, 2, 0.5)};
    ASSERT_EQ(tetrahedronSides(points).outside, 1u << 3);
    const ClosestOnSimplex newest = closestOnSimplexNewest(points, 4);
    EXPECT_EQ(newest.subset, 0b0011u);
    EXPECT_EQ(newest.point, Eigen::Vector3d(0, 1, 0));
    EXPECT_EQ(closestOnSimplex(points, 4).subset, newest.subset);
}

TEST(Simplex, GivesSameAnswerAtEverySize)
{
    for (unsigned seed = 0; seed < 300; ++seed)
    {
        std::mt19937 engine(seed);
        const SimplexPoints points = randomSimplex(engine, 0.05 * (seed % 30));
        for (const double scale : {std::pow(2.0, -120), std::pow(2.0, 120)})
        {
            SimplexPoints scaled = points;
            for (Eigen::Vector3d& p : scaled)
                p *= scale;
            const ClosestOnSimplex one = closestOnSimplex(points, 4);
            const ClosestOnSimplex other = closestOnSimplex(scaled, 4);
            ASSERT_EQ(one.isInside, other.isInside);
            if (!one.isInside)
            {
                EXPECT_EQ(one.subset, other.subset);
            }
        }
    }
}

/// Equal points, collinear points, four coplanar points, slivers.
TEST(Simplex, GivesFiniteAnswersNoFartherThanAnyFeatureWhenDegenerate)
{
    int insideCount = 0;
    int faceCount = 0;
    for (unsigned seed = 0; seed < 20000; ++seed)
    {
        SCOPED_TRACE(seed);
        std::mt19937 engine(seed);
        SimplexPoints p = randomSimplex(engine, 0.1 * (seed % 20));
        const double thin = std::pow(10.0, -static_cast<double>(seed % 18));
        std::uniform_real_distribution<double> unit(-0.5, 1.5);
        // In the order in which GCC evaluates operands: from right to left.
        const auto nearLine = [&]() -> Eigen::Vector3d
        {
            const Eigen::Vector3d aside = thin * randomDirection(engine);
            return p[0] + unit(engine) * (p[1] - p[0]) + aside;
        };
        const auto nearPlane = [&]() -> Eigen::Vector3d
        {
            const Eigen::Vector3d aside = thin * randomDirection(engine);
            const double second = unit(engine), first = unit(engine);
            return p[0] + first * (p[1] - p[0]) + second * (p[2] - p[0]) + aside;
        };
        switch (seed % 4)
        {
            case 0:
                p[2] = p[0];
                break;
            case 1:
                p[2] = nearLine();
                break;
            case 2:
                p[3] = nearPlane();
                break;
            default:
                p[2] = nearLine();
                p[3] = nearLine();
                break;
        }
        for (int count = 2; count <= 4; ++count)
        {
            const ClosestOnSimplex c = closestOnSimplex(p, count);
            if (c.isInside)
            {
                ++insideCount;
                EXPECT_LT(lengthOf(closestByJohnson(p, count)), 1e-9);
                continue;
            }
            ASSERT_TRUE(c.point.allFinite());
            // The answer is at least as close as every vertex, edge and face, and no closer than the point of its
            // weights.
            for (int i = 0; i < count; ++i)
            {
                EXPECT_LE(c.point.norm(), p[i].norm() * (1.0 + 1e-12));
                for (int j = 0; j < i; ++j)
                {
                    EXPECT_LE(c.point.norm(), segmentDistance(p[i], p[j]) * (1.0 + 1e-12));
                    for (int k = 0; k < j; ++k)
                    {
                        const double distance = faceDistance(p[i], p[j], p[k]);
                        EXPECT_LE(c.point.norm(), distance * (1.0 + 1e-12));
                        faceCount += std::isfinite(distance);
                    }
                }
            }
            Eigen::Vector3d sum = Eigen::Vector3d::Zero();
            for (int i = 0; i < count; ++i)
                sum += simplexWeights(p, c.subset)[i] * p[i];
            EXPECT_NEAR(sum.norm(), c.point.norm(), 1e-9);
        }
    }
    EXPECT_GT(insideCount, 3);
    EXPECT_GT(faceCount, 1000);
}

/// Random needles are hardly ever under the origin, and the closest point of an edge would pass for that of the face.
TEST(Simplex, FindsClosestPointInsideThinTriangle)
{
    int edgeCount = 0;
    for (unsigned seed = 0; seed < 3000; ++seed)
    {
        SCOPED_TRACE(seed);
        std::mt19937 engine(seed);
        const double thin = std::pow(10.0, -static_cast<double>(seed % 7));
        SimplexPoints p = randomSimplex(engine, 0.0);
        p[2] = p[0] + 0.4 * (p[1] - p[0]) + thin * randomDirection(engine);
        // Moved to have the origin under its middle, nearer than its width.
        const Eigen::Vector3d cross = (p[1] - p[0]).cross(p[2] - p[0]);
        const Eigen::Vector3d middle = (p[0] + p[1] + p[2]) / 3.0, normal = cross.normalized();
        for (Eigen::Vector3d& point : p)
            point += 0.1 * cross.norm() * normal - middle;
        p[3] = 2.0 * normal;
        // The normal is off by a rounding of the corners, divided by the height over the longest edge.
        const double tolerance = 1e-15 * (1.0 + 1.0 / cross.norm());
        const double distance = faceDistance(p[0], p[1], p[2]);
        ASSERT_NEAR(distance, 0.1 * cross.norm(), tolerance);
        for (const int count : {3, 4})
        {
            const ClosestOnSimplex c = closestOnSimplex(p, count);
            EXPECT_FALSE(c.isInside);
            EXPECT_EQ(c.subset, 7u) << thin;
            EXPECT_NEAR(c.point.norm(), distance, tolerance) << thin;
        }
        edgeCount += segmentDistance(p[0], p[1]) > distance + 2.0 * tolerance;
    }
    EXPECT_GT(edgeCount, 2500) << "an edge is as near";
}

TEST(Simplex, HasNothingInsideTetrahedronAsThinAsRounding)
{
    // From two needles 2e-5 apart: its height is less than a unit in the last place of a coordinate.
    const SimplexPoints points = {
        Eigen::Vector3d(0.36600911276323678, 0.85936023105050063, -0.35711486563141426),
        {-2.2268271862250044, -0.20143099217166038, 0.033078642593781515},
        {-0.36604863149526445, -0.85935248355265481, 0.35711063358616935},
        {-0.36610532655040806, -0.8593459882153881, 0.35710652833988576}};
    SimplexPoints p = points;
    for (int i = 0; i < 24; ++i)
    {
        // Every order.
        std::swap(p[i % 3], p[i % 3 + 1]);
        const ClosestOnSimplex c = closestOnSimplex(p, 4);
        ASSERT_FALSE(c.isInside);
        EXPECT_NEAR(c.point.norm(), 2e-5, 1e-7);
    }
}

TEST(Simplex, HasZeroDistanceWhenOriginLiesOnFeature)
{
    const SimplexPoints onVertex = {Eigen::Vector3d(0, 0, 0), {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const SimplexPoints onEdge = {Eigen::Vector3d(-1, 0, 0), {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const SimplexPoints onFace = {Eigen::Vector3d(-1, -1, 0), {1, -1, 0}, {0, 1, 0}, {0, 0, 1}};
    for (const SimplexPoints& p : {onVertex, onEdge, onFace})
        EXPECT_EQ(lengthOf(closestOnSimplex(p, 4)), 0.0);
    EXPECT_EQ(closestOnSimplex(onVertex, 3).subset, 1u);
    EXPECT_EQ(closestOnSimplex(onEdge, 3).subset, 3u);
    EXPECT_EQ(closestOnSimplex(onFace, 3).subset, 7u);
}
}  // namespace
}  // namespace cullet::test
