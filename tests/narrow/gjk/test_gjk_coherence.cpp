// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/hull_pairs.h"
#include "cullet/narrow/gjk/isa_gjk.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

/// For how long what a boolean query remembers answers the next ones, as pairs move from frame to frame.
namespace cullet::test
{
namespace
{
/// Queries that followed one with the same answer, and of these the ones that what was remembered did not answer.
struct Coherence
{
    int queries = 0, failures = 0;
};

/// How pairs of hulls of two shapes move, and what is asked.
struct Swing
{
    Points points[2];
    double middle;      ///< of the gap, which swings by 3 % of the size
    float maxDistance;  ///< see isaGjk()
};

/// @param see called with the scene, the cache before, the result, the cache now and how many axes were tested, for each query
template <class See>
void forQueriesOf(const Swing& swing, unsigned seed, const See& see)
{
    testing::Test::RecordProperty("seed", std::to_string(seed));
    const Hull<float> hulls[] = {hullOf<float>(swing.points[0]), hullOf<float>(swing.points[1])};
    std::mt19937 engine(seed);
    for (int pair = 0; pair < 64; ++pair)
    {
        PairScene<float> scene = randomPair(hulls[pair % 2], hulls[pair / 2 % 2], 0.05, 0.0, engine);
        GjkCache<float> cache;
        for (int frame = 0; frame < 100; ++frame)
        {
            moveALittle(scene, 0.01, engine);
            setGapOutwards(scene, swing.middle + 0.03 * std::sin(0.1 * pair + 0.15 * frame));
            const GjkCache<float> before = cache;
            int axes = 0;
            auto observer = [&axes](const Eigen::Vector3d&, double) { ++axes; };
            const GjkResult<float> result =
                isaGjk(scene.posedA(), scene.posedB(), swing.maxDistance, cache, observer);
            see(scene, before, result, cache, axes);
        }
    }
}

/// Boxes and icosahedra that swing across each other's surface, as in the benchmark.
template <class See>
void forCrossingQueries(unsigned seed, const See& see)
{
    forQueriesOf({{boxPoints(0.7, 0.5, 0.6), icoPoints(0)}, 0.0, 0.0f}, seed, see);
}

/// @param state answers that count
Coherence coherenceOf(GjkState state, unsigned seed)
{
    Coherence coherence;
    forCrossingQueries(seed,
                       [&](const PairScene<float>&, const GjkCache<float>& before,
                           const GjkResult<float>& result, const GjkCache<float>&, int axes)
                       {
                           if (before.state != state || result.state != state)
                               return;
                           ++coherence.queries;
                           // A remembered axis is one, a tetrahedron none.
                           coherence.failures += axes > (state == GjkState::Separated ? 1 : 0);
                       });
    testing::Test::RecordProperty("failures", std::to_string(coherence.failures));
    testing::Test::RecordProperty("queries", std::to_string(coherence.queries));
    return coherence;
}

TEST(GjkCoherence, ATetrahedronKeepsTheOriginInside)
{
    const Coherence coherence = coherenceOf(GjkState::Overlapping, 71);
    EXPECT_GT(coherence.queries, 2500);
    EXPECT_GT(coherence.failures, 50);
    // A fifth if the point beyond a face is that along its normal.
    EXPECT_LT(coherence.failures, coherence.queries / 7) << coherence.failures;
}

TEST(GjkCoherence, AnAxisThatSucceedsAnotherPointsAtTheNearestCorner)
{
    const Coherence coherence = coherenceOf(GjkState::Separated, 72);
    EXPECT_GT(coherence.queries, 2500);
    EXPECT_GT(coherence.failures, 50);
    // A ninth if the axis is tilted at the corner of the failed one only.
    EXPECT_LT(coherence.failures, coherence.queries / 15) << coherence.failures;
}

/// Whether another vertex is as far along a world direction as the one of a support, up to rounding.
bool isLevel(const PosedHull<float>& shape, const Eigen::Vector3d& direction)
{
    const SupportPoint support = shape.support(direction, -1);
    const double below = 1e-5 * direction.norm();
    int level = 0;
    for (std::int32_t v = 0; v < shape.vertexCount(); ++v)
        level += (support.point - shape.point(v)).dot(direction) <= below;
    return level > 1;
}

bool isLevel(const PairScene<float>& scene, const GjkCache<float>& cache)
{
    const Eigen::Vector3d axis(cache.axis[0], cache.axis[1], cache.axis[2]);
    return isLevel(scene.posedA(), -axis) || isLevel(scene.posedB(), axis);
}

TEST(GjkCoherence, AnAxisFoundWhereATetrahedronIsLeftIsLevelWithNoEdge)
{
    int axes = 0, levelAxes = 0;
    forCrossingQueries(73,
                       [&](const PairScene<float>& scene, const GjkCache<float>& before,
                           const GjkResult<float>& result, const GjkCache<float>& cache, int)
                       {
                           if (before.state != GjkState::Overlapping || result.state != GjkState::Separated)
                               return;
                           ++axes;
                           levelAxes += isLevel(scene, cache);
                       });
    EXPECT_GT(axes, 100);
    // All of them if it stays the normal of a face: as long as A rests, its support is then searched in every frame.
    EXPECT_LT(levelAxes, axes / 10) << axes;
}

TEST(GjkCoherence, AnAxisFoundForAGapIsLevelWithNoEdge)
{
    int axes = 0, levelAxes = 0;
    forQueriesOf({{icoPoints(1), icoPoints(1)}, 0.05, 0.02f}, 74,
                 [&](const PairScene<float>& scene, const GjkCache<float>& before,
                     const GjkResult<float>& result, const GjkCache<float>& cache, int)
                 {
                     if (before.state != GjkState::Separated || result.state != GjkState::Separated ||
                         before.axis == cache.axis)
                         return;
                     ++axes;
                     levelAxes += isLevel(scene, cache);
                 });
    EXPECT_GT(axes, 200);
    // A third if it stays the way to an edge or a face.
    EXPECT_LT(levelAxes, axes / 10) << axes;
}
}  // namespace
}  // namespace cullet::test
