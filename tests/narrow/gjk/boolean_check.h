// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/hulls/distance_oracle.h"
#include "cullet/demos/scenes/hulls/hull_pairs.h"
#include "cullet/narrow/epa/exact_penetration.h"
#include "cullet/narrow/gjk/isa_gjk.h"
#include "cullet/tests/narrow/shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <random>
#include <string>
#include <vector>

/// Booleans against the oracle, by the query's own certificate where it has one. Gaps below kUndecided times the size
/// are excluded, as usual for float coordinates; in double the searches resolve a tenth of that. The size is 1.
namespace cullet::test
{
template <class S>
inline constexpr double kUndecided = sizeof(S) == sizeof(float) ? 1e-6 : 1e-7;

struct Tally
{
    std::int64_t queries = 0, separated = 0, overlapping = 0, undecided = 0, wrong = 0, unanswered = 0;
    std::int64_t near = 0;    ///< separated by no more than the limit
    std::int64_t proved = 0;  ///< by the query's own axis or tetrahedron, in long double
    std::int64_t withoutSimplex = 0;
    std::int32_t mostIterations = 0;
};

/// Whether the cached tetrahedron contains the origin, in long double, so that the shapes overlap.
template <class S>
bool provesOverlap(const PosedHull<S>& a, const PosedHull<S>& b, const GjkCache<S>& cache)
{
    if (cache.count != 4)
        return false;
    const LongVector shift =
        (b.origin().template cast<long double>() - a.origin().template cast<long double>());
    std::array<LongVector, 4> p;
    for (int i = 0; i < 4; ++i)
    {
        p[i] = a.basis().template cast<long double>() *
                   a.hull().vertex(cache.verticesA[i]).template cast<long double>() -
               b.basis().template cast<long double>() *
                   b.hull().vertex(cache.verticesB[i]).template cast<long double>() -
               shift;
    }
    const auto side = [&p](int i, int j, int k, const LongVector& x)
    { return (x - p[i]).dot((p[j] - p[i]).cross(p[k] - p[i])); };
    const LongVector o = LongVector::Zero();
    return side(0, 1, 2, o) * side(0, 1, 2, p[3]) > 0.0L && side(0, 1, 3, o) * side(0, 1, 3, p[2]) > 0.0L &&
           side(0, 2, 3, o) * side(0, 2, 3, p[1]) > 0.0L && side(1, 2, 3, o) * side(1, 2, 3, p[0]) > 0.0L;
}

/// Whether an answer differs from the oracle's. It is undecided if the shapes, or the gap and the limit, differ by
/// almost nothing.
template <class S>
bool isRefuted(const PosedHull<S>& a, const PosedHull<S>& b, double limit, GjkState state,
               const DistanceOracle& oracle, Tally& tally)
{
    const Bounds truth = oracle.solve();
    double depth = 0.0;
    Eigen::Vector3d normal;
    if (truth.isInside)
        exactPenetration(a, b, normal, depth);
    const double distance = static_cast<double>(truth.upper);
    const bool isUndecided = truth.isInside
                                 ? depth < kUndecided<S>
                                 : distance < kUndecided<S> || std::abs(distance - limit) < kUndecided<S>;
    tally.undecided += isUndecided;
    const GjkState right = truth.isInside     ? GjkState::Overlapping
                           : distance > limit ? GjkState::Separated
                                              : GjkState::Near;
    const bool isWrong = !isUndecided && state != right;
    EXPECT_FALSE(isWrong && tally.wrong < 5) << "state " << static_cast<int>(state) << " distance "
                                             << distance << " depth " << depth << " limit " << limit;
    return isWrong;
}

/// @param limit the required gap
template <class S>
void checkBoolean(const PairScene<S>& scene, S limit, GjkCache<S>& cache, Tally& tally)
{
    const PosedHull<S> a = scene.posedA();
    const PosedHull<S> b = scene.posedB();
    const GjkResult<S> result = isaGjk(a, b, limit, cache);
    ++tally.queries;
    tally.withoutSimplex += result.iterations == 0;
    tally.mostIterations = std::max(tally.mostIterations, result.iterations);
    const bool isSeparated = result.state == GjkState::Separated;
    const bool isOverlapping = result.state == GjkState::Overlapping;
    const bool isNear = result.state == GjkState::Near;
    tally.separated += isSeparated;
    tally.overlapping += isOverlapping;
    tally.near += isNear;
    tally.unanswered += !isSeparated && !isOverlapping && !isNear;
    const DistanceOracle oracle(a, b);
    const bool isProved = isSeparated ? oracle.extent(-result.axis.template cast<long double>()) <
                                            -static_cast<long double>(limit)
                                      : isOverlapping && provesOverlap(a, b, cache);
    tally.proved += isProved;
    if (!isProved)
        tally.wrong += isRefuted(a, b, static_cast<double>(limit), result.state, oracle, tally);
    // Continues like the plug-in: each kind of query uses the cache of the other.
    if (!(limit > S(0)) || isSeparated)
        return;
    const GjkState measured = gjkDistance(a, b, limit, cache).state;
    tally.unanswered += measured == GjkState::NotConverged;
    if (measured != result.state)
        tally.wrong += isRefuted(a, b, static_cast<double>(limit), measured, oracle, tally);
}

/// Gaps relative to the limit: where the rounding of the shapes decides, just beside that, and far away.
inline constexpr double kBesideLimit[] = {0.5, 0.95, 0.999, 1.001, 1.05, 1.5, 4.0};

/// Every named shape against every other, at gaps from deep to wide, `rounds` times; cold, then `frames` warm frames.
///
/// @param limits required gaps, one for each pair, sometimes changed between its frames
template <class S>
Tally checkAll(bool isThin, double farAway, int rounds, int frames, unsigned seed,
               const std::vector<double>& limits = {0.0})
{
    const std::vector<NamedPoints> shapes = queryShapes();
    std::vector<Hull<S>> hulls;
    for (const NamedPoints& shape : shapes)
        hulls.push_back(hullOf<S>(shape.points));
    // Far from the origin coordinates are rounded to eps times farAway; gaps below that are random, which is harmless.
    const double least = 2.0 * kUndecided<S>;
    const double gaps[] = {0.06, 0.03, 3e-3, 1e-3, 1e-5, least, -least, -1e-4, -3e-3, -0.03, -0.2};
    Tally tally;
    std::mt19937 engine(seed);
    const auto anyLimit = [&] { return limits.size() > 1 ? limits[engine() % limits.size()] : limits[0]; };
    for (int round = 0; round < rounds; ++round)
    {
        for (std::size_t i = 0; i < shapes.size(); ++i)
        {
            for (std::size_t j = 0; j < shapes.size(); ++j)
            {
                if ((shapes[i].isThin || shapes[j].isThin) != isThin)
                    continue;
                SCOPED_TRACE(testing::Message()
                             << shapes[i].name << " " << shapes[j].name << " round " << round);
                double limit = anyLimit();
                const bool isBeside = limit > 0.0 && engine() % 2 == 0;
                const double gap = isBeside ? limit * kBesideLimit[engine() % std::size(kBesideLimit)]
                                            : gaps[engine() % std::size(gaps)];
                PairScene<S> scene = randomPair(hulls[i], hulls[j], gap, farAway, engine);
                GjkCache<S> cache;
                checkBoolean(scene, static_cast<S>(limit), cache, tally);
                for (int frame = 0; frame < frames; ++frame)
                {
                    perturb(scene, 0.01, engine);
                    if (limit > 0.0 && engine() % 8 == 0)
                        limit = anyLimit();
                    checkBoolean(scene, static_cast<S>(limit), cache, tally);
                }
            }
        }
    }
    return tally;
}

inline void expectAnswered(const Tally& tally, const char* name)
{
    const auto record = [name](const char* what, std::int64_t count)
    { testing::Test::RecordProperty(std::string(name) + what, std::to_string(count)); };
    record(".queries", tally.queries);
    record(".separated", tally.separated);
    record(".near", tally.near);
    record(".overlapping", tally.overlapping);
    record(".proved", tally.proved);
    record(".undecided", tally.undecided);
    record(".mostIterations", tally.mostIterations);
    EXPECT_EQ(tally.wrong, 0) << name;
    EXPECT_EQ(tally.unanswered, 0) << name;
    EXPECT_LT(tally.mostIterations, 64) << name;
    EXPECT_GT(tally.separated, tally.queries / 5) << name;
    EXPECT_LT(tally.undecided, tally.queries / 10) << name;
}

/// The sample is representative: both outcomes, most of them proved, few too close to call.
inline void expectGood(const Tally& tally, const char* name)
{
    expectAnswered(tally, name);
    EXPECT_EQ(tally.near, 0) << name;
    EXPECT_GT(tally.overlapping, tally.queries / 5) << name;
    EXPECT_GT(tally.proved, tally.queries * 9 / 10) << name;
}

/// The limits of a dispatcher, by margins and breaking thresholds: tiny, usual, and for thick margins.
inline const std::vector<double>& askedGaps()
{
    static const std::vector<double> gaps = {0.002, 0.02, 0.1};
    return gaps;
}

/// expectGood() for queries with a limit: all three outcomes.
inline void expectGoodGaps(const Tally& tally, const char* name)
{
    expectAnswered(tally, name);
    EXPECT_GT(tally.near, tally.queries / 6) << name;
    EXPECT_GT(tally.overlapping, tally.queries / 10) << name;
    // Proved by an axis for the gap, or a tetrahedron for the overlap; a Near result has neither.
    EXPECT_GT(tally.proved, (tally.separated + tally.overlapping) * 9 / 10) << name;
}
}  // namespace cullet::test
