// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/device_boxes.h"

#include <cmath>
#include <cstdint>

/// Boxes with skins, and how far boxes have left them.
namespace cullet::psap
{
/// A box when the list was made.
struct SkinnedBox
{
    Aabb box;
    float skin;
};

CULLET_HOST_DEVICE inline SkinnedBox loadSkinned(const AlignedBox* boxes, std::uint64_t i)
{
    const BoxHalf xy = loadHalf(boxes, 2 * i);
    const BoxHalf z = loadHalf(boxes, 2 * i + 1);
    return {{{xy.low0, xy.low1, z.low0}, {xy.high0, xy.high1, z.high0}}, z.high1};
}

/// An upper bound of the rounding error of a sum of that size; 0 for infinite sums, since faces of boxes may be
/// infinite.
CULLET_HOST_DEVICE inline float roundingOf(float sum)
{
    constexpr float kRelative = 0x1p-22f, kAbsolute = 1e-37f;
    const float size = fabsf(sum);
    return size < kInfinity ? size * kRelative + kAbsolute : 0.0f;
}

/// The box enlarged by its skin, rounded outwards.
CULLET_HOST_DEVICE inline Aabb grownBy(const Aabb& box, float skin)
{
    Aabb grown;
    for (int axis = 0; axis < 3; ++axis)
    {
        const float low = box.min[axis] - skin;
        const float high = box.max[axis] + skin;
        grown.min[axis] = low - roundingOf(low);
        grown.max[axis] = high + roundingOf(high);
    }
    return grown;
}

/// Largest displacement of a face of a box, in skins. Infinite where the box has become empty, or was.
CULLET_HOST_DEVICE inline float displacementOf(const SkinnedBox& reference, const Aabb& now)
{
    const bool wasValid = isValid(reference.box);
    if (wasValid != isValid(now))
        return kInfinity;
    return wasValid ? distanceMoved(now, reference.box) / reference.skin : 0.0f;
}
/// Largest displacement for which a list is complete.
inline constexpr float kMostDisplacement = 0.9999f;
}  // namespace cullet::psap
