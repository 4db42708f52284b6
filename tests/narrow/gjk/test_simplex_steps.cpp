// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/distance_oracle.h"
#include "cullet/demos/scenes/hulls/hull_pairs.h"
#include "cullet/narrow/gjk/isa_gjk.h"
#include "cullet/narrow/gjk/simplex_steps.h"
#include "cullet/narrow/gjk/tetrahedron_walk.h"
#include "cullet/tests/narrow/search_observer.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <utility>

/// Searches in the scalar of the hulls: steps with simplices for an axis, walks of tetrahedra for an overlap.
namespace cullet::test
{
namespace
{
struct Outcome
{
    int failed = 0;  ///< cached axes that did not prove an existing gap
    int found = 0;   ///< those of them for which another axis was found
};

/// Moves a pair of the hull along a path on which the gap slightly exceeds the limit.
void follow(const Hull<float>& hull, std::mt19937& engine, Outcome& outcome)
{
    constexpr float kLimit = 0.02f;
    NoObserver observer;
    PairScene<float> scene = randomPair(hull, hull, 0.03, 0.0, engine);
    GjkCache<float> cache;
    isaGjk(scene.posedA(), scene.posedB(), kLimit, cache);
    for (int frame = 0; frame < 20; ++frame)
    {
        perturb(scene, 0.002, engine);
        const PosedHull<float> a = scene.posedA(), b = scene.posedB();
        const HullPair<float> pair(a, b);
        const Eigen::Vector3f axis(cache.axis[0], cache.axis[1], cache.axis[2]);
        const AxisTest<float> test = pair.test(axis, kLimit * kLimit, -1, -1);
        const DistanceOracle oracle(a, b);
        const Bounds truth = oracle.solve();
        if (!test.isProved && test.along > 0.0f)
        {
            SimplexSteps<float> steps(pair, kLimit * kLimit, test, {});
            const bool isFound = steps.run(cache, observer);
            if (isFound)
            {
                EXPECT_GT(-oracle.extent(-steps.axis().cast<long double>()), 0.02L * (1 - 1e-6L));
            }
            if (truth.lower > 0.021L)
            {
                ++outcome.failed;
                outcome.found += isFound;
            }
            else if (truth.upper < 0.02L * (1 - 1e-6L))
            {
                EXPECT_FALSE(isFound);
            }
        }
        isaGjk(a, b, kLimit, cache);
    }
}

TEST(SimplexSteps, FindNearlyAllSeparatingAxesAndNoFalseOnes)
{
    const Hull<float> hulls[] = {hullOf<float>(icoPoints(2)), hullOf<float>(boxPoints(0.7, 0.5, 0.6)),
                                 hullOf<float>(prismPoints(32, 0.5)), hullOf<float>(icoPoints(0))};
    std::mt19937 engine(71);
    Outcome outcome;
    for (int pair = 0; pair < 200; ++pair)
        follow(hulls[pair % 4], engine, outcome);
    EXPECT_GT(outcome.failed, 300);
    EXPECT_GT(outcome.found, outcome.failed * 9 / 10);
}

TEST(SimplexSteps, FindAxisAtOnceFromSimplexThatIsClosestStill)
{
    constexpr unsigned kSeed = 72;
    testing::Test::RecordProperty("seed", std::to_string(kSeed));
    const Hull<float> hulls[] = {hullOf<float>(icoPoints(2)), hullOf<float>(boxPoints(0.7, 0.5, 0.6)),
                                 hullOf<float>(prismPoints(32, 0.5)), hullOf<float>(icoPoints(0))};
    std::mt19937 engine(kSeed);
    NoObserver observer;
    int asked = 0, atOnce = 0, slower = 0;
    for (int i = 0; i < 200; ++i)
    {
        const PairScene<float> scene = randomPair(hulls[i % 4], hulls[i / 4 % 4], 0.1, 0.0, engine);
        const PosedHull<float> a = scene.posedA(), b = scene.posedB();
        GjkCache<float> cache;
        const GjkResult<float> near = gjkDistance(a, b, 1.0f, cache);
        ASSERT_EQ(near.state, GjkState::Near);
        const HullPair<float> pair(a, b);
        const float limit = 0.999f * near.distance;
        const Eigen::Vector3f aside = near.axis + 0.3f * randomDirection(engine).cast<float>();
        const AxisTest<float> failed = pair.test(scaledAxis(aside), limit * limit, -1, -1);
        if (failed.isProved || !(failed.along > 0.0f))
            continue;
        ++asked;
        SimplexSteps<float> warm(pair, limit * limit, failed, {}), cold(pair, limit * limit, failed, {});
        EXPECT_TRUE(warm.run(cache, observer)) << "pair " << i;
        atOnce += warm.steps() == 1;
        slower += !cold.run(GjkCache<float>(), observer) || cold.steps() > 1;
    }
    EXPECT_GT(asked, 100);
    // Rounding may spoil a step.
    EXPECT_GT(atOnce, asked * 9 / 10);
    EXPECT_GT(slower, asked / 2);
}

template <class S>
void checkOrientations()
{
    constexpr unsigned kSeed = 75;
    testing::Test::RecordProperty("seed", std::to_string(kSeed));
    const Hull<S> hulls[] = {hullOf<S>(boxPoints(0.7, 0.5, 0.6)), hullOf<S>(icoPoints(1))};
    std::mt19937 engine(kSeed);
    NoObserver observer;
    int asked = 0, proved[2] = {};
    for (int i = 0; i < 200; ++i)
    {
        const PairScene<S> scene = randomPair(hulls[i % 2], hulls[i / 2 % 2], -0.2, 0.0, engine);
        const PosedHull<S> a = scene.posedA(), b = scene.posedB();
        GjkCache<S> cache;
        ASSERT_EQ(isaGjk(a, b, S(0), cache).state, GjkState::Overlapping);
        if (cache.count != 4)
            continue;
        ++asked;
        std::array<std::int32_t, 4> verticesA, verticesB;
        std::copy(cache.verticesA.begin(), cache.verticesA.end(), verticesA.begin());
        std::copy(cache.verticesB.begin(), cache.verticesB.end(), verticesB.begin());
        const HullPair<S> pair(a, b);
        const auto edge = [&](std::size_t to) -> Eigen::Matrix<S, 3, 1>
        { return pair.point(verticesA[to], verticesB[to]) - pair.point(verticesA[0], verticesB[0]); };
        for (int order = 0; order < 2; ++order)
        {
            const int isPositive = edge(1).cross(edge(2)).dot(edge(3)) > S(0) ? 1 : 0;
            TetrahedronWalk<S, NoObserver> walk(pair, S(0), observer);
            proved[isPositive] +=
                walk.run(verticesA, verticesB) == GjkState::Overlapping && walk.iterations() == 0;
            std::swap(verticesA[0], verticesA[1]);
            std::swap(verticesB[0], verticesB[1]);
        }
    }
    EXPECT_GT(asked, 100);
    EXPECT_GT(proved[0], asked * 9 / 10);
    EXPECT_GT(proved[1], asked * 9 / 10);
}

TEST(TetrahedronWalk, ProvesOverlapWhateverTheOrderOfPoints)
{
    checkOrientations<float>();
    checkOrientations<double>();
}

/// The distance of the origin beyond each face of a tetrahedron; face f is opposite to point f.
std::array<double, 4> distancesBeyond(const Points& points, std::array<Eigen::Vector3d, 4>& normals)
{
    std::array<double, 4> distances;
    for (std::size_t f = 0; f < 4; ++f)
    {
        const Eigen::Vector3d &a = points[(f + 1) % 4], &b = points[(f + 2) % 4], &c = points[(f + 3) % 4];
        Eigen::Vector3d& normal = normals[f];
        normal = (b - a).cross(c - a).normalized();
        normal *= normal.dot(points[f] - a) > 0.0 ? -1.0 : 1.0;
        distances[f] = -normal.dot(a);
    }
    return distances;
}

TEST(TetrahedronWalk, SearchesBeyondTheFaceFarthestFromTheOriginWhenItIsOutsideOfSeveral)
{
    constexpr unsigned kSeed = 76;
    testing::Test::RecordProperty("seed", std::to_string(kSeed));
    std::mt19937 engine(kSeed);
    const Hull<float> point = hullOf<float>({{0.0, 0.0, 0.0}});
    std::array<int, 4> farthest = {};
    for (int i = 0; i < 400; ++i)
    {
        Points points;
        const Eigen::Vector3d shift = 1.5 * randomDirection(engine);
        for (int k = 0; k < 4; ++k)
            points.push_back(randomDirection(engine) + shift);
        std::array<Eigen::Vector3d, 4> normals;
        const std::array<double, 4> beyond = distancesBeyond(points, normals);
        std::array<double, 4> sorted = beyond;
        std::sort(sorted.begin(), sorted.end());
        if (!(sorted[2] > 0.01 && sorted[3] > sorted[2] + 0.01))
            continue;
        const auto face =
            static_cast<std::size_t>(std::max_element(beyond.begin(), beyond.end()) - beyond.begin());
        ++farthest[face];
        const Hull<float> hull = hullOf<float>(points);
        const Eigen::Matrix3f identity = Eigen::Matrix3f::Identity();
        const PosedHull<float> a(hull, identity, Eigen::Vector3f::Zero()),
            b(point, identity, Eigen::Vector3f::Zero());
        Eigen::Vector3d first = Eigen::Vector3d::Zero();
        SearchObserver observer = [&first](const Eigen::Vector3d& axis, double)
        { first = first.isZero(0.0) ? axis.normalized() : first; };
        const HullPair<float> pair(a, b);
        TetrahedronWalk<float, SearchObserver> walk(pair, 0.0f, observer);
        walk.run({0, 1, 2, 3}, {0, 0, 0, 0});
        EXPECT_GT(std::abs(first.dot(normals[face])), 0.9999) << "seed " << kSeed << ", tetrahedron " << i;
    }
    for (const int count : farthest)
        EXPECT_GT(count, 20);
}
}  // namespace
}  // namespace cullet::test
