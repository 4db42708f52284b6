// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/distance_oracle.h"
#include "cullet/demos/scenes/hulls/hull_pairs.h"
#include "cullet/narrow/gjk/isa_gjk.h"
#include "cullet/narrow/gjk/simplex_steps.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <random>

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
}  // namespace
}  // namespace cullet::test
