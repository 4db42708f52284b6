// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/distance_oracle.h"
#include "cullet/demos/scenes/hulls/hull_pairs.h"
#include "cullet/narrow/gjk/corner_cone.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/tests/narrow/any_pair.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <random>
#include <string>
#include <vector>

/// Distances by the cone of a corner: with any cache, the answer is the closest point or none.
namespace cullet::test
{
namespace
{
template <class S>
class CornerCones : public testing::Test
{
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(CornerCones, Scalars, );

/// Counts by the feature of the closest point.
struct Tally
{
    int corners = 0, edges = 0, triangles = 0, parallelograms = 0, unknown = 0;
};

template <class S>
bool isTriangle(const GjkCache<S>& cache)
{
    return (cache.verticesA[1] == cache.verticesA[0]) == (cache.verticesA[2] == cache.verticesA[0]);
}

template <class S>
void count(const GjkCache<S>& cache, Tally& tally)
{
    if (cache.count == 1)
        ++tally.corners;
    else if (cache.count == 2)
        ++tally.edges;
    else
        ++(isTriangle(cache) ? tally.triangles : tally.parallelograms);
}

/// Tolerance of the answer, for shapes of size 1.
template <class S>
constexpr double kAccuracy = sizeof(S) == sizeof(float) ? 2e-7 : 1e-13;

/// Compares with the bounds of the oracle; the axis has to prove the distance, and the points must be that far apart.
template <class S>
void expectClosest(const PosedHull<S>& a, const PosedHull<S>& b, const GjkResult<S>& result)
{
    const DistanceOracle oracle(a, b);
    const Bounds truth = oracle.solve();
    ASSERT_EQ(result.state, GjkState::Near);
    ASSERT_NEAR(double(result.distance), double(truth.upper), kAccuracy<S>);
    const long double proved = -oracle.extent(-result.axis.template cast<long double>());
    // Tolerance for the rounding of the axis, times the size.
    ASSERT_GT(double(proved), double(truth.lower) - (sizeof(S) == sizeof(float) ? 1e-6 : 1e-12));
    const S rounding = std::numeric_limits<S>::epsilon() * S(8);
    ASSERT_LT((result.pointA - result.pointB - result.axis * result.distance).norm(), rounding);
}

/// Random vertices that do not face away from the other shape; the later pairs share a vertex with the first, or not.
template <class S>
GjkCache<S> anyCorner(const PosedHull<S>& a, const PosedHull<S>& b, std::mt19937& engine)
{
    const Eigen::Vector3d way = (a.origin() - b.origin()).stableNormalized();
    const auto anyVertices = [&]
    {
        const Eigen::Vector3d direction =
            way.allFinite() ? way + 0.9 * randomDirection(engine) : randomDirection(engine);
        return PosedHull<S>::supportVertices(a, b, direction.template cast<S>(), {-1, -1});
    };
    GjkCache<S> cache;
    cache.state = GjkState::Separated;
    cache.count = static_cast<std::uint8_t>(1 + engine() % 3);
    const bool isCommon = engine() % 4 != 0;
    for (std::size_t i = 0; i < cache.count; ++i)
    {
        const VertexPair v = anyVertices();
        const bool isOfA = engine() % 2 == 0, isFirst = i == 0 || !isCommon;
        cache.verticesA[i] = isFirst || isOfA ? static_cast<std::uint16_t>(v.a) : cache.verticesA[0];
        cache.verticesB[i] = isFirst || !isOfA ? static_cast<std::uint16_t>(v.b) : cache.verticesB[0];
    }
    return cache;
}

TYPED_TEST(CornerCones, AnswerRightFromAnyVerticesOrNotAtAll)
{
    using S = TypeParam;
    std::vector<Hull<S>> hulls;
    for (const NamedPoints& shape : queryShapes())
    {
        if (!shape.isThin)
            hulls.push_back(hullOf<S>(shape.points));
    }
    std::mt19937 engine(41);
    Tally tally;
    for (int i = 0; i < 6000; ++i)
    {
        SCOPED_TRACE(i);
        const double gaps[] = {1.0, 0.3, 0.05, 1e-3};
        const PairScene<S> scene = anyPair(hulls, gaps[engine() % std::size(gaps)], 0.0, engine);
        const PosedHull<S> a = scene.posedA(), b = scene.posedB();
        GjkCache<S> cache = anyCorner(a, b, engine);
        GjkResult<S> result;
        NoObserver observer;
        if (!gjkFromCorner(a, b, std::numeric_limits<S>::infinity(), cache, observer, result))
        {
            ++tally.unknown;
            continue;
        }
        expectClosest(a, b, result);
        count(cache, tally);
        // The cache answers the same query at once.
        GjkResult<S> again;
        ASSERT_TRUE(gjkFromCorner(a, b, std::numeric_limits<S>::infinity(), cache, observer, again));
        ASSERT_EQ(again.iterations, 0);
        ASSERT_NEAR(double(again.distance), double(result.distance), kAccuracy<S>);
    }
    for (const int kind : {tally.corners, tally.edges, tally.triangles, tally.parallelograms, tally.unknown})
        EXPECT_GT(kind, 150);
}

/// Two hulls of nearly all kinds, which move a little from frame to frame.
template <class S>
void checkTrajectories(const std::vector<NamedPoints>& shapes, double gap, Tally& tally, int& iterations)
{
    std::mt19937 engine(42);
    for (const NamedPoints& shape : shapes)
    {
        const Hull<S> hull = hullOf<S>(shape.points);
        for (int pair = 0; pair < 10; ++pair)
        {
            SCOPED_TRACE(shape.name + " " + std::to_string(pair));
            PairScene<S> scene = randomPair(hull, hull, gap, 0.0, engine);
            GjkCache<S> cache;
            for (int frame = 0; frame < 30; ++frame)
            {
                const PosedHull<S> a = scene.posedA(), b = scene.posedB();
                NoObserver observer;
                GjkResult<S> result;
                const bool isTold =
                    gjkWithoutSearch(a, b, std::numeric_limits<S>::infinity(), cache, observer, result);
                const double distance = double(DistanceOracle(a, b).solve().upper);
                if (!isTold)
                    gjkDistance(a, b, std::numeric_limits<S>::infinity(), cache);
                else if (result.state == GjkState::Near)
                    ASSERT_NO_FATAL_FAILURE(expectClosest(a, b, result));
                else
                    ASSERT_EQ(distance, 0.0);
                if (distance > 0.0 && !isTold)
                    ++tally.unknown;
                else if (distance > 0.0)
                    count(cache, tally);
                iterations += result.iterations;
                perturb(scene, 0.01, engine);
            }
        }
    }
}

TYPED_TEST(CornerCones, AnswerNearlyAllPairsThatStayApart)
{
    Tally tally;
    int iterations = 0;
    checkTrajectories<TypeParam>({{"ico42", icoPoints(1)},
                                  {"ico162", icoPoints(2)},
                                  {"ico642", icoPoints(3)},
                                  {"ell200", ellipsoidPoints(200, {1.0, 0.7, 0.5}, 200)},
                                  {"prism32", prismPoints(32, 0.5)},
                                  {"gridbox", gridBoxPoints(5)}},
                                 0.2, tally, iterations);
    const int told = tally.corners + tally.edges + tally.triangles + tally.parallelograms;
    EXPECT_GT(told, 1000);
    EXPECT_LT(tally.unknown, told / 25);
    for (const int kind : {tally.corners, tally.edges, tally.triangles, tally.parallelograms})
        EXPECT_GT(kind, 40);
    EXPECT_LT(iterations, 2 * told);
}

TYPED_TEST(CornerCones, CompareNeighboursInDoubleOnlyWhenTheyAreLevel)
{
    using S = TypeParam;
    const Hull<S> hulls[] = {hullOf<S>(icoPoints(1)), hullOf<S>(boxPoints(0.7, 0.5, 0.6)),
                             hullOf<S>(ellipsoidPoints(50, {1.0, 0.7, 0.5}, 50))};
    std::mt19937 engine(46);
    Tally tally;
    int found = 0, repeated = 0;
    for (int i = 0; i < 900; ++i)
    {
        PairScene<S> scene = randomPair(hulls[i % 3], hulls[i / 3 % 3], 0.05, 0.0, engine);
        GjkCache<S> cache;
        gjkDistance(scene.posedA(), scene.posedB(), S(9), cache);
        // Sides that were parallel are so no longer.
        perturb(scene, 0.002, engine);
        const PosedHull<S> a = scene.posedA(), b = scene.posedB();
        CornerCone<S> cone(a, b);
        if (!cone.find(cache))
            continue;
        cone.remember(cache);
        count(cache, tally);
        ++found;
        repeated += cone.levelPasses() > 0;
    }
    EXPECT_GT(found, 800);
    EXPECT_GT(tally.triangles, 100);
    EXPECT_GT(tally.parallelograms, 100);
    // The corner opposite in a side of a box is level. All or most would be so with a bound of rounding that is too
    // large, or an edge that is not known.
    EXPECT_LT(repeated, found / 10) << "seed 46";
}

TYPED_TEST(CornerCones, AnswerMostPairsWithParallelFacesAndEdges)
{
    using S = TypeParam;
    // All neighbours in a face are level with each other, up to the rounding of a rotated basis.
    const Hull<S> grid = hullOf<S>(gridBoxPoints(5)), box = hullOf<S>(boxPoints(0.7, 0.5, 0.6)),
                  prism = hullOf<S>(prismPoints(100, 0.5));
    const std::array<const Hull<S>*, 3> hulls = {&grid, &box, &prism};
    std::mt19937 engine(43);
    int told = 0;
    for (int i = 0; i < 600; ++i)
    {
        SCOPED_TRACE(i);
        const Eigen::Matrix3d turn = i % 2 == 0 ? Eigen::Matrix3d::Identity() : randomRotation(engine);
        const int axis = i / 2 % 3;
        const double aside = i % 5 == 0 ? 0.0 : 0.3 * double(engine() % 100) / 100.0;
        const Eigen::Vector3d shift =
            turn * (2.5 * Eigen::Vector3d::Unit(axis) + aside * Eigen::Vector3d::Unit((axis + 1) % 3));
        const PosedHull<S> a(*hulls[engine() % 3], turn.cast<S>(), shift.cast<S>()),
            b(*hulls[engine() % 3], turn.cast<S>(), Eigen::Matrix<S, 3, 1>::Zero());
        GjkCache<S> cache;
        for (int query = 0; query < 2; ++query)
        {
            const GjkResult<S> result = gjkDistance(a, b, std::numeric_limits<S>::infinity(), cache);
            ASSERT_NO_FATAL_FAILURE(expectClosest(a, b, result));
        }
        NoObserver observer;
        GjkResult<S> result;
        told += gjkFromCorner(a, b, std::numeric_limits<S>::infinity(), cache, observer, result) ? 1 : 0;
    }
    EXPECT_GT(told, 400);
}

TYPED_TEST(CornerCones, DoNotAnswerOverlappingTouchingOrNonFinitePairs)
{
    using S = TypeParam;
    const Hull<S> hull = hullOf<S>(boxPoints(0.5, 0.5, 0.5));
    const Eigen::Matrix<S, 3, 3> turn = Eigen::Matrix<S, 3, 3>::Identity();
    const S nan = std::numeric_limits<S>::quiet_NaN();
    std::mt19937 engine(44);
    for (const S x : {S(0), S(0.3), S(1), nan, std::numeric_limits<S>::infinity()})
    {
        const PosedHull<S> a(hull, turn, {x, S(0.1), S(-0.2)}), b(hull, turn, {S(0), S(0), S(0)});
        for (int i = 0; i < 50; ++i)
        {
            GjkCache<S> cache = anyCorner(a, b, engine);
            NoObserver observer;
            GjkResult<S> result;
            ASSERT_FALSE(gjkFromCorner(a, b, std::numeric_limits<S>::infinity(), cache, observer, result));
            ASSERT_EQ(result.state, GjkState::NotConverged);
            const GjkState state = gjkDistance(a, b, std::numeric_limits<S>::infinity(), cache).state;
            ASSERT_EQ(state, std::isfinite(x) ? GjkState::Overlapping : GjkState::NotConverged);
        }
    }
}

TYPED_TEST(CornerCones, GiveClosestPointsWhenNeighboursHardlySpanCone)
{
    using S = TypeParam;
    // Rounding moves points off the faces and edges of a rotated grid, and a corner on an edge may have neighbours on
    // that edge alone.
    std::mt19937 engine(47);
    std::vector<Hull<S>> grids;
    for (const int cells : {5, 9, 12, 17})
        grids.push_back(
            hullOf<S>(moved(gridBoxPoints(cells), randomRotation(engine), Eigen::Vector3d::Zero())));
    const Hull<S> hulls[] = {hullOf<S>(figure9Points()), hullOf<S>(boxPoints(1.0, 0.01, 0.02)),
                             hullOf<S>(icoPoints(1))};
    for (int i = 0; i < 1500; ++i)
    {
        SCOPED_TRACE(i);
        const double gaps[] = {0.7, 0.05, 1e-3};
        const Hull<S>& other = i % 4 == 3 ? grids[engine() % grids.size()] : hulls[i % 4];
        const double gap = gaps[engine() % std::size(gaps)];
        const PairScene<S> scene = randomPair(grids[engine() % grids.size()], other, gap, 0.0, engine);
        GjkCache<S> cache = i % 2 == 0 ? GjkCache<S>() : anyCorner(scene.posedA(), scene.posedB(), engine);
        const GjkResult<S> result =
            gjkDistance(scene.posedA(), scene.posedB(), std::numeric_limits<S>::infinity(), cache);
        ASSERT_NO_FATAL_FAILURE(expectClosest(scene.posedA(), scene.posedB(), result));
    }
}

/// Corners collinear along an edge up to rounding, and a tip so near that the error of the closest point is as large:
/// its remainder along the edge must not hide that one side of the edge rises towards the origin.
TEST(CornerCone, GivesRightDistanceWhenRoundingHidesCollinearCorners)
{
    std::mt19937 turned(5);
    const Hull<double> grid = hullOf<double>(moved(gridBoxPoints(12), randomRotation(turned), {0, 0, 0}));
    const Hull<double> octahedron =
        hullOf<double>({{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}});
    Eigen::Matrix3d basis;
    basis << 0x1.fffffffd1e946p-1, 0x1.a453bb40cb656p-16, -0x1.b8166ea9b4f88p-18, -0x1.a4593a2b66efdp-16,
        0x1.ffffff59a8c29p-1, -0x1.995b12863b8d9p-13, 0x1.b7c26a30f85d6p-18, 0x1.995b2918df601p-13,
        0x1.ffffff5c2baebp-1;
    const PosedHull<double> a(grid, Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero());
    const PosedHull<double> b(octahedron, basis,
                              {0x1.6e8ffa8dd7c9cp-1, 0x1.14f29942d16c8p+0, 0x1.630d211ce1d54p-1});
    GjkCache<double> cache, fresh;
    cache.count = 2;
    cache.verticesA = {64, 65, 0, 0};
    cache.verticesB = {3, 3, 0, 0};
    ASSERT_NEAR((a.point(64) - a.point(65)).norm(), 0.105, 0.001);
    NoObserver observer;
    const double infinity = std::numeric_limits<double>::infinity();
    const GjkResult<double> truth = gjkDistance(a, b, infinity, fresh, observer, GjkStart::FourDirections);
    EXPECT_NEAR(truth.distance, 1.067698e-4, 1e-10);
    EXPECT_NEAR(gjkDistance(a, b, infinity, cache).distance, truth.distance, 1e-12);
}

TEST(CornerCone, LeavesPairsWithTooFewDigitsToGjk)
{
    // The corner is billions of times as far away as the other shape: the point on an edge is perpendicular to it only
    // to 1e-7.
    constexpr double kSize = 1e4;
    std::vector<Hull<double>> hulls;
    for (const Points& points : {boxPoints(0.7, 0.5, 0.6), icoPoints(0), prismPoints(32, 0.5)})
        hulls.push_back(hullOf<double>(scaled(points, kSize)));
    std::mt19937 engine(48);
    int edges = 0, refused = 0;
    for (int i = 0; i < 3000; ++i)
    {
        SCOPED_TRACE(i);
        PairScene<double> scene;
        scene.hullA = &hulls[static_cast<std::size_t>(i % 3)];
        scene.hullB = &hulls[static_cast<std::size_t>(i / 3 % 3)];
        scene.a = poseOf<double>(randomRotation(engine), Eigen::Vector3d::Zero());
        const Eigen::Vector3d away = 4.0 * kSize * randomDirection(engine);
        scene.b = poseOf<double>(randomRotation(engine), away);
        GjkCache<double> far;
        const GjkResult<double> gap =
            gjkDistance(scene.posedA(), scene.posedB(), std::numeric_limits<double>::infinity(), far);
        scene.b.origin += gap.axis * (gap.distance - (i % 2 == 0 ? 3e-10 : 1e-5) * kSize);
        const PosedHull<double> a = scene.posedA(), b = scene.posedB();
        const Bounds truth = DistanceOracle(a, b).solve();
        GjkCache<double> cache;
        gjkDistance(a, b, std::numeric_limits<double>::infinity(), cache);
        if (cache.count == 0 || cache.count == 4 || !(truth.lower > 0.0L))
            continue;
        NoObserver observer;
        GjkResult<double> result;
        if (!gjkFromCorner(a, b, std::numeric_limits<double>::infinity(), cache, observer, result))
        {
            ++refused;
            continue;
        }
        edges += cache.count == 2;
        const long double proved = -DistanceOracle(a, b).extent(-result.axis.cast<long double>());
        ASSERT_GT(double(proved), double(truth.lower) - 3e-8 * kSize);
    }
    EXPECT_GT(edges, 100);
    EXPECT_GT(refused, 100);
}

TYPED_TEST(CornerCones, AreAccurateForThinShapesOfDifferentSizes)
{
    using S = TypeParam;
    std::vector<Hull<S>> hulls;
    for (const double thickness : {1e-2, 1e-3, 1e-4})
    {
        hulls.push_back(hullOf<S>(boxPoints(1.0, thickness, thickness)));
        hulls.push_back(hullOf<S>(boxPoints(1.0, 1.0, thickness)));
        hulls.push_back(hullOf<S>(prismPoints(12, thickness)));
    }
    hulls.push_back(hullOf<S>(boxPoints(0.7, 0.5, 0.6)));
    std::mt19937 engine(46);
    int told = 0, edges = 0;
    for (int i = 0; i < 4000; ++i)
    {
        SCOPED_TRACE(i);
        const double sizes[] = {1.0, 1.0, 30.0, 1000.0}, gaps[] = {0.3, 1e-2, 1e-3};
        PairScene<S> scene = anyPair(hulls, gaps[engine() % std::size(gaps)], 0.0, engine);
        const S size = S(sizes[engine() % std::size(sizes)]);
        // B extends roughly away from A.
        const Eigen::Matrix<S, 3, 1> away = scene.b.origin - scene.a.origin;
        const PosedHull<S> a = scene.posedA();
        const PosedHull<S> b(*scene.hullB, scene.b.basis * size, scene.a.origin + away * size);
        const Bounds truth = DistanceOracle(a, b).solve();
        GjkCache<S> cache = anyCorner(a, b, engine);
        NoObserver observer;
        GjkResult<S> result;
        if (!gjkFromCorner(a, b, std::numeric_limits<S>::infinity(), cache, observer, result))
            continue;
        ++told;
        edges += cache.count > 1;
        const double accuracy = kAccuracy<S> * std::max(1.0, double(size)) * 10.0;
        ASSERT_NEAR(double(result.distance), double(truth.upper), accuracy);
        const long double proved = -DistanceOracle(a, b).extent(-result.axis.template cast<long double>());
        // The error of the rounded axis grows with the larger shape.
        const double rounding = (sizeof(S) == sizeof(float) ? 4e-7 : 1e-11) * double(size);
        ASSERT_GT(double(proved), double(truth.lower) - rounding);
    }
    EXPECT_GT(told, 800);
    EXPECT_GT(edges, 400);
}

TYPED_TEST(CornerCones, AreAccurateAtEveryScaleAndWithStretchedBases)
{
    using S = TypeParam;
    std::mt19937 engine(45);
    int near = 0;
    for (const double size : {1e-12, 1e-8, 1e-4, 1.0, 1e4, 1e8, 1e12})
    {
        for (const NamedPoints& shape : hullShapes())
        {
            if (shape.isThin)
                continue;
            const Points points = scaled(shape.points, size);
            const Hull<S> unit = hullOf<S>(shape.points), hull = hullOf<S>(points);
            PairScene<S> scene = randomPair(unit, unit, 0.3, 0.0, engine);
            const Eigen::Matrix<S, 3, 1> stretch = size == 1.0 ? Eigen::Matrix<S, 3, 1>(S(1), S(0.2), S(-0.6))
                                                               : Eigen::Matrix<S, 3, 1>(S(1), S(1), S(1));
            GjkCache<S> cache;
            for (int frame = 0; frame < 12; ++frame)
            {
                perturb(scene, 0.01, engine);
                const PosedHull<S> a(hull, scene.a.basis * stretch.asDiagonal(), scene.a.origin * S(size));
                const PosedHull<S> b(hull, scene.b.basis, scene.b.origin * S(size));
                const GjkResult<S> result = gjkDistance(a, b, std::numeric_limits<S>::infinity(), cache);
                const Bounds truth = DistanceOracle(a, b).solve();
                ASSERT_NEAR(double(result.distance) / size, double(truth.upper) / size, kAccuracy<S>)
                    << shape.name << " " << size;
                near += result.state == GjkState::Near;
            }
        }
    }
    EXPECT_GT(near, 500);
}
}  // namespace
}  // namespace cullet::test
