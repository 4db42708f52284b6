// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/host_device.h"
#include "cullet/cuda/narrow/pair_search.h"
#include "cullet/cuda/narrow/pair_steps.h"
#include "cullet/cuda/narrow/pair_types.h"

#include <cmath>
#include <cstdint>

namespace cullet::convex
{
/// The weights of up to three points whose weighted sum is the point closest to the origin, which is inside of them.
CULLET_HOST_DEVICE inline void weightsOf(const Vec<double> (&p)[4], int count, double (&weights)[3])
{
    weights[0] = 1.0;
    weights[1] = weights[2] = 0.0;
    if (count == 2)
    {
        const Vec<double> edge = p[1] - p[0];
        weights[1] = -dot(p[0], edge) / dot(edge, edge);
        weights[0] = 1.0 - weights[1];
    }
    else if (count >= 3)
    {
        const Vec<double> ab = p[1] - p[0], ac = p[2] - p[0], normal = cross(ab, ac);
        const Vec<double> across = cross(normal, p[0]);
        const double area2 = dot(normal, normal);
        weights[1] = -dot(ac, across) / area2;
        weights[2] = dot(ab, across) / area2;
        weights[0] = 1.0 - weights[1] - weights[2];
    }
}

/// The point of A - B that is closest to the origin, and that of A that it is made of.
struct ClosestPoints
{
    Vec<double> difference, onA;
};

/// @param simplex with which a search for the distance has ended
CULLET_HOST_DEVICE inline ClosestPoints closestOf(const PosedPair<double>& posed,
                                                  const Simplex<double>& simplex)
{
    double weights[3];
    weightsOf(simplex.points(), simplex.count(), weights);
    ClosestPoints closest = {{0, 0, 0}, {0, 0, 0}};
    CULLET_UNROLL
    for (int k = 0; k < 3; ++k)
    {
        if (k >= simplex.count())
            continue;
        closest.difference = mulAdd(simplex.points()[k], weights[k], closest.difference);
        closest.onA = mulAdd(posed.pointA(simplex.ids()[k].a), weights[k], closest.onA);
    }
    return closest;
}

/// Measures the pairs that are apart, in double, from where their boolean search has ended; the axis becomes that of
/// the distance.
struct MeasureDistances
{
    PairReader reader;
    PairMemory memory;
    PairDistance* distances;
    float most;  ///< pairs farther apart are not measured

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const auto pair = static_cast<std::uint32_t>(i);
        distances[pair] = {};
        ReadPair bodies;
        if (memory.states[pair] != PairState::Apart || !reader.read(reader.input.pairs[pair], bodies))
            return;
        const PosedPair<double> posed = bodies.posed<double>();
        PairAxis axis = memory.axes[pair];
        if (isFartherAlong(posed, axis) || !measure(posed, axis, pair))
            distances[pair].distance = INFINITY;
    }

private:
    CULLET_HOST_DEVICE bool isFartherAlong(const PosedPair<double>& posed, const PairAxis& axis) const
    {
        const Vec<double> v = {double(axis.axis[0]), double(axis.axis[1]), double(axis.axis[2])};
        // Rounding has lengthened the axis by less than this.
        return posed.test(v, unpacked(axis.vertices)).along > 1.000001 * double(most);
    }

    /// @return false if the pair is farther apart than `most`
    CULLET_HOST_DEVICE bool measure(const PosedPair<double>& posed, PairAxis& axis, std::uint32_t pair) const
    {
        PairSearch<double, SearchGoal::Distance> search(posed);
        search.run(axis, memory.simplices[pair], SearchStart::Axis);
        memory.axes[pair] = axis;
        const ClosestPoints closest = closestOf(posed, search.simplex());
        const double distance = rootOf(dot(closest.difference, closest.difference));
        if (distance > double(most))
            return false;
        const Vec<double>&onA = closest.onA, onB = onA - closest.difference;
        distances[pair] = {{float(onA.x), float(onA.y), float(onA.z)},
                           float(distance),
                           {float(onB.x), float(onB.y), float(onB.z)},
                           0.0f};
        return true;
    }
};
}  // namespace cullet::convex
