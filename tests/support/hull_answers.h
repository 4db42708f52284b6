// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/hulls/hull_points.h"
#include "cullet/demos/scenes/hulls/hull_queries.h"
#include "cullet/narrow/epa/epa.h"
#include "cullet/narrow/gjk/gjk.h"
#include "cullet/narrow/gjk/isa_gjk.h"
#include "cullet/tests/support/number_hash.h"
#include "cullet/tests/support/random.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

/// A hash of all answers about fixed pairs of hulls.
namespace cullet::test
{
inline double draw(Random& random, float low, float high)
{
    return static_cast<double>(random.between(low, high));
}

/// A cloud, a cloud on few levels, whose hull has faces with many corners, or a box.
inline Points drawPoints(Random& random)
{
    const std::uint32_t kind = random.below(3), count = 4 + random.below(60);
    if (kind == 2)
    {
        const double x = draw(random, 0.25f, 1.0f), y = draw(random, 0.25f, 1.0f);
        return cullet::boxPoints(x, y, draw(random, 0.25f, 1.0f));
    }
    Points points(count);
    for (Eigen::Vector3d& point : points)
    {
        for (int axis = 0; axis < 3; ++axis)
            point[axis] = kind == 0 ? draw(random, -1.0f, 1.0f) : 0.5 * random.below(5) - 1.0;
    }
    return points;
}

/// Only sums, products, quotients and a root, which IEEE 754 rounds in one way.
inline Eigen::Matrix3d drawRotation(Random& random)
{
    std::array<double, 4> q;
    for (double& part : q)
        part = draw(random, -1.0f, 1.0f);
    const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (double& part : q)
        part /= length;
    const auto [w, x, y, z] = q;
    Eigen::Matrix3d basis;
    basis << 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y),  //
        2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x),       //
        2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y);
    return basis;
}

struct HullAnswers
{
    NumberHash hash;
    int separated = 0, near = 0, overlapping = 0;
};

template <class S>
void ask(const PosedHull<S>& a, const PosedHull<S>& b, GjkCache<S>& cache, HullAnswers& answers)
{
    NumberHash& hash = answers.hash;
    const GjkResult<S> apart = isaGjk(a, b, S(0), cache);
    hash.add(static_cast<std::uint32_t>(apart.state));
    hash.addVector(apart.axis);
    const GjkResult<S> near = gjkDistance(a, b, S(2), cache);
    hash.add(static_cast<std::uint32_t>(near.state));
    hash.add(near.distance);
    hash.addVector(near.axis);
    hash.addVector(near.pointA);
    hash.addVector(near.pointB);
    const PenetrationResult<S> deep = penetration(a, b, cache);
    hash.add(static_cast<std::uint32_t>(deep.state));
    hash.add(deep.depth);
    hash.addVector(deep.axis);
    hash.addVector(deep.pointA);
    answers.separated += near.state == GjkState::Separated;
    answers.near += near.state == GjkState::Near;
    answers.overlapping += near.state == GjkState::Overlapping;
}

/// Each of 300 pairs is asked in three poses near each other, with the same cache.
template <class S>
HullAnswers hullAnswers()
{
    Random random(2010);
    HullAnswers answers;
    for (int pair = 0; pair < 300; ++pair)
    {
        const Hull<S> a = hullOf<S>(drawPoints(random)), b = hullOf<S>(drawPoints(random));
        const Eigen::Matrix3d turnA = drawRotation(random), turnB = drawRotation(random);
        Eigen::Vector3d between;
        for (int axis = 0; axis < 3; ++axis)
            between[axis] = draw(random, -3.0f, 3.0f);
        GjkCache<S> cache;
        for (int step = 0; step < 3; ++step)
        {
            const Eigen::Vector3d at = between * (1.0 + 0.0625 * step);
            ask(PosedHull<S>(a, turnA.cast<S>(), Eigen::Matrix<S, 3, 1>::Zero()),
                PosedHull<S>(b, turnB.cast<S>(), at.cast<S>()), cache, answers);
        }
    }
    return answers;
}
}  // namespace cullet::test
