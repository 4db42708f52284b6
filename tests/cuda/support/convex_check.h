// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/hulls/distance_oracle.h"
#include "cullet/narrow/epa/exact_penetration.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/narrow/gjk/isa_gjk.h"
#include "cullet/tests/cuda/support/convex_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

/// Answers of convex pairs against isaGjk() of the same points and poses in double.
namespace cullet::test
{
/// Answers of all pairs of a scene.
struct ConvexAnswers
{
    std::vector<PairState> states;
    std::vector<PairAxis> axes;
    std::vector<PairDistance> distances;  ///< if asked for
    std::vector<std::uint32_t> overlaps;  ///< likewise
    std::vector<PairDepth> depths;        ///< likewise, of the overlaps
    std::vector<PairContact> contacts;    ///< likewise
};

inline bool haveSameBits(const ConvexAnswers& a, const ConvexAnswers& b)
{
    const auto areEqual = [](const auto& listA, const auto& listB)
    {
        return listA.size() == listB.size() &&
               (listA.empty() ||
                std::memcmp(listA.data(), listB.data(), listA.size() * sizeof(listA[0])) == 0);
    };
    return areEqual(a.states, b.states) && areEqual(a.axes, b.axes) && areEqual(a.distances, b.distances) &&
           areEqual(a.overlaps, b.overlaps) && areEqual(a.depths, b.depths) &&
           areEqual(a.contacts, b.contacts);
}

/// The places of pairs that overlap.
inline std::vector<std::uint32_t> overlapsOf(const std::vector<PairState>& states)
{
    std::vector<std::uint32_t> overlaps;
    for (std::size_t k = 0; k < states.size(); ++k)
    {
        if (states[k] == PairState::Overlapping)
            overlaps.push_back(static_cast<std::uint32_t>(k));
    }
    return overlaps;
}

struct ConvexTally
{
    std::int64_t pairs = 0, overlapping = 0, wrong = 0, unanswered = 0, unproved = 0;
    std::int64_t withinRounding = 0;  ///< other than isaGjk(), at a distance or depth below 1e-6 of the size
};

/// The gap along an axis, in long double.
inline long double gapAlong(const PosedHull<double>& a, const PosedHull<double>& b, const PairAxis& axis)
{
    const LongVector v(axis.axis[0], axis.axis[1], axis.axis[2]);
    const auto least = [&](const PosedHull<double>& hull, const LongVector& along)
    {
        long double value = std::numeric_limits<long double>::infinity();
        for (std::int32_t i = 0; i < hull.vertexCount(); ++i)
            value = std::min(value, along.dot((hull.point(i) + hull.origin()).template cast<long double>()));
        return value;
    };
    return least(a, v) + least(b, -v);
}

/// Whether distance or depth are below 1e-6 of the size.
inline bool isWithinRounding(const PosedHull<double>& a, const PosedHull<double>& b, double size)
{
    const Bounds truth = DistanceOracle(a, b).solve();
    double depth = 0.0;
    Eigen::Vector3d normal;
    if (truth.isInside)
        exactPenetration(a, b, normal, depth);
    return (truth.isInside ? depth : static_cast<double>(truth.upper)) < 1e-6 * size;
}

inline void checkPair(const ConvexScene& scene, std::size_t k, const ConvexAnswers& answers,
                      ConvexTally& tally)
{
    const RowPair pair = scene.pairs[k];
    const PosedHull<double> a = scene.posed(pair.a), b = scene.posed(pair.b);
    const PairState state = answers.states[k];
    ++tally.pairs;
    tally.overlapping += state == PairState::Overlapping;
    tally.unanswered += state != PairState::Overlapping && state != PairState::Apart;
    if (state == PairState::Apart && !(gapAlong(a, b, answers.axes[k]) > -4e-6L * scene.sizeOf(pair)))
        ++tally.unproved;
    GjkCache<double> cache;
    const GjkState expected = isaGjk(a, b, 0.0, cache).state;
    if ((expected == GjkState::Overlapping) == (state == PairState::Overlapping))
        return;
    const bool isClose = isWithinRounding(a, b, scene.sizeOf(pair));
    tally.withinRounding += isClose;
    tally.wrong += !isClose;
    EXPECT_TRUE(isClose || tally.wrong > 5)
        << "pair " << k << " of hulls " << scene.poses[pair.a].hull << " and " << scene.poses[pair.b].hull;
}

inline void checkPairs(const ConvexScene& scene, const ConvexAnswers& answers, ConvexTally& tally)
{
    ASSERT_EQ(answers.states.size(), scene.pairs.size());
    for (std::size_t k = 0; k < scene.pairs.size(); ++k)
        checkPair(scene, k, answers, tally);
}

/// No answer is wrong, and the sample has both, few of which rounding decides.
inline void expectGood(const ConvexTally& tally)
{
    EXPECT_EQ(tally.wrong, 0);
    EXPECT_EQ(tally.unanswered, 0);
    EXPECT_EQ(tally.unproved, 0);
    EXPECT_GT(tally.overlapping, tally.pairs / 5);
    EXPECT_GT(tally.pairs - tally.overlapping, tally.pairs / 5);
    EXPECT_LT(tally.withinRounding, tally.pairs / 10);
}

struct DistanceTally
{
    std::int64_t measured = 0, beyond = 0, wrong = 0;
};

/// The point of a hull that is farthest along a direction, by its height.
inline double heightAlong(const PosedHull<double>& hull, const Eigen::Vector3d& direction)
{
    double height = -std::numeric_limits<double>::infinity();
    for (std::int32_t i = 0; i < hull.vertexCount(); ++i)
        height = std::max(height, direction.dot(hull.point(i)));
    return height;
}

/// The distance is gjkDistance()'s, the points are that far apart, along the axis, and as far out as the hulls are.
inline void checkDistance(const ConvexScene& scene, std::size_t k, const ConvexAnswers& answers, double most,
                          DistanceTally& tally)
{
    const RowPair pair = scene.pairs[k];
    const PairDistance& found = answers.distances[k];
    if (answers.states[k] != PairState::Apart)
    {
        EXPECT_EQ(found.distance, 0.0f);
        return;
    }
    const PosedHull<double> a = scene.posed(pair.a), b = scene.posed(pair.b);
    GjkCache<double> cache;
    const double expected = gjkDistance(a, b, std::numeric_limits<double>::infinity(), cache).distance;
    const double band = 2e-7 * scene.sizeOf(pair);
    if (std::isinf(found.distance))
    {
        ++tally.beyond;
        tally.wrong += !(expected > most - band);
        return;
    }
    ++tally.measured;
    const Eigen::Vector3d onA = Eigen::Map<const Eigen::Vector3f>(found.pointA).cast<double>();
    const Eigen::Vector3d onB = Eigen::Map<const Eigen::Vector3f>(found.pointB).cast<double>();
    const Eigen::Vector3d axis = Eigen::Map<const Eigen::Vector3f>(answers.axes[k].axis).cast<double>();
    // Points in float, and a long lever of the axis.
    const bool isRight =
        std::abs(found.distance - expected) <= band && found.distance <= most + band &&
        std::abs((onA - onB).norm() - expected) <= 2 * band &&
        std::abs(-axis.dot(onA) - heightAlong(a, -axis)) <= 4 * band &&
        std::abs(axis.dot(onB - (b.origin() - a.origin())) - heightAlong(b, axis)) <= 4 * band;
    tally.wrong += !isRight;
    EXPECT_TRUE(isRight || tally.wrong > 5)
        << "pair " << k << " hulls " << scene.poses[pair.a].hull << " " << scene.poses[pair.b].hull
        << " distance " << found.distance << " instead of " << expected << ", points " << (onA - onB).norm()
        << ", heights " << -axis.dot(onA) - heightAlong(a, -axis) << " "
        << axis.dot(onB - (b.origin() - a.origin())) - heightAlong(b, axis) << " band " << band;
}
}  // namespace cullet::test
