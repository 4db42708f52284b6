// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/hull_pairs.h"
#include "cullet/narrow/epa/epa.h"
#include "cullet/narrow/epa/level_corner.h"
#include "cullet/narrow/epa/polytope.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/tests/narrow/any_pair.h"
#include "cullet/tests/narrow/epa/depth_check.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

/// The expanding surface around the origin, and its initial points.
namespace cullet::test
{
namespace
{
using Corners = Polytope::Corners;

/// @param faces an even number
Polytope surfaceOf(const Points& points, const std::vector<Corners>& faces)
{
    Polytope surface(1.0);
    for (const Eigen::Vector3d& point : points)
        surface.addVertex(point);
    for (std::size_t i = 0; i < faces.size(); i += 2)
        surface.addFaces({{faces[i], faces[i + 1]}}, 2);
    return surface;
}

/// Expects every edge to have one face on each side.
void expectClosed(const Polytope& surface)
{
    std::vector<std::pair<int, int>> edges;
    for (int i = 0; i < surface.faceCount(); ++i)
    {
        const Corners& c = surface.corners(i);
        for (std::size_t k = 0; k < 3; ++k)
            edges.emplace_back(c[k], c[(k + 1) % 3]);
    }
    std::sort(edges.begin(), edges.end());
    EXPECT_EQ(std::adjacent_find(edges.begin(), edges.end()), edges.end());
    for (const auto& [from, to] : edges)
        EXPECT_TRUE(std::binary_search(edges.begin(), edges.end(), std::pair<int, int>(to, from)));
}

/// Two pyramids on a triangle, without the part between the first side of the triangle and the line between the tips,
/// which is near the origin.
///
/// @param lift height of that side over the plane of the others
Polytope dentedSurface(double lift)
{
    const double half = std::sqrt(0.75);
    Points points = {{1, 0, lift}, {-0.5, half, lift}, {-0.5, -half, 0}, {0, 0, 1}, {0, 0, -1}};
    for (Eigen::Vector3d& point : points)
        point -= Eigen::Vector3d(-0.05, -half / 10, 0.0);
    return surfaceOf(points, {{0, 4, 3}, {3, 4, 1}, {1, 2, 3}, {4, 2, 1}, {3, 2, 0}, {0, 2, 4}});
}

TEST(Polytope, LiftsFaceOutOfDent)
{
    Polytope surface = dentedSurface(0.0);
    expectClosed(surface);
    const Polytope::Face dent = surface.closestFace();
    EXPECT_NEAR(dent.distance, std::sqrt(0.75) / 10, 1e-12);
    ASSERT_TRUE(surface.lift(dent));
    EXPECT_EQ(surface.faceCount(), 6);
    expectClosed(surface);
    const Polytope::Face closest = surface.closestFace();
    EXPECT_NEAR(closest.distance, 0.9 / std::sqrt(5.0), 1e-12);
    EXPECT_FALSE(surface.lift(closest));
    // The surface grows like one that was always convex.
    EXPECT_EQ(surface.add({3, 3, 0}), 5);
    EXPECT_TRUE(surface.isValid());
    expectClosed(surface);
}

void expectNoLift(Polytope& surface)
{
    expectClosed(surface);
    const Polytope::Face before = surface.closestFace();
    EXPECT_FALSE(surface.lift(before));
    expectClosed(surface);
    const Polytope::Face after = surface.closestFace();
    EXPECT_EQ(after.distance, before.distance);
    EXPECT_EQ(after.vertex, before.vertex);
}

TEST(Polytope, KeepsFaceWhenNewOnesWouldBeNearer)
{
    Polytope surface = dentedSurface(7.0);
    EXPECT_NEAR(surface.closestFace().distance, std::sqrt(0.75) / 10, 1e-12);
    expectNoLift(surface);
}

TEST(Polytope, RefusesLiftThatWouldMakeEdgeTwice)
{
    // A tetrahedron with a pit through its tip instead of a side: a flip of any edge of the pit would duplicate an edge
    // of its rim.
    Polytope surface = surfaceOf({{4, 0, 1}, {-2, 3, 1}, {-2, -3, 1}, {0, 0, -4}, {0, 0, -10}},
                                 {{0, 1, 4}, {1, 2, 4}, {2, 0, 4}, {1, 0, 3}, {2, 1, 3}, {0, 2, 3}});
    EXPECT_LT(surface.closestFace().distance, 0.0);
    expectNoLift(surface);
}

TEST(Polytope, TakesNoMorePointsWhenInvalid)
{
    Polytope surface(1.0);
    surface.setTetrahedron({{{-1, -1, -1}, {1, -1, -1}, {0, 1, -1}, {0, 0, 1}}});
    // The point is collinear with an edge: a face between them would be only rounding.
    EXPECT_EQ(surface.add({3, -1, -1 - 5e-13}), -1);
    EXPECT_FALSE(surface.isValid());
    EXPECT_EQ(surface.add({0, 0, 9}), -1);
    EXPECT_FALSE(surface.isValid());
}

TEST(Polytope, ClosesHoleWhenVertexIsRemoved)
{
    const auto tipped = []
    {
        return surfaceOf(
            {{2, 0, 1}, {0, 2, 1}, {-2, 0, 1}, {0, -2, 1}, {0, 0, 2}, {0, 0, -3}},
            {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}, {1, 0, 5}, {2, 1, 5}, {3, 2, 5}, {0, 3, 5}});
    };
    Polytope surface = tipped();
    expectClosed(surface);
    EXPECT_TRUE(surface.removeVertex(4, 0.99));
    EXPECT_EQ(surface.faceCount(), 6);
    expectClosed(surface);
    EXPECT_TRUE(surface.isValid());
    EXPECT_NEAR(surface.closestFace().distance, 1.0, 1e-12);
    // The hole would be closed nearer to the origin than asked.
    Polytope kept = tipped();
    EXPECT_FALSE(kept.removeVertex(4, 1.01));
    EXPECT_EQ(kept.faceCount(), 8);
    expectClosed(kept);
    EXPECT_TRUE(kept.isValid());
}

/// An upside-down pyramid, whose base is split into two triangles.
///
/// @param isSwapped the triangle with the foot of the origin comes first
Polytope pyramid(bool isSwapped)
{
    const std::vector<Corners> base = {{0, 1, 2}, {0, 2, 3}};
    return surfaceOf(
        {{-5, -10, 1}, {15, -10, 1}, {15, 10, 1}, {-5, 10, 1}, {5, 0, -20}},
        {base[isSwapped ? 1 : 0], base[isSwapped ? 0 : 1], {1, 0, 4}, {2, 1, 4}, {3, 2, 4}, {0, 3, 4}});
}

TEST(Polytope, FindsFootInFaceThatIsLevelWithClosestOne)
{
    const Corners withFoot = {0, 2, 3};
    int elsewhere = 0;
    for (const bool isSwapped : {false, true})
    {
        Polytope surface = pyramid(isSwapped);
        expectClosed(surface);
        const Polytope::Face closest = surface.closestFace();
        EXPECT_NEAR(closest.distance, 1.0, 1e-12);
        elsewhere += closest.vertex == withFoot ? 0 : 1;
        const Polytope::Foot foot = surface.footOf(closest, 1e-9);
        EXPECT_EQ(foot.vertex, withFoot);
        EXPECT_LT(foot.miss, 1e-12);
        EXPECT_NEAR(foot.weights.sum(), 1.0, 1e-12);
    }
    EXPECT_GT(elsewhere, 0);
}

/// The neighbour of the closest face rises from their common side, so that the surface has a dent there; the foot on the
/// plane of the closest face is beyond that side, under the neighbour.
TEST(Polytope, FindsFootInTheFaceByWhichTheRayLeaves)
{
    const Points points = {{-0.1, -10, 1}, {-0.1, 10, 1}, {-10, 0, 1},
                           {10, 0, 2.01},  {5, -15, -1},  {0, 0, -30}};
    const Corners lowest = {0, 1, 2}, neighbour = {0, 3, 1}, slope = {0, 4, 3};
    std::vector<Corners> faces = {lowest,    neighbour, slope,     {2, 1, 5},
                                  {0, 2, 5}, {1, 3, 5}, {4, 0, 5}, {3, 4, 5}};
    for (std::size_t i = 0; i < faces.size(); ++i)
    {
        Polytope surface = surfaceOf(points, faces);
        expectClosed(surface);
        const Polytope::Face closest = surface.closestFace();
        ASSERT_EQ(closest.vertex, lowest);
        const Polytope::Foot foot = surface.footOf(closest, 100.0);
        EXPECT_EQ(foot.vertex, neighbour) << i;
        EXPECT_NEAR(foot.miss, 0.01, 1e-12) << i;
        std::rotate(faces.begin(), faces.begin() + 1, faces.end());
    }
}

template <class S>
void checkLevelNeighbours()
{
    std::mt19937 engine(77);
    std::normal_distribution<double> normal;
    const std::vector<Hull<S>> hulls = {hullOf<S>(icoPoints(1)), hullOf<S>(boxPoints(0.5, 0.6, 0.7))};
    int left = 0;
    for (int i = 0; i < 2000; ++i)
    {
        const Hull<S>& hull = hulls[static_cast<std::size_t>(i % 2)];
        const PosedHull<S> posed(hull, randomRotation(engine).template cast<S>(), {S(1), S(2), S(3)});
        const Eigen::Vector3d direction = drawVector(normal, engine);
        const std::int32_t vertex = posed.support(direction, -1).vertex;
        std::vector<std::pair<double, std::int32_t>> slopes;
        for (const std::int32_t neighbour : hull.naturalNeighbours(vertex))
        {
            const Eigen::Vector3d edge = posed.point(vertex) - posed.point(neighbour);
            slopes.emplace_back(edge.dot(direction) / edge.norm(), neighbour);
        }
        std::sort(slopes.begin(), slopes.end());
        const LevelNeighbours level(posed, vertex, direction);
        ASSERT_EQ(level.count(), 3);
        left += static_cast<int>(slopes.size()) - 3;
        for (int k = 0; k < 3; ++k)
            EXPECT_EQ(level[k], slopes[static_cast<std::size_t>(k)].second) << i;
    }
    EXPECT_GT(left, 2000);
}

TEST(LevelNeighbours, AreThreeNeighboursOfLeastSlope)
{
    checkLevelNeighbours<float>();
    checkLevelNeighbours<double>();
}

/// Checks shapes that are near in one frame and overlap in the next.
template <class S>
void checkEntries()
{
    const std::vector<Hull<S>> hulls = {hullOf<S>(icoPoints(1)), hullOf<S>(icoPoints(2)),
                                        hullOf<S>(boxPoints(0.5, 0.6, 0.7))};
    std::mt19937 engine(4);
    int entries = 0, points = 0;
    for (int i = 0; i < 900; ++i)
    {
        SCOPED_TRACE(i);
        const PairScene<S> scene = anyPair(hulls, 0.01, 0.0, engine);
        const PosedHull<S> a = scene.posedA(), b = scene.posedB();
        GjkCache<S> cache;
        const GjkResult<S> near = gjkDistance(a, b, S(0.02), cache);
        ASSERT_EQ(near.state, GjkState::Near);
        const Eigen::Vector3d in = near.axis.template cast<double>() * -(double(near.distance) + 0.01);
        const PosedHull<S> moved(a.hull(), a.basis().template cast<S>(),
                                 (a.origin() + in).template cast<S>());
        ASSERT_EQ(gjkDistance(moved, b, S(0.02), cache).state, GjkState::Overlapping);
        EpaCache memory;
        const PenetrationResult<S> deep = penetration(moved, b, cache, &memory);
        ASSERT_EQ(deep.state, GjkState::Overlapping);
        EXPECT_EQ(deep.method, PenetrationMethod::Expansion);
        // For so small an overlap the depth is at most the motion.
        EXPECT_LE(deep.depth, S(0.0101));
        EXPECT_GT(memory.vertexCount, 3);
        ++entries;
        points += deep.iterations;
    }
    // From the tetrahedron alone there would be eight.
    EXPECT_LT(points, entries) << "of " << entries;
}

TEST(Penetration, NeedsHardlyAnyExpansionWhenShapesBeginToOverlap)
{
    checkEntries<float>();
    checkEntries<double>();
}
}  // namespace
}  // namespace cullet::test
