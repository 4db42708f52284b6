// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/box/four_lanes.h"

#include <Eigen/Core>

namespace cullet
{
using LaneNumbers = FourLanes<double>;

/// One vector in each of four lanes.
struct LaneVectors
{
    LaneNumbers x, y, z;

    [[gnu::always_inline]] explicit LaneVectors(const Eigen::Vector3d& v) : x(v[0]), y(v[1]), z(v[2]) {}
    [[gnu::always_inline]] LaneVectors(const LaneNumbers& first, const LaneNumbers& second,
                                       const LaneNumbers& third)
        : x(first), y(second), z(third)
    {
    }

    [[gnu::always_inline]] friend LaneVectors operator-(const LaneVectors& a, const LaneVectors& b)
    {
        return {a.x - b.x, a.y - b.y, a.z - b.z};
    }
    [[gnu::always_inline]] friend LaneVectors operator+(const LaneVectors& a, const LaneVectors& b)
    {
        return {a.x + b.x, a.y + b.y, a.z + b.z};
    }
    [[gnu::always_inline]] friend LaneVectors operator*(const LaneVectors& a, const LaneNumbers& b)
    {
        return {a.x * b, a.y * b, a.z * b};
    }
    [[gnu::always_inline]] friend LaneNumbers dot(const LaneVectors& a, const LaneVectors& b)
    {
        return a.x * b.x + a.y * b.y + a.z * b.z;
    }
};

/// The closest places of one edge and of four others, as parts of their lengths.
struct EdgePlaces
{
    LaneNumbers distance2, onOne, onFour;
};

/// Squared sine of the angle below which two edges are treated as parallel.
constexpr double kParallelEdges2 = 1e-12;

namespace lanes
{
[[gnu::always_inline]] inline LaneNumbers clampedToOne(const LaneNumbers& v)
{
    return LaneNumbers::smaller(LaneNumbers::larger(v, LaneNumbers(0.0)), LaneNumbers(1.0));
}

/// Numbers by which others are divided.
[[gnu::always_inline]] inline LaneNumbers withoutZeros(const LaneNumbers& v)
{
    return LaneNumbers::select(v > LaneNumbers(0.0), v, LaneNumbers(1.0));
}
}  // namespace lanes

/// Ericson 2005, "Real-Time Collision Detection", section 5.1.9. An edge of length 0 is a point; of parallel edges any
/// closest places.
[[gnu::always_inline]] inline EdgePlaces closestOnEdges(const Eigen::Vector3d& from,
                                                        const Eigen::Vector3d& edge,
                                                        const LaneVectors& fromFour, const LaneVectors& four)
{
    const LaneVectors one(edge), apart = LaneVectors(from) - fromFour;
    const LaneNumbers a(edge.squaredNorm()), e = dot(four, four), b = dot(one, four), c = dot(one, apart),
                                             f = dot(four, apart);
    const LaneNumbers across2 = a * e - b * b;
    const LaneNumbers isCrossing = across2 > a * e * kParallelEdges2;
    const LaneNumbers crossing = (b * f - c * e) / LaneNumbers::select(isCrossing, across2, LaneNumbers(1.0));
    const LaneNumbers start =
        LaneNumbers::select(isCrossing, lanes::clampedToOne(crossing), LaneNumbers(0.0));
    const LaneNumbers onFour = lanes::clampedToOne((b * start + f) / lanes::withoutZeros(e));
    // The same place again where neither was clamped.
    const LaneNumbers onOne = lanes::clampedToOne((b * onFour - c) / lanes::withoutZeros(a));
    const LaneVectors way = apart + one * onOne - four * onFour;
    return {dot(way, way), onOne, onFour};
}
}  // namespace cullet
