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

/// The maxima, likewise. A box is six floats in a row: they are lanes 1..3 of a load from its third one.
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

/// From the maxima of one box to the minima of the other, per axis.
inline Float4 gapsBehind(const Aabb& first, const Aabb& second) noexcept
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

/// Whether some axis shows that boxes are farther apart than the margin allows; of empty boxes, any answer.
inline bool areFarApart(const Aabb& a, const Aabb& b, float margin) noexcept
{
    return isTrueInAny((gapsBehind(a, b) > 2.0f * margin) | (gapsBehind(b, a) > 2.0f * margin));
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
    const Float4 forward = gapsBehind(a, b);
    const Float4 backward = gapsBehind(b, a);
    const Float4 larger = backward > forward ? backward : forward;
    float gap = -std::numeric_limits<float>::infinity();
    for (int axis = 0; axis < 3; ++axis)
        gap = larger[axis] > gap ? larger[axis] : gap;
    return gap;
}

/// Whether no face of the box is farther than `slack` from where it is in the reference.
///
/// Equal infinities differ by NaN, hence the second chance: a face that did not move is inside.
inline bool isInsideShell(const Aabb& box, const Aabb& reference, float slack) noexcept
{
    const float* const now = box.min;
    const float* const then = reference.min;
    const auto isNear = [slack](Float4 a, Float4 b)
    {
        const Float4 motion = a - b;
        return ((motion <= slack) & (motion >= -slack)) | (a == b);
    };
    return isTrueInAll(isNear(loadFloat4(now), loadFloat4(then)) &
                       isNear(loadFloat4(now + 2), loadFloat4(then + 2)));
}

/// How far apart two boxes may be at their references and still touch inside their shells. A little more than twice the
/// slack, for the rounding of differences.
inline float reachOfShells(float slack) noexcept
{
    return 2.0002f * slack;
}

/// Up to which gap of the references a held pair stays held (overlapsWithMargin()) inside the shells. A little less than
/// it could be, for the same reason.
inline float sureGapOf(float margin, float slack) noexcept
{
    return 1.9999f * margin - reachOfShells(slack);
}
}  // namespace cullet
