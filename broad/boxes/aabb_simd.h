// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/simd_vector.h"
#include "cullet/broad/aabb.h"
#include "cullet/broad/boxes/prefetch_box.h"

#include <cstdint>
#include <cstring>
#include <limits>

namespace cullet
{
// One vector register of any baseline.
using Float4 = VectorOf<float, 4>::Type;
using Int4 = VectorOf<std::int32_t, 4>::Type;

inline Float4 loadFloat4(const float* from) noexcept
{
    Float4 value;
    std::memcpy(&value, from, sizeof value);
    return value;
}

/// Whether a comparison held in all four lanes.
inline bool isTrueInAll(Int4 comparison) noexcept
{
    std::uint64_t halves[2];
    std::memcpy(halves, &comparison, sizeof halves);
    return (halves[0] & halves[1]) == ~std::uint64_t{0};
}

/// The minima of a box; lane 3 repeats lane 2.
inline Float4 minimaOf(const Aabb& box) noexcept
{
    const Float4 low = loadFloat4(box.min);
    return CULLET_SHUFFLE(low, low, 0, 1, 2, 2);
}

/// The maxima of a box; lane 3 repeats lane 2. They are lanes 1 to 3 of a load from the third of the box's six floats.
inline Float4 maximaOf(const Aabb& box) noexcept
{
    const Float4 high = loadFloat4(box.min + 2);
    return CULLET_SHUFFLE(high, high, 1, 2, 3, 3);
}

inline Float4 extentsOf(const Aabb& box) noexcept
{
    return maximaOf(box) - minimaOf(box);
}

/// isValid() in vector registers.
inline bool isValidBranchless(const Aabb& box) noexcept
{
    return isTrueInAll(minimaOf(box) <= maximaOf(box));
}

/// overlaps() without branches: for boxes that often just touch, where branches are mispredicted.
inline bool overlapsBranchless(const Aabb& a, const Aabb& b) noexcept
{
    return isTrueInAll((minimaOf(a) <= maximaOf(b)) & (minimaOf(b) <= maximaOf(a)));
}

/// Per axis, the signed distance from the maximum of `first` to the minimum of `second`.
inline Float4 gapsFromTo(const Aabb& first, const Aabb& second) noexcept
{
    return minimaOf(second) - maximaOf(first);
}

/// Whether a comparison held in any lane.
inline bool isTrueInAny(Int4 comparison) noexcept
{
    std::uint64_t halves[2];
    std::memcpy(halves, &comparison, sizeof halves);
    return (halves[0] | halves[1]) != 0;
}

/// Whether boxes are farther apart than twice the margin on some axis. The result for empty boxes is unspecified.
inline bool areFarApart(const Aabb& a, const Aabb& b, float margin) noexcept
{
    return isTrueInAny((gapsFromTo(a, b) > 2.0f * margin) | (gapsFromTo(b, a) > 2.0f * margin));
}

/// overlapsWithMargin() without branches.
inline bool overlapsWithMarginBranchless(const Aabb& a, const Aabb& b, float margin) noexcept
{
    return !areFarApart(a, b, margin);
}

/// Signed distance of two boxes in the maximum norm over the axes: negative when they overlap.
///
/// Each difference is rounded once. On an axis where both boxes reach the same infinity the difference is NaN; such an
/// axis is left out.
inline float gapOf(const Aabb& a, const Aabb& b) noexcept
{
    const Float4 forward = gapsFromTo(a, b);
    const Float4 backward = gapsFromTo(b, a);
    const Float4 larger = backward > forward ? backward : forward;
    float gap = -std::numeric_limits<float>::infinity();
    for (int axis = 0; axis < 3; ++axis)
        gap = larger[axis] > gap ? larger[axis] : gap;
    return gap;
}

/// Whether each face of the box is at most `skin` from the same face of the reference.
///
/// inf - inf is NaN, so equal faces are compared separately.
inline bool isInsideSkin(const Aabb& box, const Aabb& reference, float skin) noexcept
{
    const float* const now = box.min;
    const float* const then = reference.min;
    const auto isNear = [skin](Float4 a, Float4 b)
    {
        const Float4 motion = a - b;
        return ((motion <= skin) & (motion >= -skin)) | (a == b);
    };
    return isTrueInAll(isNear(loadFloat4(now), loadFloat4(then)) &
                       isNear(loadFloat4(now + 2), loadFloat4(then + 2)));
}
}  // namespace cullet
