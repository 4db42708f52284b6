// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/math/lanes.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>

/// The edges at a corner of A - B between which CornerCone searches for the closest point.
namespace cullet
{
/// An edge from the corner to the point of a vertex of each hull; one of the two vertices is the corner's.
struct ConeEdge
{
    std::int32_t endA, endB;
    Eigen::Vector3d edgeVector;
    double length2;
    double fall;  ///< decrease of the product with the corner along the edge
};

/// Up to two edges, one in each lane.
struct ConeEdges
{
    using Pair = Lanes<double>::Vector;
    using Ends = std::array<std::int32_t, 2>;

    /// Neither a vertex nor a block.
    static constexpr std::int32_t kNone = -2;

    Pair x = {}, y = {}, z = {}, length2 = {}, fall = {};
    Ends endA = {kNone, kNone}, endB = {kNone, kNone};  ///< kNone: the corner's vertex

    void set(int i, const ConeEdge& e, std::int32_t cornerA, std::int32_t cornerB)
    {
        // Writes both lanes, since keeping the other would read it from memory first.
        const auto put = [i](Pair& lanes, double value) { lanes = Pair{i == 0 ? value : lanes[0], value}; };
        put(x, e.edgeVector[0]);
        put(y, e.edgeVector[1]);
        put(z, e.edgeVector[2]);
        put(length2, e.length2);
        put(fall, e.fall);
        endA[i] = e.endA == cornerA ? kNone : e.endA;
        endB[i] = e.endB == cornerB ? kNone : e.endB;
    }
    /// Copies the second edge over the first.
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

/// The closest points in the planes of a new edge and each of two others: weights of both edges, times `scale`.
struct ConeWedges
{
    Lanes<double>::Vector weight, newWeight, scale, gain;
    unsigned inner;  ///< bit i: the point lies between the new edge and edge i
};

[[gnu::always_inline]] inline ConeWedges wedgesOf(const ConeEdges& edges, const ConeEdge& e)
{
    using Two = Lanes<double>::Vector;
    // Squared sine of the angle between two edges; a smaller one leaves too few digits of the weights.
    constexpr double kThin = 1e-8;
    const Two between = edges.x * e.edgeVector[0] + edges.y * e.edgeVector[1] + edges.z * e.edgeVector[2];
    const Two product = edges.length2 * e.length2;
    ConeWedges w;
    w.scale = product - between * between;
    w.weight = edges.fall * e.length2 - e.fall * between;
    w.newWeight = e.fall * edges.length2 - edges.fall * between;
    w.gain = w.weight * edges.fall + w.newWeight * e.fall;
    w.inner = laneBits((w.weight > Two{}) & (w.newWeight > Two{}) & (w.scale > kThin * product));
    return w;
}
}  // namespace cullet
