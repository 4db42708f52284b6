// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/hull_pairs.h"
#include "cullet/narrow/gjk/isa_gjk.h"
#include "cullet/tests/narrow/search_observer.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

/// For how many frames the cache of a boolean query answers the next queries of moving pairs.
namespace cullet::test
{
namespace
{
/// Queries with the same answer as the previous one, and those of them that the cache did not answer.
struct Coherence
{
    int queries = 0, failures = 0;
};

/// Motion of pairs of hulls of two shapes, and the limit of the query.
struct Swing
{
    Points points[2];
    double middle;      ///< middle of the gap, which swings by 3 % of the size
    float maxDistance;  ///< see isaGjk()
};

/// @param see called for each query with the scene, the cache before, the result, the cache after and the number of
///            tested axes
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
            perturb(scene, 0.01, engine);
            setGapOutwards(scene, swing.middle + 0.03 * std::sin(0.1 * pair + 0.15 * frame));
            const GjkCache<float> before = cache;
            int axes = 0;
            SearchObserver observer = [&axes](const Eigen::Vector3d&, double) { ++axes; };
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

/// @param state of the counted answers
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
                           // A cached axis counts as one tested axis, a tetrahedron as none.
                           coherence.failures += axes > (state == GjkState::Separated ? 1 : 0);
                       });
    testing::Test::RecordProperty("failures", std::to_string(coherence.failures));
    testing::Test::RecordProperty("queries", std::to_string(coherence.queries));
    return coherence;
}

TEST(GjkCoherence, AnswersMostOverlapsFromRememberedTetrahedron)
{
    const Coherence coherence = coherenceOf(GjkState::Overlapping, 71);
    EXPECT_GT(coherence.queries, 2500);
    EXPECT_GT(coherence.failures, 50);
    // It would be a fifth with the support point along the normal of a face.
    EXPECT_LT(coherence.failures, coherence.queries / 7) << coherence.failures;
}

TEST(GjkCoherence, AnswersMostSeparationsFromRememberedAxis)
{
    const Coherence coherence = coherenceOf(GjkState::Separated, 72);
    EXPECT_GT(coherence.queries, 2500);
    EXPECT_GT(coherence.failures, 50);
    // It would be a ninth with the axis tilted only at the corner of the failed one.
    EXPECT_LT(coherence.failures, coherence.queries / 15) << coherence.failures;
}

/// Whether another vertex is as far along a world direction as the support vertex, up to rounding.
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

TEST(GjkCoherence, FindsNonDegenerateAxisWhenOriginLeavesTetrahedron)
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
    // It would be all of them with the normal of a face as the axis: while A rests, its support would be searched in
    // every frame.
    EXPECT_LT(levelAxes, axes / 10) << axes;
}

TEST(GjkCoherence, FindsNonDegenerateAxisForGap)
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
    // It would be a third with the direction to an edge or a face as the axis.
    EXPECT_LT(levelAxes, axes / 10) << axes;
}
}  // namespace
}  // namespace cullet::test
