// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/narrow/build/cloud_builder.h"
#include "cullet/narrow/build/hull_builder.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

/// Hulls of very many points, measured by comparisons of points with planes, triangles and boxes instead of time.
namespace cullet::test
{
namespace
{
constexpr int kCount = 40000;

/// Coordinates rounded to float, like those of shapes.
Points asFloats(const Points& points)
{
    Points rounded;
    for (const Eigen::Vector3d& p : points)
        rounded.push_back(p.cast<float>().cast<double>());
    return rounded;
}

Points solidBall(unsigned seed)
{
    Points points = ellipsoidPoints(kCount, {1.0, 1.0, 1.0}, seed);
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> part(0.0, 1.0);
    for (Eigen::Vector3d& p : points)
        p *= std::cbrt(part(engine));
    return points;
}

/// The surface of a cube with rounded edges: a third of the points lies on its six faces.
Points roundedCube(unsigned seed)
{
    Points points = ellipsoidPoints(kCount, {1.0, 1.0, 1.0}, seed);
    for (Eigen::Vector3d& p : points)
    {
        const Eigen::Vector3d core = (p / p.cwiseAbs().maxCoeff()).cwiseMax(-0.75).cwiseMin(0.75);
        const Eigen::Vector3d outward = p / p.cwiseAbs().maxCoeff() - core;
        p = core + outward * (0.25 / outward.norm());
    }
    return points;
}

/// Points on the sides of a box.
Points boxSides(unsigned seed)
{
    Points points = solidBall(seed);
    for (std::size_t i = 0; i < points.size(); ++i)
        points[i][i % 3] = i % 2 == 0 ? 1.0 : -1.0;
    return points;
}

/// Points on a rounded cube. Rounded to float, a few of them are below the surface of the others.
Points nearlyConvexPoints(unsigned seed)
{
    Points points = roundedCube(seed);
    points.resize(3000);
    // A third of the points in one octant, where they are denser.
    for (std::size_t i = 0; i < 1000; ++i)
        points[i] = points[i].cwiseAbs();
    return asFloats(points);
}

std::vector<std::pair<std::string, Points>> crowds(unsigned seed)
{
    Points twice = ellipsoidPoints(kCount / 2, {1.0, 1.0, 1.0}, seed);
    for (int i = 0; i < kCount / 2; ++i)
        twice.push_back(twice[static_cast<std::size_t>(i)] * (1.0 - 1e-7));
    std::mt19937 engine(seed);
    return {{"solid ball", solidBall(seed)},
            {"sphere", ellipsoidPoints(kCount, {1.0, 1.0, 1.0}, seed)},
            {"rounded cube", roundedCube(seed)},
            {"box sides", boxSides(seed)},
            {"turned box sides", moved(boxSides(seed), randomRotation(engine), {0.0, 0.0, 0.0})},
            {"two spheres within rounding", twice}};
}

TEST(HullCost, ComparesEachPointWithFewTrianglesWhenThereAreMany)
{
    constexpr unsigned kSeed = 71;
    for (const auto& [name, points] : crowds(kSeed))
    {
        SCOPED_TRACE(name + ", seed " + std::to_string(kSeed));
        const Points rounded = asFloats(points);
        const Quickhull surface(rounded, seedOf(rounded));
        const SurfacePoints extra(rounded, surface, 16.0 * std::numeric_limits<float>::epsilon());
        // 15 levels, in each of which a few facets are visible from a point.
        EXPECT_LT(surface.testCount(), std::uint64_t(150) * kCount);
        EXPECT_LT(extra.testCount(), std::uint64_t(200) * kCount);
        EXPECT_GT(surface.testCount(), std::uint64_t(kCount));
    }
}

/// Corners of a tetrahedron, and points on one of its faces from left to right.
Points sweptTriangle(int count, unsigned seed)
{
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> part(0.0, 1.0);
    std::vector<double> places;
    for (int i = 0; i < count; ++i)
        places.push_back(part(engine));
    std::sort(places.begin(), places.end());
    Points points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (const double x : places)
        points.push_back({x, (1.0 - x) * part(engine), 0.0});
    return points;
}

TEST(SurfacePoints, SplitTrianglesEvenlyThoughPointsComeFromLeftToRight)
{
    constexpr unsigned kSeed = 72;
    const Points points = sweptTriangle(5000, kSeed);
    const SurfacePoints extra(points, Quickhull(points, seedOf(points)), 1e-12);
    EXPECT_EQ(extra.attached().size(), 5000u);
    // 33 for a point with points in random order, 42 from left to right.
    EXPECT_LT(extra.testCount(), 37u * 5000) << "seed " << kSeed;
}

TEST(SurfacePoints, HaveDistinctCorners)
{
    const Points points = gridBoxPoints(7);
    const SurfacePoints extra(points, Quickhull(points, seedOf(points)), 1e-12);
    int onEdges = 0;
    for (const SurfacePoints::Attached& attached : extra.attached())
    {
        std::vector<std::int32_t> corners = attached.corners;
        onEdges += corners.size() > 3;
        std::sort(corners.begin(), corners.end());
        EXPECT_EQ(std::adjacent_find(corners.begin(), corners.end()), corners.end()) << attached.point;
        EXPECT_FALSE(std::binary_search(corners.begin(), corners.end(), attached.point));
    }
    EXPECT_GT(extra.attached().size(), 100u);
    EXPECT_GT(onEdges, 20);
}

template <class S>
void expectCornersOnly(const Points& points)
{
    const std::vector<Eigen::Matrix<S, 3, 1>> given = castPoints<S>(points);
    const Hull<S> whole = makeHull(given), corners = makeCornerHull(given);
    ASSERT_EQ(corners.kind(), whole.kind());
    ASSERT_EQ(corners.vertexCount(), whole.corners().vertexCount());
    EXPECT_EQ(corners.hasNeighbours(), whole.hasNeighbours());
    EXPECT_EQ(corners.startTable(), whole.corners().startTable());
    for (std::int32_t v = 0; v < corners.vertexCount(); ++v)
    {
        EXPECT_EQ(corners.sourceIndex(v), whole.corners().sourceIndex(v));
        if (!corners.hasNeighbours())
            continue;
        const auto mine = corners.neighbours(v), others = whole.corners().neighbours(v);
        EXPECT_EQ(std::vector<int>(mine.begin(), mine.end()), std::vector<int>(others.begin(), others.end()));
    }
    ASSERT_EQ(corners.faces().size(), whole.corners().faces().size());
    for (std::size_t face = 0; face < corners.faces().size(); ++face)
        EXPECT_EQ(corners.faces()[face].normal, whole.corners().faces()[face].normal);
}

TEST(CornerHull, EqualsCornersOfWholeHull)
{
    Points line;
    for (int i = 0; i < 7; ++i)
        line.push_back(Eigen::Vector3d(0.25, 0.5, -0.125) * i);
    std::vector<Points> sets = {{},
                                line,
                                {{1, 2, 3}},
                                gridBoxPoints(5),
                                figure9Points(),
                                icoPoints(2),
                                withDuplicatesAndInterior(gridBoxPoints(6), 5),
                                withDuplicatesAndInterior(ellipsoidPoints(300, {1.0, 0.7, 0.5}, 8), 6),
                                {{0.5, 0.5, 2}, {0, 0, 2}, {1, 0, 2}, {0.5, 0, 2}, {1, 1, 2}, {0, 1, 2}}};
    for (const NamedPoints& shape : nastyShapes())
        sets.push_back(shape.points);
    for (const Points& points : sets)
    {
        SCOPED_TRACE(points.size());
        expectCornersOnly<float>(points);
        expectCornersOnly<double>(points);
    }
}

/// Points left over within the tolerance of points that become vertices; none of them was a vertex for a while.
TEST(CornerHull, EqualsCornersOfWholeHullWhereFewPointsAreLeftOver)
{
    int neverInserted = 0;
    for (unsigned seed = 1; seed <= 12; ++seed)
    {
        SCOPED_TRACE(seed);
        const Points points = nearlyConvexPoints(seed);
        const Quickhull surface(points, seedOf(points));
        const bool hasNear =
            SurfacePoints::hasAny(points, surface, 16.0 * double(std::numeric_limits<float>::epsilon()));
        neverInserted += hasNear && !surface.hasReplacedVertices() ? 1 : 0;
        expectCornersOnly<float>(points);
    }
    EXPECT_GT(neverInserted, 0);
}

template <class S>
void expectScans(const Points& points)
{
    const std::vector<Eigen::Matrix<S, 3, 1>> given = castPoints<S>(points);
    const Hull<S> cloud = makeCloud(given);
    const Hull<S> corners = makeCornerHull(given);
    ASSERT_EQ(cloud.kind(), HullKind::Cloud);
    EXPECT_EQ(cloud.vertexCount(), static_cast<std::int32_t>(points.size()));
    EXPECT_EQ(cloud.reach(), corners.reach());
    EXPECT_FALSE(cloud.hasNeighbours());
    EXPECT_TRUE(cloud.faces().empty());
    std::mt19937 engine(7);
    for (int i = 0; i < 300; ++i)
    {
        const auto d = randomDirection(engine).template cast<S>().eval();
        const S ofCloud = supportProduct(cloud, supportVertex(cloud, d), d);
        const S ofCorners = supportProduct(corners, supportVertex(corners, d), d);
        ASSERT_LE(ofCorners, ofCloud);
        ASSERT_GE(ofCorners, ofCloud - S(4) * std::numeric_limits<S>::epsilon() * cloud.reach());
    }
}

TEST(CloudHull, GivesSameSupportsAsCornerHull)
{
    for (const Points& points : {withDuplicatesAndInterior(gridBoxPoints(6), 5), icoPoints(2),
                                 withDuplicatesAndInterior(ellipsoidPoints(300, {1.0, 0.7, 0.5}, 8), 6)})
    {
        SCOPED_TRACE(points.size());
        expectScans<float>(points);
        expectScans<double>(points);
    }
    EXPECT_EQ(makeCloud(std::vector<Eigen::Vector3d>()).kind(), HullKind::Empty);
    const double infinity = std::numeric_limits<double>::infinity();
    const Hull<double> broken = makeCloud<double>({{0, 0, 0}, {infinity, 0, 0}});
    EXPECT_EQ(broken.kind(), HullKind::NotFinite);
    EXPECT_EQ(broken.vertexCount(), 0);
}

/// An empty hull has no address.
template <class S>
bool haveSameBytes(const S* a, const S* b, std::int32_t count)
{
    return count == 0 || std::memcmp(a, b, sizeof(S) * static_cast<std::size_t>(count)) == 0;
}

template <class S>
void expectEqualClouds(const Hull<S>& cloud, const Hull<S>& fresh)
{
    ASSERT_EQ(cloud.kind(), fresh.kind());
    ASSERT_EQ(cloud.vertexCount(), fresh.vertexCount());
    ASSERT_EQ(cloud.paddedCount(), fresh.paddedCount());
    EXPECT_TRUE(haveSameBytes(cloud.x(), fresh.x(), fresh.paddedCount()));
    EXPECT_TRUE(haveSameBytes(cloud.y(), fresh.y(), fresh.paddedCount()));
    EXPECT_TRUE(haveSameBytes(cloud.z(), fresh.z(), fresh.paddedCount()));
    for (std::int32_t i = 0; i < fresh.vertexCount(); ++i)
    {
        EXPECT_EQ(std::memcmp(cloud.lanes(i), fresh.lanes(i), 4 * sizeof(S)), 0);
        EXPECT_EQ(cloud.sourceIndex(i), i);
    }
    EXPECT_EQ(cloud.centre(), fresh.centre());
    EXPECT_EQ(cloud.radius(), fresh.radius());
    EXPECT_EQ(cloud.reach(), fresh.reach());
    EXPECT_EQ(cloud.isCentred(), fresh.isCentred());
    EXPECT_EQ(std::memcmp(cloud.centreLanes(), fresh.centreLanes(), 4 * sizeof(S)), 0);
}

/// Quads of points on a ball around (0.1, 0, 0), with some zeros of either sign, and numbers that are not used.
template <class S>
std::vector<S> ballQuads(int count, std::mt19937& engine)
{
    std::vector<S> quads;
    for (int i = 0; i < count; ++i)
    {
        const Eigen::Vector3d p = randomDirection(engine);
        quads.insert(quads.end(), {S(p[0] + 0.1), i % 5 == 0 ? S(-0.0) : S(p[1]), S(p[2]),
                                   std::numeric_limits<S>::quiet_NaN()});
    }
    return quads;
}

template <class S>
void expectRefills()
{
    constexpr unsigned kSeed = 31;
    SCOPED_TRACE(kSeed);
    std::mt19937 engine(kSeed);
    Hull<S> cloud;
    for (const int count : {40, 40, 7, 100, 0, 33, 1})
    {
        SCOPED_TRACE(count);
        std::vector<S> quads = ballQuads<S>(count, engine);
        Hull<S> fresh;
        CloudBuilder<S>::refill(fresh, quads.data(), count);
        CloudBuilder<S>::refill(cloud, quads.data(), count);
        expectEqualClouds(cloud, fresh);
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        double radius = 0.0;
        for (std::int32_t i = 0; i < cloud.vertexCount(); ++i)
        {
            const S* const quad = &quads[4 * static_cast<std::size_t>(i)];
            EXPECT_EQ(cloud.vertex(i), (Eigen::Matrix<S, 3, 1>(quad[0], quad[1], quad[2])));
            EXPECT_FALSE(std::signbit(cloud.y()[i]) && quad[1] == 0);
            sum += cloud.vertex(i).template cast<double>();
            radius = std::max(radius, cloud.vertex(i).template cast<double>().norm());
        }
        EXPECT_EQ(cloud.radius(), radius);
        if (count == 0)
            continue;
        EXPECT_EQ(cloud.centre(), Eigen::Vector3d(sum / count));
        quads[4 * static_cast<std::size_t>(count / 2) + 2] = std::numeric_limits<S>::infinity();
        CloudBuilder<S>::refill(cloud, quads.data(), count);
        EXPECT_EQ(cloud.kind(), HullKind::NotFinite);
        EXPECT_EQ(cloud.vertexCount(), 0);
    }
}

template <class S>
HullKind kindWith(S coordinate, int count, int place)
{
    std::vector<S> quads(4 * static_cast<std::size_t>(count), S(1));
    quads[static_cast<std::size_t>(place)] = coordinate;
    Hull<S> cloud;
    CloudBuilder<S>::refill(cloud, quads.data(), count);
    return cloud.kind();
}

template <class S>
void expectRange(S largest, S beyond)
{
    for (int count = 1; count < 12; ++count)
    {
        for (int place = 0; place < 4 * count; ++place)
        {
            SCOPED_TRACE(place);
            const HullKind refused = place % 4 == 3 ? HullKind::Cloud : HullKind::NotFinite;
            EXPECT_EQ(kindWith<S>(largest, count, place), HullKind::Cloud);
            EXPECT_EQ(kindWith<S>(-largest, count, place), HullKind::Cloud);
            EXPECT_EQ(kindWith<S>(beyond, count, place), refused);
            EXPECT_EQ(kindWith<S>(-beyond, count, place), refused);
            EXPECT_EQ(kindWith<S>(std::numeric_limits<S>::quiet_NaN(), count, place), refused);
        }
    }
}

TEST(CloudHull, RefusesCoordinatesBeyondTheRangeAtEachPlace)
{
    expectRange<float>(std::numeric_limits<float>::max(), std::numeric_limits<float>::infinity());
    expectRange<double>(1e60, 1.0000001e60);
}

TEST(CloudHull, ReadsCoordinatesBelowTheRangeAsZero)
{
    const std::vector<double> quads = {9e-61, -9e-61, 1e-60, 7, -1e-60, -0.0, 2.0, 7, 1.0, 1.0, -5e-324, 7};
    const double expected[] = {0.0, 0.0, 1e-60, -1e-60, 0.0, 2.0, 1.0, 1.0, 0.0};
    Hull<double> cloud;
    CloudBuilder<double>::refill(cloud, quads.data(), 3);
    ASSERT_EQ(cloud.vertexCount(), 3);
    for (std::int32_t i = 0; i < 3; ++i)
    {
        const double xyz[] = {cloud.x()[i], cloud.y()[i], cloud.z()[i]};
        EXPECT_EQ(std::memcmp(xyz, expected + 3 * i, sizeof(xyz)), 0) << i;
        EXPECT_EQ(std::memcmp(cloud.lanes(i), xyz, sizeof(xyz)), 0) << i;
        EXPECT_EQ(cloud.lanes(i)[3], 0.0);
    }
}

TEST(CloudHull, HasTheBitsOfItsPointsWhenItsMemoryIsRefilled)
{
    expectRefills<float>();
    expectRefills<double>();
}
}  // namespace
}  // namespace cullet::test
