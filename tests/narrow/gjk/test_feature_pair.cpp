// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/hull_pairs.h"
#include "cullet/narrow/epa/epa.h"
#include "cullet/narrow/epa/exact_penetration.h"
#include "cullet/narrow/gjk/bent_face.h"
#include "cullet/narrow/gjk/feature_pair.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
VertexPairs rotated(const VertexPairs& pairs)
{
    VertexPairs other = pairs;
    std::rotate(other.a.begin(), other.a.begin() + 1, other.a.begin() + pairs.count);
    std::rotate(other.b.begin(), other.b.begin() + 1, other.b.begin() + pairs.count);
    return other;
}

/// Distance from a shape to a point, relative to the shape's origin.
template <class S>
double distanceTo(const PosedHull<S>& shape, const Eigen::Vector3d& point)
{
    const Hull<S> hull = hullOf<S>({point});
    const Eigen::Matrix<S, 3, 3> identity = Eigen::Matrix<S, 3, 3>::Identity();
    const PosedHull<S> posed(hull, identity, shape.origin().template cast<S>());
    GjkCache<S> cache;
    const GjkResult<S> result = gjkDistance(posed, shape, std::numeric_limits<S>::infinity(), cache);
    return result.state == GjkState::Near ? double(result.distance) : 0.0;
}

template <class S>
class FeaturePairTest : public testing::Test
{
};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(FeaturePairTest, Scalars);

/// Visits every pair of shapes at random poses with a gap.
template <class S, class Visit>
void forNearPairs(unsigned seed, double gap, const Visit& visit)
{
    std::mt19937 engine(seed);
    const std::vector<NamedPoints> shapes = queryShapes();
    std::vector<Hull<S>> hulls;
    for (const NamedPoints& shape : shapes)
        hulls.push_back(hullOf<S>(shape.points));
    for (std::size_t i = 0; i < hulls.size(); ++i)
    {
        for (std::size_t j = 0; j < hulls.size(); ++j)
        {
            for (int k = 0; k < 20; ++k)
            {
                const PairScene<S> scene = randomPair(hulls[i], hulls[j], gap, 2.0, engine);
                SCOPED_TRACE(shapes[i].name + " " + shapes[j].name + " seed " + std::to_string(seed));
                visit(scene);
            }
        }
    }
}

TYPED_TEST(FeaturePairTest, GivesSameDistanceAsGjk)
{
    using S = TypeParam;
    int solved = 0, asked = 0;
    std::array<int, 4> kinds = {};
    forNearPairs<S>(11, 0.1,
                    [&](const auto& scene)
                    {
                        const PosedHull<S> a = scene.posedA(), b = scene.posedB();
                        GjkCache<S> cache;
                        const GjkResult<S> near =
                            gjkDistance(a, b, std::numeric_limits<S>::infinity(), cache);
                        if (near.state != GjkState::Near)
                            return;
                        ++asked;
                        FeaturePair<S> pair(a, b);
                        if (!pair.solve(pairsOf(cache), near.axis.template cast<double>(), false))
                            return;
                        ++solved;
                        ++kinds[static_cast<std::size_t>(cache.count)];
                        const double size = double(a.size() + b.size());
                        const double tolerance = (sizeof(S) == sizeof(float) ? 1e-6 : 1e-13) * size;
                        EXPECT_NEAR(pair.distance(), double(near.distance), tolerance);
                        EXPECT_NEAR((pair.normal() - near.axis.template cast<double>()).norm(), 0.0,
                                    tolerance / pair.distance());
                        EXPECT_NEAR(pair.normal().norm(), 1.0, 1e-14);
                        // For level faces, other points are as close.
                        const Eigen::Vector3d onA = pair.pointOfB() + pair.distance() * pair.normal();
                        EXPECT_LE(distanceTo(a, onA), 1e-6 * size);
                        EXPECT_LE(distanceTo(b, pair.pointOfB() - (b.origin() - a.origin())), 1e-6 * size);
                    });
    EXPECT_GT(asked, 1000);
    EXPECT_GT(solved, asked * 9 / 10);
    for (int count = 1; count <= 3; ++count)
        EXPECT_GT(kinds[static_cast<std::size_t>(count)], 20) << count;
}

/// The order of vertices and the path of the search have no effect.
TYPED_TEST(FeaturePairTest, GivesSameBitsHoweverFeaturesWereFound)
{
    using S = TypeParam;
    int compared = 0;
    forNearPairs<S>(12, 0.05,
                    [&](const auto& scene)
                    {
                        const PosedHull<S> a = scene.posedA(), b = scene.posedB();
                        GjkCache<S> cache, other;
                        NoObserver observer;
                        const GjkResult<S> near =
                            gjkDistance(a, b, std::numeric_limits<S>::infinity(), cache);
                        const GjkResult<S> again = gjkDistance(a, b, std::numeric_limits<S>::infinity(),
                                                               other, observer, GjkStart::FourDirections);
                        if (near.state != GjkState::Near || again.state != GjkState::Near)
                            return;
                        FeaturePair<S> first(a, b), second(a, b), third(a, b);
                        const Eigen::Vector3d axis = near.axis.template cast<double>();
                        if (!first.solve(pairsOf(cache), axis, false))
                            return;
                        ASSERT_TRUE(second.solve(rotated(pairsOf(cache)), 3.0 * axis, false));
                        EXPECT_EQ(first.normal(), second.normal());
                        EXPECT_EQ(first.distance(), second.distance());
                        EXPECT_EQ(first.pointOfB(), second.pointOfB());
                        EXPECT_EQ(first.vertexA(), second.vertexA());
                        if (!third.solve(pairsOf(other), axis, false))
                            return;
                        ++compared;
                        EXPECT_EQ(first.normal(), third.normal());
                        EXPECT_EQ(first.distance(), third.distance());
                        EXPECT_EQ(first.pointOfB(), third.pointOfB());
                        EXPECT_EQ(first.vertexB(), third.vertexB());
                    });
    EXPECT_GT(compared, 1000);
}

/// The lowest vertex over a nearly level face is found from vertices of other poses, and has the same bits from all of them.
TYPED_TEST(FeaturePairTest, FindsLowestVertexOverFaceFromAnyVertexOfIt)
{
    using S = TypeParam;
    constexpr unsigned kSeed = 41;
    std::mt19937 engine(kSeed);
    const Hull<S> slab = hullOf<S>(boxPoints(5.0, 5.0, 1.0));
    const PosedHull<S> b(slab, Eigen::Matrix<S, 3, 3>::Identity(), Eigen::Matrix<S, 3, 1>::Zero());
    int asked = 0, solved = 0;
    for (const NamedPoints& shape : queryShapes())
    {
        const Hull<S> hull = hullOf<S>(shape.points);
        if (hull.kind() != HullKind::Solid || hull.vertexCount() > FeatureSide<S>::kMostScanned)
            continue;
        for (const double tilt : {0.02, 1e-4, 1e-7, 1e-9, 3e-10, 1e-11, 1e-13, 0.0})
        {
            SCOPED_TRACE(testing::Message() << shape.name << " seed " << kSeed << " tilt " << tilt);
            const Eigen::Matrix3d turn =
                Eigen::AngleAxisd(tilt, Eigen::Vector3d(0.6, 0.8, 0.0)).toRotationMatrix();
            const Eigen::Matrix<S, 3, 3> basis = turn.template cast<S>();
            const PosedHull<S> low(hull, basis, Eigen::Matrix<S, 3, 1>::Zero());
            double lowest = 0.0;
            for (std::int32_t v = 0; v < hull.vertexCount(); ++v)
                lowest = std::min(lowest, low.point(v).z());
            const PosedHull<S> a(hull, basis, Eigen::Matrix<S, 3, 1>(S(0.1), S(-0.2), S(1.1 - lowest)));
            const double gap = a.origin().z() + lowest - b.point(0).cwiseAbs().z();
            if (low.point(0).norm() > 4.0)
                continue;
            FeaturePair<S> first(a, b);
            bool isFirst = true;
            for (std::int32_t vertexB = 0; vertexB < 8; ++vertexB)
            {
                if (b.point(vertexB).z() < 0.0)
                    continue;
                ++asked;
                const auto vertexA = static_cast<std::int32_t>(engine() % unsigned(hull.vertexCount()));
                FeaturePair<S> pair(a, b);
                if (!pair.solveNearFaces(vertexA, vertexB, {0.01, 0.0, 2.0}, vertexB % 2 == 0))
                    continue;
                ++solved;
                EXPECT_NEAR(pair.distance(), gap, 1e-12);
                EXPECT_LT((pair.normal() - Eigen::Vector3d(0.0, 0.0, 1.0)).norm(), 1e-12);
                if (isFirst)
                    first.solveNearFaces(vertexA, vertexB, {0.0, 0.0, 1.0}, false);
                isFirst = false;
                EXPECT_EQ(pair.distance(), first.distance());
                EXPECT_EQ(pair.pointOfB(), first.pointOfB());
                EXPECT_EQ(pair.vertexA(), first.vertexA());
            }
        }
    }
    EXPECT_GT(asked, 200);
    EXPECT_GT(solved, asked * 9 / 10);
}

/// All bounds are relative, so a power of two changes no digit.
TYPED_TEST(FeaturePairTest, ScalesWithShapesByPowersOfTwoBitByBit)
{
    using S = TypeParam;
    constexpr unsigned kSeed = 17;
    std::vector<NamedPoints> shapes = queryShapes();
    shapes.push_back({"square", {{1, 1, 0}, {1, -1, 0}, {-1, -1, 0}, {-1, 1, 0}}});
    shapes.push_back({"pentagon", moved(prismPoints(5, 0.0), Eigen::Matrix3d::Identity(), {0.3, 0.2, 0.1})});
    const Points box = boxPoints(0.6, 0.5, 0.7);
    const Hull<S> hullB = hullOf<S>(box);
    std::array<int, 2> solved = {};
    int flat = 0;
    for (const double size : {std::ldexp(1.0, -20), std::ldexp(1.0, 20)})
    {
        std::mt19937 engine(kSeed);
        const Hull<S> sizedHullB = hullOf<S>(scaled(box, size));
        for (const NamedPoints& shape : shapes)
        {
            const Hull<S> hullA = hullOf<S>(shape.points), sizedHullA = hullOf<S>(scaled(shape.points, size));
            for (int i = 0; i < 60; ++i)
            {
                SCOPED_TRACE(testing::Message()
                             << shape.name << " seed " << kSeed << " pose " << i << " size " << size);
                PairScene<S> scene = randomPair(hullA, hullB, 0.1, 2.0, engine);
                GjkCache<S> cache;
                const GjkResult<S> near =
                    gjkDistance(scene.posedA(), scene.posedB(), std::numeric_limits<S>::infinity(), cache);
                if (near.state != GjkState::Near)
                    continue;
                const Eigen::Vector3d about = near.axis.template cast<double>();
                const bool isDeep = i % 2 != 0;
                if (isDeep)
                    scene.a.origin -= near.axis * (near.distance + S(0.01));
                PairScene<S> sized = scene;
                sized.hullA = &sizedHullA;
                sized.hullB = &sizedHullB;
                sized.a.origin *= S(size);
                sized.b.origin *= S(size);
                const PosedHull<S> a = scene.posedA(), b = scene.posedB();
                const PosedHull<S> sizedA = sized.posedA(), sizedB = sized.posedB();
                FeaturePair<S> pair(a, b), sizedPair(sizedA, sizedB);
                const bool isSolved = pair.solve(pairsOf(cache), about, isDeep);
                ASSERT_EQ(sizedPair.solve(pairsOf(cache), about, isDeep), isSolved);
                if (!isSolved)
                    continue;
                ++solved[isDeep ? 1 : 0];
                flat += hullA.kind() == HullKind::Polygon ? 1 : 0;
                EXPECT_EQ(sizedPair.distance(), size * pair.distance());
                EXPECT_EQ(sizedPair.normal(), pair.normal());
                EXPECT_EQ(sizedPair.pointOfB(), size * pair.pointOfB());
            }
        }
    }
    EXPECT_GT(solved[0], 300);
    EXPECT_GT(solved[1], 100);
    EXPECT_GT(flat, 50);
}

/// The closest features of an earlier pose are accepted only while they are the closest.
TYPED_TEST(FeaturePairTest, RefusesFeaturesThatAreNotTheClosest)
{
    using S = TypeParam;
    int refused = 0, taken = 0;
    std::mt19937 turns(13);
    forNearPairs<S>(
        13, 0.1,
        [&](const auto& scene)
        {
            const PosedHull<S> a = scene.posedA(), b = scene.posedB();
            GjkCache<S> cache;
            const GjkResult<S> near = gjkDistance(a, b, std::numeric_limits<S>::infinity(), cache);
            auto moved = scene;
            perturb(moved, 0.02, turns);
            const PosedHull<S> toA = moved.posedA(), toB = moved.posedB();
            GjkCache<S> fresh;
            const GjkResult<S> truth = gjkDistance(toA, toB, std::numeric_limits<S>::infinity(), fresh);
            FeaturePair<S> pair(toA, toB);
            if (near.state != GjkState::Near || truth.state != GjkState::Near)
                return;
            if (!pair.solve(pairsOf(cache), near.axis.template cast<double>(), false))
            {
                ++refused;
                return;
            }
            ++taken;
            const double size = double(toA.size() + toB.size());
            EXPECT_NEAR(pair.distance(), double(truth.distance),
                        (sizeof(S) == sizeof(float) ? 1e-6 : 1e-13) * size);
        });
    EXPECT_GT(refused, 500);
    EXPECT_GT(taken, 500);
}

/// Corners of a rotated box are rounded, so that hardly four are coplanar.
TYPED_TEST(FeaturePairTest, SolvesFacesWhoseCornersAreRounded)
{
    using S = TypeParam;
    std::mt19937 engine(15);
    int settled = 0, asked = 0;
    for (int i = 0; i < 300; ++i)
    {
        const Hull<S> box =
            hullOf<S>(moved(boxPoints(0.7, 0.5, 0.6), randomRotation(engine), {0.0, 0.0, 0.0}));
        const Hull<S> other = hullOf<S>(icoPoints(1));
        const PairScene<S> scene = randomPair(box, other, 0.1, 2.0, engine);
        const PosedHull<S> a = scene.posedA(), b = scene.posedB();
        GjkCache<S> cache;
        const GjkResult<S> near = gjkDistance(a, b, std::numeric_limits<S>::infinity(), cache);
        ASSERT_EQ(near.state, GjkState::Near);
        if (cache.count != 3)
            continue;
        ++asked;
        FeaturePair<S> pair(a, b);
        settled += pair.solve(pairsOf(cache), near.axis.template cast<double>(), false) ? 1 : 0;
    }
    EXPECT_GT(asked, 50);
    EXPECT_GT(settled, asked * 9 / 10);
}

/// For any two or three corners of the face at which a search has ended.
TYPED_TEST(FeaturePairTest, GivesTheSameBitsForAVertexOverADiagonal)
{
    using S = TypeParam;
    using Matrix = Eigen::Matrix<S, 3, 3>;
    const Hull<S> box = hullOf<S>(boxPoints(1.0, 1.0, 1.0));
    const Hull<S> tip = hullOf<S>({{0, -1, 0}, {1, 1, 0}, {-1, 1, 1}, {-1, 1, -1}});
    const PosedHull<S> a(tip, Matrix::Identity(), {0, S(2.1), 0}), b(box, Matrix::Identity(), {0, 0, 0});
    // Two corners of the top, one opposite to the other.
    const auto cornerAt = [&box](double x, double z) {
        return supportLinear<S>(box, {static_cast<S>(x), S(3), static_cast<S>(z)});
    };
    const std::int32_t lowest = a.support({0, -1, 0}, -1).vertex;
    VertexPairs diagonal;
    diagonal.count = 2;
    diagonal.a = {lowest, lowest, lowest};
    diagonal.b = {cornerAt(1, 1), cornerAt(-1, -1), -1};
    FeaturePair<S> pair(a, b);
    ASSERT_TRUE(pair.solve(diagonal, {0.0, 0.3, 0.0}, false));
    EXPECT_NEAR(pair.distance(), 0.1, 1e-6);
    EXPECT_EQ(pair.normal(), Eigen::Vector3d(0, 1, 0));
    EXPECT_EQ(pair.vertexA(), lowest);
    VertexPairs three = diagonal, other = diagonal;
    three.count = 3;
    three.b[2] = cornerAt(1, -1);
    other.b = {cornerAt(1, -1), cornerAt(-1, 1), -1};
    for (const VertexPairs& pairs : {three, other})
    {
        FeaturePair<S> again(a, b);
        ASSERT_TRUE(again.solve(pairs, {0.0, 0.3, 0.0}, false));
        EXPECT_EQ(again.distance(), pair.distance());
        EXPECT_EQ(again.normal(), pair.normal());
        EXPECT_EQ(again.pointOfB(), pair.pointOfB());
        EXPECT_EQ(again.vertexB(), pair.vertexB());
    }
}

/// From whichever side, and however exactly, the axis of a search comes.
TYPED_TEST(FeaturePairTest, GivesTheSameBitsWhereAScaleOfZeroFlattensAFlatHull)
{
    using S = TypeParam;
    std::mt19937 engine(16);
    std::uniform_int_distribution<int> eighth(-8, 8);
    std::uniform_real_distribution<double> noise(-1.0, 1.0);
    int solved = 0, turned = 0;
    for (int i = 0; i < 400; ++i)
    {
        // In one plane, exactly.
        std::vector<Eigen::Vector3d> points = {{-1, -0.25, -1}, {1, 0.75, -1}, {0, -0.25, 1}};
        for (int k = 0; k < 6; ++k)
        {
            const double x = eighth(engine) / 8.0, z = eighth(engine) / 8.0;
            points.push_back({x, 0.5 * x - 0.25 * z, z});
        }
        const Hull<S> plane = hullOf<S>(points), tip = hullOf<S>({{0, 0, 0}});
        ASSERT_EQ(plane.kind(), HullKind::Polygon);
        const Eigen::Matrix3d turn = randomRotation(engine);
        const Eigen::Matrix3d basis = turn * Eigen::Vector3d(30, 0, 1).asDiagonal();
        const Eigen::Vector3d up = turn * Eigen::Vector3d(0, i % 2 == 0 ? 1 : -1, 0);
        const Eigen::Matrix<S, 3, 1> over = (0.3 * up).template cast<S>();
        const PosedHull<S> a(plane, basis.cast<S>(), Eigen::Matrix<S, 3, 1>::Zero());
        const PosedHull<S> b(tip, Eigen::Matrix<S, 3, 3>::Identity(), over);
        VertexPairs pairs;
        pairs.count = 3;
        pairs.a = {0, 1, 2};
        pairs.b = {0, 0, 0};
        FeaturePair<S> first(a, b);
        if (!first.solve(pairs, -up, false))
            continue;
        ++solved;
        EXPECT_NEAR(first.distance(), 0.3, 1e-5);
        for (int k = 0; k < 8; ++k)
        {
            Eigen::Vector3d about = -0.7 * up;
            for (int axis = 0; axis < 3; ++axis)
                about[axis] += 1e-7 * noise(engine);
            const Eigen::Vector3d normal = plane.faces()[0].normal;
            turned += (basis.transpose() * about).dot(normal) < 0.0;
            FeaturePair<S> again(a, b);
            ASSERT_TRUE(again.solve(pairs, about, false)) << i;
            EXPECT_EQ(again.distance(), first.distance()) << i;
            EXPECT_EQ(again.normal(), first.normal()) << i;
            EXPECT_EQ(again.pointOfB(), first.pointOfB()) << i;
            EXPECT_EQ(again.vertexA(), first.vertexA()) << i;
        }
    }
    EXPECT_GT(solved, 200);
    // Rounding alone decides to which of both faces a direction points.
    EXPECT_GT(turned, solved);
    EXPECT_LT(turned, 7 * solved);
}

TYPED_TEST(FeaturePairTest, SolvesMostDepthsExactly)
{
    using S = TypeParam;
    int settled = 0, asked = 0;
    forNearPairs<S>(14, -0.1,
                    [&](const auto& scene)
                    {
                        const PosedHull<S> a = scene.posedA(), b = scene.posedB();
                        if (a.vertexCount() > 50 || b.vertexCount() > 50)
                            return;
                        GjkCache<S> cache;
                        if (gjkDistance(a, b, S(1), cache).state != GjkState::Overlapping)
                            return;
                        ++asked;
                        const PenetrationResult<S> deep = penetration(a, b, cache);
                        Eigen::Vector3d normal;
                        double depth;
                        if (deep.state != GjkState::Overlapping || !deep.isSettled ||
                            !exactPenetration(a, b, normal, depth))
                            return;
                        ++settled;
                        const double size = double(a.size() + b.size());
                        EXPECT_NEAR(double(deep.depth), depth,
                                    (sizeof(S) == sizeof(float) ? 1e-6 : 1e-12) * size);
                    });
    EXPECT_GT(asked, 300);
    EXPECT_GT(settled, asked * 8 / 10);
}

/// A ridge of half length `length` along x, whose hull lies above it, and its ends.
Points ridge(double length, double width)
{
    return {{-length, 0, 0},        {length, 0, 0},           {-length, width, width},
            {length, width, width}, {-length, -width, width}, {length, -width, width}};
}

/// The edges' directions decide whether they are parallel, not their lengths.
TYPED_TEST(FeaturePairTest, SolvesCrossingEdgesAtAnyLength)
{
    using S = TypeParam;
    for (const double lengthA : {1e-4, 1.0, 1e4})
    {
        for (const double lengthB : {1e-4, 1.0, 1e4})
        {
            SCOPED_TRACE(std::to_string(lengthA) + " across " + std::to_string(lengthB));
            const double gap = 0.1 * std::max(lengthA, lengthB);
            const Hull<S> hullA = hullOf<S>(ridge(lengthA, lengthA)),
                          hullB = hullOf<S>(ridge(lengthB, lengthB));
            // B's ridge is along y, and its hull below.
            Eigen::Matrix<S, 3, 3> turned = Eigen::Matrix<S, 3, 3>::Zero();
            turned(0, 1) = turned(1, 0) = S(1);
            turned(2, 2) = S(-1);
            const PosedHull<S> a(hullA, Eigen::Matrix<S, 3, 3>::Identity(), {0, 0, static_cast<S>(gap)});
            const PosedHull<S> b(hullB, turned, {0, 0, 0});
            VertexPairs pairs;
            pairs.count = 2;
            pairs.a = {a.support({-1, 0, -9}, -1).vertex, a.support({1, 0, -9}, -1).vertex, -1};
            pairs.b = {b.support({0, -1, 9}, -1).vertex, b.support({0, 1, 9}, -1).vertex, -1};
            FeaturePair<S> pair(a, b);
            ASSERT_TRUE(pair.solve(pairs, {0.0, 0.0, 1.0}, false));
            EXPECT_NEAR(pair.distance(), gap, 1e-6 * gap);
            EXPECT_NEAR((pair.normal() - Eigen::Vector3d::UnitZ()).norm(), 0.0, 1e-12);
            EXPECT_NEAR((pair.pointOfB() + gap * Eigen::Vector3d::UnitZ()).norm(), 0.0, 1e-6 * gap);
        }
    }
}

/// A polygon around the origin in a plane, whose corners are moved off it by up to a bend.
Points bentPolygon(int corners, double bend, std::mt19937& engine)
{
    std::uniform_real_distribution<double> part(0.1, 0.9), rise(-bend, bend);
    Points points;
    for (int i = 0; i < corners; ++i)
    {
        const double angle = 6.283 * (i + part(engine)) / corners;
        points.push_back({std::cos(angle), std::sin(angle), rise(engine)});
    }
    return points;
}

TEST(BentFace, HasItsHighestTriangleAroundThePlaceAndNoCornerAboveIt)
{
    constexpr unsigned kSeed = 43;
    constexpr double kLevel = 1e-9;
    std::mt19937 engine(kSeed);
    std::uniform_real_distribution<double> inside(-0.1, 0.1);
    int found = 0, notTheFirst = 0;
    for (int i = 0; i < 2000; ++i)
    {
        SCOPED_TRACE("seed " + std::to_string(kSeed) + ", face " + std::to_string(i));
        const int corners = 4 + i % 6;
        const Points points = bentPolygon(corners, 1e-3, engine);
        const auto point = [&](std::int32_t corner) -> Eigen::Vector3d { return points[corner]; };
        const double x = inside(engine), y = inside(engine);
        const Eigen::Vector3d normal = areaNormal(corners, point).normalized(), place(x, y, 0.5);
        std::array<std::int32_t, 3> three;
        if (!findHighestTriangle(corners, point, normal, place, kLevel, three))
            continue;
        ++found;
        const Eigen::Vector3d a = point(three[0]);
        const Eigen::Vector3d up = (point(three[1]) - a).cross(point(three[2]) - a).normalized();
        EXPECT_GT(up.dot(normal), 0.9);
        for (std::size_t k = 0; k < 3; ++k)
        {
            const Eigen::Vector3d from = point(three[k]), to = point(three[(k + 1) % 3]);
            EXPECT_GE(normal.dot((to - from).cross(place - from)), -1e-9) << "side " << k;
        }
        for (std::int32_t corner = 0; corner < corners; ++corner)
            EXPECT_LE(up.dot(point(corner) - a), kLevel) << "corner " << corner;
        notTheFirst += three != std::array<std::int32_t, 3>{0, 1, 2};
    }
    EXPECT_EQ(found, 2000);
    EXPECT_GT(notTheFirst, 1000);
}
}  // namespace
}  // namespace cullet::test
