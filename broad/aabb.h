// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/float_rounding.h"
#include "cullet/broad/host_device.h"

#include <cstdint>
#include <limits>

namespace cullet
{
/// Axis-aligned box in world space, closed on every side: boxes that only touch overlap.
///
/// Unit: length unit of the caller's world. A box with min > max on any axis, or with a NaN, is *empty*: it
/// overlaps nothing, itself included. Infinite and huge coordinates are legal.
struct Aabb
{
    float min[3];
    float max[3];
};

/// The box that overlaps nothing; the value of rows that hold no proxy.
inline constexpr Aabb kEmptyAabb = {
    {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity(),
     std::numeric_limits<float>::infinity()},
    {-std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
     -std::numeric_limits<float>::infinity()}};

/// True unless the box is empty (inverted or with a NaN on any axis).
///
/// Written so that a NaN makes a comparison false and with it the result.
CULLET_HOST_DEVICE inline bool isValid(const Aabb& box) noexcept
{
    return box.min[0] <= box.max[0] && box.min[1] <= box.max[1] && box.min[2] <= box.max[2];
}

/// Closed-interval overlap of two valid boxes; the one predicate that every backend shares.
///
/// @pre both boxes are valid: an inverted box can pass this test. NaN never passes.
CULLET_HOST_DEVICE inline bool overlaps(const Aabb& a, const Aabb& b) noexcept
{
    return a.min[0] <= b.max[0] && b.min[0] <= a.max[0] && a.min[1] <= b.max[1] && b.min[1] <= a.max[1] &&
           a.min[2] <= b.max[2] && b.min[2] <= a.max[2];
}

/// Overlap of two valid boxes after both were grown by `margin` on every side, as gaps <= 2 * margin.
///
/// Evaluated as `b.min - a.max <= 2 margin` per axis: one correctly rounded subtraction, so that every backend and
/// machine agrees bit for bit. For margin 0 it equals overlaps() for all finite boxes. Differences of equal
/// infinities are NaN; `!(gap > limit)` counts them as near, which is right for boxes that reach infinity together.
///
/// @pre both boxes are valid
CULLET_HOST_DEVICE inline bool overlapsWithMargin(const Aabb& a, const Aabb& b, float margin) noexcept
{
    const float limit = 2.0f * margin;
    for (int axis = 0; axis < 3; ++axis)
    {
        if (b.min[axis] - a.max[axis] > limit || a.min[axis] - b.max[axis] > limit)
            return false;
    }
    return true;
}

inline bool operator==(const Aabb& a, const Aabb& b) noexcept
{
    return a.min[0] == b.min[0] && a.min[1] == b.min[1] && a.min[2] == b.min[2] && a.max[0] == b.max[0] &&
           a.max[1] == b.max[1] && a.max[2] == b.max[2];
}

inline bool operator!=(const Aabb& a, const Aabb& b) noexcept
{
    return !(a == b);
}
}  // namespace cullet
