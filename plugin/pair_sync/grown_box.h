// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/plugin/core/precision.h"

#include <limits>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The box, larger by the margin on every side; it encloses the box.
inline Aabb grown(Aabb box, float margin) noexcept
{
    for (int axis = 0; axis < 3; ++axis)
    {
        box.min[axis] -= margin;
        box.max[axis] += margin;
    }
    return box;
}

/// A box that overlaps all those which overlapsWithMargin() finds near the box.
inline Aabb grownToNear(const Aabb& box, float margin) noexcept
{
    // The gap is rounded, by less than a millionth of the limit.
    Aabb reach = grown(box, 2.000002f * margin);
    for (int axis = 0; axis < 3; ++axis)
    {
        // NaN where infinities cancel.
        if (!(reach.min[axis] <= box.min[axis]))
            reach.min[axis] = -std::numeric_limits<float>::infinity();
        if (!(reach.max[axis] >= box.max[axis]))
            reach.max[axis] = std::numeric_limits<float>::infinity();
    }
    return reach;
}

/// False if a box is NaN anywhere, or `outer` is empty.
inline bool encloses(const Aabb& outer, const Aabb& inner) noexcept
{
    for (int axis = 0; axis < 3; ++axis)
    {
        if (!(outer.min[axis] <= inner.min[axis] && inner.max[axis] <= outer.max[axis]))
            return false;
    }
    return true;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
