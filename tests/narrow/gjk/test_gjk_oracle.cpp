// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/distance_oracle.h"
#include "cullet/demos/scenes/hulls/hull_pairs.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/tests/narrow/gjk/boolean_check.h"
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
TEST(IsaGjkOracle, AgreesOnColdRegularPairsInFloat)
{
    expectGood(checkAll<float>(false, 0.0, 400, 0, 1), "regular");
}

TEST(IsaGjkOracle, AgreesOnColdThinPairsInFloat)
{
    expectGood(checkAll<float>(true, 0.0, 400, 0, 2), "thin");
}

TEST(IsaGjkOracle, AgreesOnColdPairsFarFromOriginInFloat)
{
    expectGood(checkAll<float>(false, 1e4, 100, 0, 3), "far");
}

TEST(IsaGjkOracle, AgreesOnWarmTrajectoriesInFloat)
{
    const Tally tally = checkAll<float>(false, 0.0, 10, 40, 4);
    expectGood(tally, "warm");
    // The caches work: most queries need no new simplex.
    EXPECT_GT(tally.withoutSimplex, tally.queries / 2);
}

TEST(IsaGjkOracle, AgreesOnWarmThinTrajectoriesInFloat)
{
    expectGood(checkAll<float>(true, 0.0, 10, 40, 5), "warm thin");
}

TEST(IsaGjkOracle, AgreesOnColdAndWarmPairsInDouble)
{
    expectGood(checkAll<double>(false, 0.0, 100, 0, 6), "regular");
    expectGood(checkAll<double>(true, 0.0, 100, 0, 7), "thin");
    expectGood(checkAll<double>(false, 1e4, 50, 0, 8), "far");
    expectGood(checkAll<double>(false, 0.0, 3, 40, 9), "warm");
}

TEST(IsaGjkOracle, AgreesOnGapsOfAllPairClassesInFloat)
{
    expectGoodGaps(checkAll<float>(false, 0.0, 100, 0, 51, askedGaps()), "regular");
    expectGoodGaps(checkAll<float>(true, 0.0, 100, 0, 52, askedGaps()), "thin");
    expectGoodGaps(checkAll<float>(false, 1e4, 50, 0, 53, askedGaps()), "far");
    expectGoodGaps(checkAll<float>(true, 0.0, 5, 40, 55, askedGaps()), "warm thin");
    const Tally warm = checkAll<float>(false, 0.0, 5, 40, 54, askedGaps());
    expectGoodGaps(warm, "warm");
    // The proofs in the shapes' own precision work.
    EXPECT_GT(warm.withoutSimplex, warm.queries / 2);
}

TEST(IsaGjkOracle, AgreesOnGapsOfAllPairClassesInDouble)
{
    expectGoodGaps(checkAll<double>(false, 0.0, 50, 0, 56, askedGaps()), "regular");
    expectGoodGaps(checkAll<double>(true, 0.0, 50, 0, 57, askedGaps()), "thin");
    expectGoodGaps(checkAll<double>(false, 1e4, 25, 0, 58, askedGaps()), "far");
    expectGoodGaps(checkAll<double>(false, 0.0, 2, 40, 59, askedGaps()), "warm");
    expectGoodGaps(checkAll<double>(true, 0.0, 2, 40, 60, askedGaps()), "warm thin");
}

struct DistanceTally
{
    std::int64_t queries = 0, near = 0, overlapping = 0, unanswered = 0;
    double worstDistance = 0.0;  ///< error
    double worstPoint = 0.0;     ///< | pointA - pointB | against the distance
};

template <class S>
DistanceTally checkDistances(bool isThin, int rounds, unsigned seed)
{
    const std::vector<NamedPoints> shapes = queryShapes();
    std::vector<Hull<S>> hulls;
    for (const NamedPoints& shape : shapes)
        hulls.push_back(hullOf<S>(shape.points));
    DistanceTally tally;
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> exponent(-5.0, 0.0);
    for (int i = 0; i < rounds; ++i)
    {
        const std::size_t a = engine() % shapes.size();
        const std::size_t b = engine() % shapes.size();
        if ((shapes[a].isThin || shapes[b].isThin) != isThin)
            continue;
        SCOPED_TRACE(testing::Message() << shapes[a].name << " " << shapes[b].name << " query " << i);
        const double gap = i % 10 == 0 ? -0.01 : std::pow(10.0, exponent(engine));
        PairScene<S> scene = randomPair(hulls[a], hulls[b], gap, i % 3 == 0 ? 1e4 : 0.0, engine);
        GjkCache<S> cache;
        for (int frame = 0; frame < 2; ++frame)
        {
            const PosedHull<S> posedA = scene.posedA();
            const PosedHull<S> posedB = scene.posedB();
            const GjkResult<S> result =
                gjkDistance(posedA, posedB, std::numeric_limits<S>::infinity(), cache);
            ++tally.queries;
            tally.near += result.state == GjkState::Near;
            tally.overlapping += result.state == GjkState::Overlapping;
            tally.unanswered += result.state == GjkState::NotConverged;
            const Bounds truth = DistanceOracle(posedA, posedB).solve();
            const double error =
                std::abs(static_cast<double>(truth.upper) - static_cast<double>(result.distance));
            EXPECT_LT(error, 1e-4);
            tally.worstDistance =
                std::max(tally.worstDistance, error / std::max(1.0, static_cast<double>(truth.upper)));
            if (result.state == GjkState::Near)
            {
                const double between = (result.pointA - result.pointB).norm();
                tally.worstPoint = std::max(tally.worstPoint, std::abs(between - result.distance));
                EXPECT_NEAR(result.axis.norm(), S(1), 1e-6);
            }
            perturb(scene, 0.01, engine);
        }
    }
    return tally;
}

template <class S>
void expectGoodDistances(bool isThin, int rounds, unsigned seed, double tolerance)
{
    const DistanceTally tally = checkDistances<S>(isThin, rounds, seed);
    testing::Test::RecordProperty("worstDistance", std::to_string(tally.worstDistance * 1e9) + "e-9");
    testing::Test::RecordProperty("queries", std::to_string(tally.queries));
    EXPECT_EQ(tally.unanswered, 0);
    EXPECT_LE(tally.worstDistance, tolerance);
    EXPECT_LE(tally.worstPoint, 4.0 * tolerance);
    EXPECT_GT(tally.near, tally.queries / 2);
    EXPECT_GT(tally.overlapping, tally.queries / 50);
}

TEST(GjkOracle, AgreesOnDistancesWithinTwoTenMillionthsInFloat)
{
    expectGoodDistances<float>(false, 12000, 11, 2e-7);
    expectGoodDistances<float>(true, 6000, 12, 2e-7);
}

TEST(GjkOracle, AgreesOnDistancesWithinRoundingInDouble)
{
    expectGoodDistances<double>(false, 6000, 13, 1e-11);
    expectGoodDistances<double>(true, 3000, 14, 1e-11);
}
}  // namespace
}  // namespace cullet::test
