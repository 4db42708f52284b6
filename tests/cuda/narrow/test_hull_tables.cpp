// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Hulls in the form of a device, and the bounds of rounding errors on which its proofs stand.

#include "cullet/cuda/narrow/closest_point.h"
#include "cullet/cuda/narrow/hull_set.h"
#include "cullet/cuda/narrow/hull_view.h"
#include "cullet/cuda/narrow/pair_heights.h"
#include "cullet/cuda/narrow/posed_pair.h"
#include "cullet/tests/cuda/support/convex_check.h"
#include "cullet/tests/cuda/support/convex_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
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
using convex::HullView;
using convex::PosedPair;
using convex::Vec;

/// Directions to every side, and those along which faces and edges of aligned shapes are level.
std::vector<Eigen::Vector3f> directions(std::mt19937& engine)
{
    std::vector<Eigen::Vector3f> all;
    for (int i = 0; i < 27; ++i)
    {
        const Eigen::Vector3f d(float(i % 3 - 1), float(i / 3 % 3 - 1), float(i / 9 - 1));
        if (!d.isZero(0.0f))
            all.push_back(d);
    }
    for (int i = 0; i < 500; ++i)
        all.push_back(randomDirection(engine).cast<float>());
    return all;
}

/// The first vertex with the largest product, rounded as a device does.
template <class T>
convex::Support<T> highestOf(const Hull<float>& hull, const Vec<T>& d)
{
    convex::Support<T> best = {0, -std::numeric_limits<T>::infinity()};
    for (std::int32_t i = 0; i < hull.vertexCount(); ++i)
    {
        const T height = dot(Vec<T>{T(hull.x()[i]), T(hull.y()[i]), T(hull.z()[i])}, d);
        if (height > best.height)
            best = {i, height};
    }
    return best;
}

TEST(HullTables, HaveFacesAndEdgesOfHulls)
{
    HullSet set;
    std::vector<Hull<float>> hulls;
    for (const NamedPoints& shape : nastyShapes())
    {
        hulls.push_back(hullOf<float>(shape.points));
        set.add(hulls.back());
    }
    const convex::SurfaceTables tables = set.surfaces();
    for (std::uint32_t i = 0; i < set.size(); ++i)
    {
        const Hull<float>& hull = hulls[i].corners();
        const convex::SurfaceRow& row = tables.rows[i];
        ASSERT_EQ(row.faces, hull.faces().size());
        for (std::uint32_t f = 0; f < row.faces; ++f)
        {
            const convex::HullFace& face = tables.faces[row.firstFace + f];
            const auto corners = hull.faceVertices(static_cast<std::int32_t>(f));
            EXPECT_TRUE(std::equal(corners.begin(), corners.end(), tables.corners + face.first,
                                   tables.corners + face.first + face.count));
            EXPECT_EQ(face.normal[1], static_cast<float>(hull.faces()[f].normal[1]));
        }
        ASSERT_EQ(row.edges, hull.edges().size() + (hull.kind() == HullKind::Segment ? 1 : 0));
        for (std::size_t e = 0; e < hull.edges().size(); ++e)
        {
            const convex::HullEdge& edge = tables.edges[row.firstEdge + e];
            EXPECT_EQ(static_cast<std::int32_t>(edge.from), hull.edges()[e].from);
            EXPECT_EQ(static_cast<std::int32_t>(edge.right), hull.edges()[e].right);
        }
        for (std::int32_t v = 0; row.faces > 0 && v < hull.vertexCount(); ++v)
        {
            const std::uint32_t* const around = tables.around + row.firstVertex + v;
            const auto faces = hull.facesOf(v);
            EXPECT_TRUE(std::equal(faces.begin(), faces.end(), tables.vertexFaces + around[0],
                                   tables.vertexFaces + around[1]));
        }
    }
}

TEST(HullTables, GiveSupportsOfScanFromAnyStart)
{
    std::mt19937 engine(50);
    HullSet set;
    std::vector<Hull<float>> hulls;
    for (const NamedPoints& shape : nastyShapes())
    {
        hulls.push_back(hullOf<float>(shape.points));
        ASSERT_EQ(set.add(hulls.back()), hulls.size() - 1);
    }
    ASSERT_EQ(set.size(), hulls.size());
    const convex::HullTables tables = set.tables();
    for (std::uint32_t i = 0; i < set.size(); ++i)
    {
        const Hull<float>& hull = hulls[i].corners();
        const HullView view(tables, i);
        ASSERT_EQ(view.vertexCount(), hull.vertexCount());
        EXPECT_EQ(view.reach(), hull.reach());
        for (const Eigen::Vector3f& d : directions(engine))
        {
            const convex::Support<float> expected = highestOf<float>(hull, {d[0], d[1], d[2]});
            for (const std::int32_t start : {-1, 0, hull.vertexCount() - 1, hull.vertexCount()})
            {
                const convex::Support<float> found = view.support(Vec<float>{d[0], d[1], d[2]}, start);
                ASSERT_EQ(found.vertex, expected.vertex) << "hull " << i;
                ASSERT_EQ(found.height, expected.height);
            }
        }
    }
}

/// Unit normals of the faces, each tilted by nothing and by up to 1e-3.
std::vector<Vec<double>> levelDirections(const Hull<float>& hull, std::mt19937& engine)
{
    std::vector<Vec<double>> all;
    for (const auto& face : hull.faces())
    {
        const Eigen::Vector3d normal =
            Eigen::Vector3d(face.normal[0], face.normal[1], face.normal[2]).normalized();
        for (const double tilt : {0.0, 1e-12, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-3})
        {
            const Eigen::Vector3d d = (normal + tilt * randomDirection(engine)).normalized();
            all.push_back({d[0], d[1], d[2]});
        }
    }
    return all;
}

TEST(HullTables, GiveSupportsOfScanInDoubleNearNormalsOfFaces)
{
    const unsigned seed = 53;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 engine(seed);
    int asked = 0, undecidedInFloat = 0;
    for (const NamedPoints& shape : nastyShapes())
    {
        HullSet set;
        const Hull<float> hull = hullOf<float>(shape.points);
        set.add(hull);
        const convex::HullTables tables = set.tables();
        const HullView view(tables, 0);
        for (const Vec<double>& d : levelDirections(hull.corners(), engine))
        {
            const convex::Support<double> expected = highestOf<double>(hull.corners(), d);
            const Vec<float> rounded = {float(d.x), float(d.y), float(d.z)};
            undecidedInFloat += highestOf<float>(hull.corners(), rounded).vertex != expected.vertex;
            ++asked;
            for (const std::int32_t start : {-1, 0, hull.corners().vertexCount() - 1})
            {
                const convex::Support<double> found = view.support(d, start);
                ASSERT_EQ(found.vertex, expected.vertex) << shape.name;
                ASSERT_EQ(found.height, expected.height) << shape.name;
            }
        }
    }
    EXPECT_GT(undecidedInFloat, asked / 50);
    EXPECT_LT(undecidedInFloat, asked * 9 / 10);
}

TEST(HullTables, HaveOneBlockForEachVertexAndEverySevenNeighbours)
{
    HullSet set;
    set.add(hullOf<float>(icoPoints(1)));
    EXPECT_EQ(set.blockCount(), 42u);
    set.add(hullOf<float>(prismPoints(32, 0.5)));
    EXPECT_GE(set.blockCount(), 42u + 64u);
    set.add(Hull<float>());
    EXPECT_EQ(set.tables().rows[2].count, 0u);
    HullSet moved = std::move(set);
    EXPECT_EQ(moved.size(), 3u);
}

/// What a test in float says of an axis and a point, against long double; the largest errors in units of the bound.
struct ErrorShares
{
    double ofAxis = 0.0, ofPoint = 0.0;
};

void measure(const ConvexScene& scene, RowPair pair, const Eigen::Vector3d& direction, ErrorShares& shares)
{
    const BodyPose &poseA = scene.poses[pair.a], &poseB = scene.poses[pair.b];
    const convex::HullTables tables = scene.set.tables();
    const PosedPair<float> posed(HullView(tables, poseA.hull), HullView(tables, poseB.hull), poseA, poseB);
    const Eigen::Vector3f v = direction.cast<float>();
    const auto test = posed.test(Vec<float>{v[0], v[1], v[2]}, {-1, -1});
    const PosedHull<double> a = scene.posed(pair.a), b = scene.posed(pair.b);
    PairAxis axis = {{v[0], v[1], v[2]}, 0};
    const double alongError = std::abs(double(gapAlong(a, b, axis)) - double(test.along));
    const Vec<float> point = posed.point(test.ids);
    const Eigen::Vector3d exact = a.point(test.ids.a) + a.origin() - b.point(test.ids.b) - b.origin();
    const double pointError = (exact - Eigen::Vector3d(point.x, point.y, point.z)).norm();
    shares.ofAxis = std::max(shares.ofAxis, alongError / double(posed.error()));
    shares.ofPoint = std::max(shares.ofPoint, pointError / double(posed.error()));
}

TEST(ConvexPairErrors, StayBelowTheirBounds)
{
    const unsigned seed = 51;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 engine(seed);
    for (const ConvexKind kind : kConvexKinds)
    {
        const ConvexScene scene(kind, 4000, seed);
        ErrorShares shares;
        for (const RowPair& pair : scene.pairs)
            measure(scene, pair, randomDirection(engine), shares);
        EXPECT_LT(shares.ofAxis, 1.0);
        EXPECT_LT(shares.ofPoint, 1.0);
        // A bound that no error comes near would send too many pairs to the search in double.
        EXPECT_GT(shares.ofAxis, 0.01);
        EXPECT_GT(shares.ofPoint, 0.01);
    }
}

/// Pairs and directions, the heights of which bound those of later directions.
struct HeightTally
{
    int known = 0, below = 0, tight = 0;
};

/// Turns both directions by about that angle from known ones, and compares the bound with the largest products.
void compareHeights(const ConvexScene& scene, RowPair pair, double angle, std::mt19937& engine,
                    HeightTally& tally)
{
    const convex::HullTables tables = scene.set.tables();
    const auto sideOf = [&](std::uint32_t body, const Eigen::Vector3d& d) -> convex::HullSide<float>
    {
        const Eigen::Vector3f v = d.cast<float>();
        return {HullView(tables, scene.poses[body].hull), {v[0], v[1], v[2]}, -1};
    };
    const auto heightOf = [](const convex::HullSide<float>& side)
    {
        const Vec<double> d = {double(side.direction.x), double(side.direction.y), double(side.direction.z)};
        return side.hull.support(d, -1).height;
    };
    const Eigen::Vector3d a = randomDirection(engine), b = randomDirection(engine);
    const convex::HullSide<float> oldA = sideOf(pair.a, a), oldB = sideOf(pair.b, b);
    const convex::PairHeights known = heightsOf(oldA, oldB, oldA.support().height + oldB.support().height);
    const convex::HullSide<float> newA = sideOf(pair.a, (a + angle * randomDirection(engine)).normalized()),
                                  newB = sideOf(pair.b, (b + angle * randomDirection(engine)).normalized());
    const double reach = double(newA.hull.reach()) + double(newB.hull.reach());
    const double bound = double(mostHeights(known, newA, newB)), exact = heightOf(newA) + heightOf(newB);
    ++tally.known;
    // What PosedPair::error() and half of it leave to these sums.
    tally.below += bound < exact - 84.0 * 0x1p-24 * reach;
    tally.tight += bound < exact + (2.0 * angle + 1e-3) * reach;
}

TEST(PairHeights, BoundHeightsOfAllDirections)
{
    const unsigned seed = 52;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 engine(seed);
    const ConvexScene scene(ConvexKind::Regular, 4000, seed);
    for (const double angle : {0.0, 1e-6, 1e-4, 1e-2, 1.0})
    {
        HeightTally tally;
        for (const RowPair& pair : scene.pairs)
            compareHeights(scene, pair, angle, engine, tally);
        EXPECT_EQ(tally.known, 4000);
        EXPECT_EQ(tally.below, 0) << angle;
        // A loose bound would prove nothing.
        EXPECT_GT(tally.tight, 3990) << angle;
    }
}

TEST(PairHeights, KnowNothingOfOtherHulls)
{
    const ConvexScene scene(ConvexKind::Regular, 1, 53);
    const convex::HullTables tables = scene.set.tables();
    const auto sideOf = [&](std::uint32_t hull) -> convex::HullSide<float> {
        return {HullView(tables, hull), {0.0f, 0.0f, 1.0f}, -1};
    };
    const convex::PairHeights known = heightsOf(sideOf(1), sideOf(2), 0.0f);
    EXPECT_LT(mostHeights(known, sideOf(1), sideOf(2)), 1e-3f);
    EXPECT_EQ(mostHeights(known, sideOf(2), sideOf(1)), INFINITY);
    EXPECT_EQ(mostHeights(known, sideOf(1), sideOf(0)), INFINITY);
    EXPECT_EQ(mostHeights({}, sideOf(0), sideOf(0)), INFINITY);
    const convex::HullRow row = tables.rows[0];
    const HullView last(tables, 0xfffe, row), beyond(tables, 0xffff, row);
    EXPECT_NE(keyOf(last, last), 0u);
    EXPECT_EQ(keyOf(last, beyond), 0u);
    EXPECT_EQ(keyOf(beyond, last), 0u);
}

TEST(PairHeights, KeepDirectionsWithinTenThousandth)
{
    const unsigned seed = 54;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 engine(seed);
    for (const Eigen::Vector3f& direction : directions(engine))
    {
        const Eigen::Vector3f unit = direction.normalized();
        const Vec<float> kept = convex::directionOf(convex::codeOf({unit[0], unit[1], unit[2]}));
        EXPECT_LT((Eigen::Vector3f(kept.x, kept.y, kept.z) - unit).norm(), 1e-4f) << unit.transpose();
    }
}

/// A tetrahedron one face of which is at that height above the origin, below it where negative.
void makeTetrahedron(double height, std::mt19937& engine, Eigen::Vector3d (&p)[4])
{
    const Eigen::Matrix3d turn = randomRotation(engine);
    std::uniform_real_distribution<double> any(0.2, 1.0);
    p[0] = turn * Eigen::Vector3d(-any(engine), -any(engine), height);
    p[1] = turn * Eigen::Vector3d(any(engine), -any(engine), height);
    p[2] = turn * Eigen::Vector3d(0.0, any(engine), height);
    p[3] = turn * Eigen::Vector3d(0.0, 0.0, -any(engine));
}

TEST(SureTetrahedron, ContainsOriginForAllPointsWithinError)
{
    std::mt19937 engine(52);
    int sure = 0, count = 0;
    for (const float error : {1e-6f, 1e-4f})
    {
        for (int i = 0; i < 20000; ++i, ++count)
        {
            Eigen::Vector3d p[4];
            const double height = std::uniform_real_distribution<double>(-1.0, 10.0)(engine) * error;
            makeTetrahedron(height, engine, p);
            Vec<float> rounded[4];
            for (int k = 0; k < 4; ++k)
                rounded[k] = {float(p[k][0]), float(p[k][1]), float(p[k][2])};
            const bool isSure = isSurelyInside(rounded, error);
            sure += isSure;
            // Moved by the error, the first three points leave the origin outside of their face.
            EXPECT_FALSE(isSure && height < 0.99 * error) << height << " " << error;
        }
    }
    EXPECT_GT(sure, count / 20);
    EXPECT_LT(sure, count * 9 / 10);
}
}  // namespace
}  // namespace cullet::test
