// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/row_pair.h"

#include <cstdint>

namespace cullet
{
/// Where a body is. 32 bytes; in arrays of floats: x, y, z, the hull's bits, then the quaternion.
struct alignas(16) BodyPose
{
    float position[3];
    std::uint32_t hull;  ///< index in the HullSet
    /// x, y, z, w. Of a length between 1/2 and 2; the rotation is that of the quaternion divided by its length.
    float rotation[4];
};

/// What is known of a pair. One byte.
enum class PairState : std::uint8_t
{
    Apart,        ///< the axis separates the hulls
    Overlapping,  ///< they have a point in common, or touch up to rounding
    Undecided,  ///< neither is proved, even in double: hulls flatter than its rounding. Treat as overlapping
    Invalid  ///< a row is no body, a hull is none or without points, or a pose is not finite or no rotation
};

/// The axis of a pair and its support vertices. 16 bytes.
struct alignas(16) PairAxis
{
    /// Unit length, world axes, from the second body to the first: all of the first lies farther along it than all of
    /// the second, where the state is Apart. Rounded to float, which may hide gaps below 4e-6 of the size of the pair.
    float axis[3];
    /// For the next query: the last support vertices, 16 bits each; 0xffff: unknown.
    std::uint32_t vertices;
};

/// The distance of a pair, and where it is. 32 bytes.
struct alignas(16) PairDistance
{
    /// Closest points, world axes, both relative to the position of the *first* body.
    float pointA[3];
    /// Infinity for pairs farther apart than asked for, with points 0; 0 for all that are not Apart, likewise.
    float distance;
    float pointB[3];
    float unused;  ///< 0
};

/// How deep a pair overlaps, and where. 32 bytes.
struct alignas(16) PairDepth
{
    /// Unit length, world axes, from the second body to the first: the first body, moved by depth * normal, only touches.
    float normal[3];
    float depth;  ///< 0 or more
    /// Deepest point of the second body, world axes, relative to the position of the *first* body. That of the first is
    /// pointB - depth * normal.
    float pointB[3];
    float
        gap;  ///< the depth is proved up to this: the true one is between depth - gap and depth, up to rounding
};

/// A point of a contact. 16 bytes.
struct alignas(16) PairContactPoint
{
    float pointB[3];  ///< of the second body, as PairDepth::pointB
    float depth;      ///< along the normal there; negative: a gap
};

/// Where a pair touches: up to four points. 80 bytes.
struct alignas(16) PairContact
{
    float normal[3];      ///< PairDepth::normal
    std::uint32_t count;  ///< of points, 1 to 4
    /// The deepest first: that of PairDepth, or a corner that lacks at most a thousandth of the sum of its depth and the
    /// margin. Those beyond the count are 0.
    PairContactPoint points[4];
};
}  // namespace cullet
