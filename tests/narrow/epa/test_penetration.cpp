// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/distance_oracle.h"
#include "cullet/demos/scenes/hulls/hull_pairs.h"
#include "cullet/narrow/epa/epa.h"
#include "cullet/narrow/epa/exact_penetration.h"
#include "cullet/narrow/gjk/isa_gjk.h"
#include "cullet/tests/narrow/any_pair.h"
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
TEST(Penetration, EqualsSmallestOverlapOfTwoBoxes)
{
    const Hull<float> box = hullOf<float>(boxPoints(0.5, 0.5, 0.5));
    GjkCache<float> cache;
    const auto a = at(box, 0.0f, 0.0f, 0.0f);
    const auto b = at(box, 0.25f, -0.875f, 0.125f);
    for (int i = 0; i < 2; ++i)
    {
        const auto result = penetration(a, b, cache);
        ASSERT_EQ(result.state, GjkState::Overlapping);
        EXPECT_NEAR(result.depth, 0.125f, 1e-6f);
        EXPECT_TRUE(result.axis.isApprox(Eigen::Vector3f(0, 1, 0), 1e-5f)) << result.axis.transpose();
        EXPECT_NEAR(result.pointA.y(), -0.5f, 1e-6f);
        EXPECT_NEAR(result.pointB.y(), -0.375f, 1e-6f);
    }
}

TEST(Penetration, ReportsSeparatedBoxesAsSeparated)
{
    const Hull<float> box = hullOf<float>(boxPoints(0.5, 0.5, 0.5));
    GjkCache<float> cache;
    EXPECT_EQ(penetration(at(box, 0, 0, 0), at(box, 1.5f, 0, 0), cache).state, GjkState::Separated);
}

TEST(Penetration, HasZeroDepthAndContactNormalWhenBoxesTouch)
{
    const Hull<float> box = hullOf<float>(boxPoints(0.5, 0.5, 0.5));
    for (const Eigen::Vector3f& d : {Eigen::Vector3f(1, 0, 0), Eigen::Vector3f(1, 0.5f, 0.25f),
                                     Eigen::Vector3f(1, 1, 0), Eigen::Vector3f(1, 1, 1)})
    {
        SCOPED_TRACE(d.transpose());
        GjkCache<float> cache;
        const auto result = penetration(at(box, 0, 0, 0), at(box, d.x(), d.y(), d.z()), cache);
        ASSERT_EQ(result.state, GjkState::Overlapping);
        EXPECT_NEAR(result.depth, 0.0f, 1e-6f);
        EXPECT_NEAR(result.axis.norm(), 1.0f, 1e-5f);
        EXPECT_LT(result.axis.dot(d), 0.0f);
    }
}

TEST(Penetration, FindsDepthOfFlatShapeInBox)
{
    const Hull<float> square = hullOf<float>({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}});
    const Hull<float> box = hullOf<float>(boxPoints(0.5, 0.5, 0.5));
    GjkCache<float> cache;
    const auto result = penetration(at(square, 0, 0, 0), at(box, 0.25f, 0.0f, 0.375f), cache);
    ASSERT_EQ(result.state, GjkState::Overlapping);
    EXPECT_NEAR(result.depth, 0.125f, 1e-6f);
    EXPECT_NEAR(result.axis.z(), -1.0f, 1e-5f);
}

TEST(Penetration, FindsDepthOfCoincidentShapesOfEveryKind)
{
    for (const NamedPoints& shape : queryShapes())
    {
        SCOPED_TRACE(shape.name);
        const Hull<float> hull = hullOf<float>(shape.points);
        GjkCache<float> cache;
        const auto result = penetration(at(hull, 1, 2, 3), at(hull, 1, 2, 3), cache);
        ASSERT_EQ(result.state, GjkState::Overlapping);
        EXPECT_GT(result.depth, 1e-3f);
        EXPECT_TRUE(result.axis.allFinite());
    }
}

/// Checks shapes for which all faces of A - B are about equally close to the origin, so that the expansion has to find
/// nearly all of them.
template <class S>
void checkLargePolytope(const Hull<S>& hull, const PosedHull<S>& b)
{
    const PosedHull<S> a = at(hull, 0, 0, 0);
    Eigen::Vector3d normal;
    double depth = 0.0;
    ASSERT_TRUE(exactPenetration(a, b, normal, depth));
    GjkCache<S> cache;
    EpaCache memory;
    for (int frame = 0; frame < 2; ++frame)
    {
        const PenetrationResult<S> result = penetration(a, b, cache, &memory);
        ASSERT_EQ(result.state, GjkState::Overlapping);
        EXPECT_EQ(result.method, PenetrationMethod::Expansion);
        EXPECT_GT(result.iterations, Polytope::kMaxVertices);
        EXPECT_EQ(memory.vertexCount, 0);
        const double tolerance = sizeof(S) == 4 ? 1e-6 : 1e-12;
        EXPECT_NEAR(result.depth, depth, tolerance);
        EXPECT_LE(result.dualGap, tolerance);
        EXPECT_LT(outsideOf(a, Eigen::Vector3d::Zero(), result.pointA), 1e-5);
        EXPECT_LT(outsideOf(b, b.origin() - a.origin(), result.pointB), 1e-5);
    }
}

template <class S>
void checkLargePolytopes()
{
    const Hull<S> hull = hullOf<S>(icoPoints(3));
    using Matrix = Eigen::Matrix<S, 3, 3>;
    const Matrix turn(Eigen::AngleAxis<S>(S(0.3), Eigen::Matrix<S, 3, 1>(1, 2, 3).normalized()));
    checkLargePolytope<S>(hull, at(hull, 0, 0, 0));
    checkLargePolytope<S>(hull, PosedHull<S>(hull, turn, {S(0), S(0), S(0)}));
    checkLargePolytope<S>(hull, PosedHull<S>(hull, turn, {S(0.01), S(0), S(0)}));
}

TEST(Penetration, ExpandsLargePolytopeForNearlyConcentricRoundHulls)
{
    checkLargePolytopes<float>();
    checkLargePolytopes<double>();
}

TEST(Penetration, FallsBackToExactSearchWhenLargePolytopeIsFull)
{
    const Hull<float> hull = hullOf<float>(icoPoints(4));
    GjkCache<float> cache;
    const auto result = penetration(at(hull, 0, 0, 0), at(hull, 0, 0, 0), cache);
    ASSERT_EQ(result.state, GjkState::Overlapping);
    EXPECT_EQ(result.method, PenetrationMethod::Exact);
    // Twice the radius of the inscribed sphere of the solid.
    double inner = 1.0;
    for (const auto& face : hull.faces())
        inner = std::min(inner, face.offset);
    EXPECT_NEAR(result.depth, 2.0 * inner, 1e-5);
    EXPECT_LT(outsideOf(at(hull, 0, 0, 0), Eigen::Vector3d::Zero(), result.pointA), 1e-5);
    EXPECT_LT(outsideOf(at(hull, 0, 0, 0), Eigen::Vector3d::Zero(), result.pointB), 1e-5);
}

template <class S>
void checkMemoryOfAnotherPair()
{
    const std::vector<Hull<S>> hulls = {hullOf<S>(icoPoints(1)), hullOf<S>(boxPoints(0.5, 0.6, 0.7))};
    std::mt19937 engine(41);
    int usedCount = 0, forgottenCount = 0;
    EpaCache memory;
    PairScene<S> scene;
    for (int i = 0; i < 2000; ++i)
    {
        SCOPED_TRACE(i);
        // Every fourth query is for a new pair, and the others for a pair that teleports.
        if (i % 4 == 0)
            scene = anyPair(hulls, -0.1, 0.0, engine);
        else
            perturb(scene, 0.1, engine);
        const PosedHull<S> a = scene.posedA();
        const PosedHull<S> b = scene.posedB();
        GjkCache<S> cache;
        const bool wasEmpty = memory.vertexCount == 0;
        const PenetrationResult<S> result = rememberedPenetration(a, b, cache, memory);
        if (result.state == GjkState::Overlapping)
        {
            GjkCache<S> other;
            EXPECT_NEAR(result.depth, penetration(a, b, other).depth, sizeof(S) == 4 ? 1e-5 : 1e-10);
            ++usedCount;
            continue;
        }
        EXPECT_EQ(result.state, GjkState::NotConverged);
        EXPECT_EQ(memory.vertexCount, 0);
        forgottenCount += wasEmpty ? 0 : 1;
        penetration(a, b, cache, &memory);
    }
    EXPECT_GT(usedCount, 100);
    EXPECT_GT(forgottenCount, 100);
}

TEST(Penetration, ForgetsMemoryOfOtherPairOrFindsSameDepthFromIt)
{
    checkMemoryOfAnotherPair<float>();
    checkMemoryOfAnotherPair<double>();
}

/// Checks cached surfaces with dents, or without the origin inside, after points of A - B have moved apart.
template <class S>
void checkMemoryOfPairsThatTurn()
{
    const std::vector<Hull<S>> hulls = {hullOf<S>(icoPoints(1)), hullOf<S>(boxPoints(0.5, 0.6, 0.7))};
    std::mt19937 engine(42);
    int recalled = 0, asked = 0, grown = 0;
    for (int pair = 0; pair < 60; ++pair)
    {
        PairScene<S> scene = randomPair(hulls[pair % 2], hulls[pair / 2 % 2], -0.04, 0.0, engine);
        GjkCache<S> cache;
        EpaCache memory;
        for (int frame = 0; frame < 30; ++frame)
        {
            SCOPED_TRACE(testing::Message() << "pair " << pair << " frame " << frame);
            const PosedHull<S> a = scene.posedA(), b = scene.posedB();
            const bool isAsked = memory.vertexCount > 0;
            PenetrationResult<S> result = rememberedPenetration(a, b, cache, memory);
            GjkCache<S> other;
            const PenetrationResult<S> fresh = penetration(a, b, other);
            if (result.state == GjkState::Overlapping)
            {
                EXPECT_NEAR(result.depth, fresh.depth, sizeof(S) == 4 ? 1e-6 : 1e-11);
                EXPECT_LE(result.dualGap, sizeof(S) == 4 ? 1e-5 : 1e-10);
                ++recalled;
                grown += result.iterations > 0;
            }
            else
                penetration(a, b, cache, &memory);
            asked += isAsked && fresh.state == GjkState::Overlapping && fresh.depth > 1e-3;
            perturb(scene, 0.01, engine);
        }
    }
    EXPECT_GT(asked, 500);
    EXPECT_GT(grown, asked / 10);
    EXPECT_GT(recalled, asked * 95 / 100) << asked;
}

TEST(Penetration, FindsSameDepthFromRememberedSurfaceWithDents)
{
    checkMemoryOfPairsThatTurn<float>();
    checkMemoryOfPairsThatTurn<double>();
}

namespace
{
template <class S>
void expectPointsOfTheShapes(const PosedHull<S>& a, const PosedHull<S>& b, const PenetrationResult<S>& result,
                             double tolerance)
{
    EXPECT_LT(outsideOf(a, Eigen::Vector3d::Zero(), result.pointA), tolerance);
    EXPECT_LT(outsideOf(b, b.origin() - a.origin(), result.pointB), tolerance);
}

/// Checks equally rotated boxes that overlap, and then touch along one, two or three of their axes: most faces of A - B
/// are coplanar with others, or parallel to the normal.
template <class S>
void checkTouchingBoxes(double tolerance)
{
    std::mt19937 engine(955);
    std::uniform_real_distribution<double> half(0.3, 2.0), within(-0.7, 0.7), closer(0.9, 0.99);
    const Hull<S> box = hullOf<S>(boxPoints(1.0, 1.0, 1.0));
    int remembered = 0;
    for (int i = 0; i < 2000; ++i)
    {
        SCOPED_TRACE(i);
        const Eigen::Matrix3d turn = randomRotation(engine);
        const Eigen::Vector3d halvesA = drawVector(half, engine);
        const Eigen::Vector3d halvesB = drawVector(half, engine);
        Eigen::Vector3d away = halvesA + halvesB;
        for (int axis = i % 3; axis < 2; ++axis)
            away[axis] *= within(engine);
        const Eigen::Matrix3d basisA = turn * halvesA.asDiagonal();
        const Eigen::Matrix3d tilt(
            Eigen::AngleAxisd(0.03 * within(engine), Eigen::Vector3d(1, 2, 3).normalized()));
        const PosedHull<S> a(box, basisA.cast<S>(), {S(0), S(0), S(0)});
        const PosedHull<S> tilted(box, (tilt * basisA).cast<S>(), {S(0), S(0), S(0)});
        const auto b = [&](double part)
        {
            return PosedHull<S>(box, (turn * halvesB.asDiagonal()).template cast<S>(),
                                (turn * (away * part)).template cast<S>());
        };
        GjkCache<S> cache;
        EpaCache memory;
        penetration(tilted, b(closer(engine)), cache, &memory);
        const PosedHull<S> touching = b(1.0);
        const PenetrationResult<S> result = rememberedPenetration(a, touching, cache, memory);
        if (result.state != GjkState::Overlapping)
            continue;
        ++remembered;
        expectPointsOfTheShapes(a, touching, result, tolerance);
    }
    EXPECT_GT(remembered, 500);
}

/// Checks a splinter in an edge of a box of a billion times its size, where most faces of A - B are slivers.
void checkSplinters()
{
    std::mt19937 engine(14);
    std::normal_distribution<double> normal;
    const double half = 4e8;
    const Hull<double> box = hullOf<double>(boxPoints(half, half, half));
    int depths = 0;
    for (int i = 0; i < 4000; ++i)
    {
        SCOPED_TRACE(i);
        Points points;
        for (int k = 0; k < 4; ++k)
            points.push_back({normal(engine), 1e-4 * normal(engine), 1e-4 * normal(engine)});
        const Hull<double> splinter = hullOf<double>(moved(points, randomRotation(engine), {0.0, 0.0, 0.0}));
        const Eigen::Matrix3d turn = randomRotation(engine);
        const double z = 0.1 * half * normal(engine), y = half - 0.01 * std::abs(normal(engine));
        const Eigen::Vector3d edge(half, y, z);
        const PosedHull<double> a(box, turn, {0.0, 0.0, 0.0});
        const PosedHull<double> b(splinter, Eigen::Matrix3d::Identity(), turn * edge);
        GjkCache<double> cache;
        const PenetrationResult<double> result = penetration(a, b, cache);
        if (result.method != PenetrationMethod::Expansion)
            continue;
        ++depths;
        // The distance query that finds the points where the surface gives none is accurate to 1e-7 of the size.
        expectPointsOfTheShapes(a, b, result, 100.0);
    }
    EXPECT_GT(depths, 1000);
}
}  // namespace

TEST(Penetration, PlacesDeepestPointsInRememberedBoxesThatTouch)
{
    checkTouchingBoxes<float>(1e-5);
    checkTouchingBoxes<double>(1e-9);
}

TEST(Penetration, PlacesDeepestPointsInSplinterAndLargeBox)
{
    checkSplinters();
}

TEST(Penetration, DoesNotConvergeForNonFiniteInputs)
{
    const Hull<float> hull = hullOf<float>(icoPoints(1));
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()})
    {
        GjkCache<float> cache;
        EXPECT_EQ(penetration(at(hull, 0, 0, 0), at(hull, bad, 0, 0), cache).state, GjkState::NotConverged);
        EXPECT_EQ(isaGjk(at(hull, 0, 0, 0), at(hull, 0.1f, 0, 0), 0.0f, cache).state, GjkState::Overlapping);
        EXPECT_EQ(penetration(at(hull, 0, 0, 0), at(hull, bad, 0, 0), cache).state, GjkState::NotConverged);
    }
}

TEST(ExactPenetration, IgnoresFacesThatFlatBasisRemoves)
{
    const Hull<double> box = hullOf<double>(boxPoints(0.5, 0.5, 0.5));
    const PosedHull<double> flat(box, Eigen::Vector3d(1, 1, 0).asDiagonal().toDenseMatrix(), {0, 0, 0});
    Eigen::Vector3d normal;
    double depth = 0.0;
    ASSERT_TRUE(exactPenetration(flat, at(box, 0.25, 0.0, 0.375), normal, depth));
    EXPECT_NEAR(depth, 0.125, 1e-15);
    EXPECT_NEAR(std::abs(normal.z()), 1.0, 1e-15);
    const PosedHull<double> point(box, Eigen::Matrix3d::Zero(), {0, 0, 0});
    EXPECT_FALSE(exactPenetration(point, point, normal, depth));
}

TEST(ExactPenetration, SeparatesSegmentThroughBoxEdgeAcrossBoth)
{
    const Hull<double> box = hullOf<double>(boxPoints(1.0, 1.0, 1.0));
    const Hull<double> segment = hullOf<double>({{0, 0, 0}, {-5, 5, 0}, {5, -5, 0}, {1, -1, 0}});
    Eigen::Vector3d normal;
    double depth = 0.0;
    ASSERT_TRUE(exactPenetration(at(box, 0, 0, 0), at(segment, 0.9, 0.9, 0), normal, depth));
    EXPECT_NEAR(depth, 0.2 * std::sqrt(0.5), 1e-12);
    EXPECT_NEAR(normal.x(), std::sqrt(0.5), 1e-12);
    EXPECT_NEAR(normal.y(), std::sqrt(0.5), 1e-12);
    ASSERT_TRUE(exactPenetration(at(segment, 0.9, 0.9, 0), at(box, 0, 0, 0), normal, depth));
    EXPECT_NEAR(depth, 0.2 * std::sqrt(0.5), 1e-12);
}

TEST(ExactPenetration, IsZeroForCrossingSegmentsAndUnknownForParallelOnes)
{
    const Hull<double> segment = hullOf<double>({{-1, 0, 0}, {1, 0, 0}}),
                       other = hullOf<double>({{0, -1, 0}, {0, 1, 0}});
    Eigen::Vector3d normal;
    double depth = 1.0;
    ASSERT_TRUE(exactPenetration(at(segment, 0, 0, 0), at(other, 0.5, 0.25, 0), normal, depth));
    EXPECT_EQ(depth, 0.0);
    EXPECT_NEAR(std::abs(normal.z()), 1.0, 1e-12);
    EXPECT_FALSE(exactPenetration(at(segment, 0, 0, 0), at(segment, 0.5, 0, 0), normal, depth));
}

TEST(ExactPenetration, EqualsDepthOfExpansionForTriangles)
{
    std::mt19937 engine(1);
    NormalPoints any{engine};
    int depths = 0;
    for (int i = 0; i < 2000; ++i)
    {
        SCOPED_TRACE(i);
        const Hull<double> first = hullOf<double>({any(), any(), any()}),
                           second = hullOf<double>({any(), any(), any()});
        const PosedHull<double> a = at(first, 0, 0, 0), b = at(second, 0, 0, 0);
        GjkCache<double> cache;
        const PenetrationResult<double> result = penetration(a, b, cache);
        if (result.method != PenetrationMethod::Expansion)
            continue;
        ++depths;
        Eigen::Vector3d direction;
        double depth = 0.0;
        ASSERT_TRUE(exactPenetration(a, b, direction, depth));
        EXPECT_NEAR(depth, result.depth, 1e-10);
    }
    EXPECT_GT(depths, 200);
}

namespace
{
/// Checks crossing segments, for which rounding decides whether their difference has a volume.
template <class S>
void checkCrossingSegments()
{
    std::mt19937 engine(3601);
    NormalPoints any{engine};
    int depths = 0;
    for (int i = 0; i < 20000; ++i)
    {
        SCOPED_TRACE(i);
        const Eigen::Vector3d crossing = any(), first = any(), second = any();
        const Hull<S> a = hullOf<S>({crossing - first, crossing + 0.7 * first});
        const Hull<S> b = hullOf<S>({crossing - second, crossing + 0.4 * second});
        GjkCache<S> cache;
        const PenetrationResult<S> result = penetration(at(a, 0, 0, 0), at(b, 0, 0, 0), cache);
        ASSERT_NE(result.state, GjkState::NotConverged);
        if (result.state != GjkState::Overlapping)
            continue;
        ++depths;
        EXPECT_LT(result.depth, 1e-6);
        const Eigen::Vector3d across = first.cross(second).normalized();
        EXPECT_NEAR(std::abs(result.axis.template cast<double>().dot(across)), 1.0, 1e-5);
    }
    EXPECT_GT(depths, sizeof(S) == 4 ? 20 : 1000);
}
}  // namespace

TEST(Penetration, FindsDepthOfCrossingSegmentsWhenDifferenceIsSliver)
{
    checkCrossingSegments<float>();
    checkCrossingSegments<double>();
}

/// The exact search is the reference below; here it is tested itself: no direction has a smaller extent.
TEST(ExactPenetration, HasSmallestExtentOfAllSampledDirections)
{
    const std::vector<NamedPoints> shapes = queryShapes();
    std::mt19937 engine(3);
    int depthCount = 0;
    int improvedCount = 0;
    for (int i = 0; i < 150; ++i)
    {
        const NamedPoints& shapeA = shapes[engine() % shapes.size()];
        const NamedPoints& shapeB = shapes[engine() % shapes.size()];
        SCOPED_TRACE(testing::Message() << shapeA.name << " " << shapeB.name << " " << i);
        const Hull<double> hullA = hullOf<double>(shapeA.points);
        const Hull<double> hullB = hullOf<double>(shapeB.points);
        const PairScene<double> scene = randomPair(hullA, hullB, -0.0005 * (1 + i % 300), 0.0, engine);
        Eigen::Vector3d normal;
        double depth = 0.0;
        const PosedHull<double> a = scene.posedA();
        const PosedHull<double> b = scene.posedB();
        ASSERT_TRUE(exactPenetration(a, b, normal, depth));
        const DistanceOracle oracle(a, b);
        // A thin shape may have passed through to the other side.
        if (depth < 0.0)
            continue;
        ++depthCount;
        const double extent = static_cast<double>(oracle.extent(normal.cast<long double>()));
        EXPECT_NEAR(extent, depth, 1e-12);
        for (int k = 0; k < 2000; ++k)
        {
            // Directions from all around and, to find a local minimum, nearby ones.
            const Eigen::Vector3d d =
                k % 2 == 0 ? randomDirection(engine)
                           : Eigen::Vector3d(normal + std::pow(10.0, -(k % 7)) * randomDirection(engine));
            const double other = static_cast<double>(oracle.extent(d.cast<long double>()));
            ASSERT_GE(other, depth - 1e-12);
            improvedCount += other < depth * 1.001;
        }
    }
    EXPECT_GT(depthCount, 100);
    EXPECT_GT(improvedCount, 100);
}

TEST(Penetration, MatchesOracleWithinTenThousandthInFloat)
{
    expectGood(checkDepths<float>(false, 0.0, 6000, 31), 1e-4, "regular");
    expectGood(checkDepths<float>(true, 0.0, 6000, 32), 1e-4, "thin");
}

TEST(Penetration, MatchesOracleWithinFewRoundingsInDouble)
{
    expectGood(checkDepths<double>(false, 0.0, 2000, 33), 1e-12, "regular");
    expectGood(checkDepths<double>(true, 0.0, 2000, 34), 1e-12, "thin");
}
}  // namespace
}  // namespace cullet::test
