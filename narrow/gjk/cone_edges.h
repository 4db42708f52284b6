// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/math/lanes.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>

/// The edges at a corner of A - B between which its closest point is looked for; see CornerCone.
namespace cullet
{
/// A vertex of each hull, of which one is the corner's.
struct ConeEdge
{
    std::int32_t endA, endB;
    Eigen::Vector3d way;
    double length2;
    double fall;  ///< by how much the product with the corner decreases along the way
};

/// Up to two of them, side by side.
struct ConeEdges
{
    using Pair = Lanes<double>::Vector;
    using Ends = std::array<std::int32_t, 2>;

    /// No vertex, and no block.
    static constexpr std::int32_t kNone = -2;

    Pair x = {}, y = {}, z = {}, length2 = {}, fall = {};
    Ends endA = {kNone, kNone}, endB = {kNone, kNone};  ///< kNone where it is the corner's

    void set(int i, const ConeEdge& e, std::int32_t cornerA, std::int32_t cornerB)
    {
        // Both lanes, since the other would be read from memory first.
        const auto put = [i](Pair& lanes, double value) { lanes = Pair{i == 0 ? value : lanes[0], value}; };
        put(x, e.way[0]);
        put(y, e.way[1]);
        put(z, e.way[2]);
        put(length2, e.length2);
        put(fall, e.fall);
        endA[i] = e.endA == cornerA ? kNone : e.endA;
        endB[i] = e.endB == cornerB ? kNone : e.endB;
    }
    /// The second is the first, too.
    void moveDown()
    {
        x[0] = x[1];
        y[0] = y[1];
        z[0] = z[1];
        length2[0] = length2[1];
        fall[0] = fall[1];
        endA[0] = endA[1];
        endB[0] = endB[1];
    }
};

/// The closest points in the planes of an edge and each of two: weights of both, times `scale`.
struct ConeWedges
{
    Lanes<double>::Vector weight, newWeight, scale, gain;
    unsigned inner;  ///< bit i: the point lies between the edge and the i-th
};

[[gnu::always_inline]] inline ConeWedges wedgesOf(const ConeEdges& edges, const ConeEdge& e)
{
    using Pair = Lanes<double>::Vector;
    // Squared sine of an angle between edges: less leaves too few digits of the weights.
    constexpr double kThin = 1e-8;
    const Pair between = edges.x * e.way[0] + edges.y * e.way[1] + edges.z * e.way[2];
    const Pair product = edges.length2 * e.length2;
    ConeWedges w;
    w.scale = product - between * between;
    w.weight = edges.fall * e.length2 - e.fall * between;
    w.newWeight = e.fall * edges.length2 - edges.fall * between;
    w.gain = w.weight * edges.fall + w.newWeight * e.fall;
    w.inner = laneBits((w.weight > Pair{}) & (w.newWeight > Pair{}) & (w.scale > kThin * product));
    return w;
}
}  // namespace cullet
