// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/plugin/core/precision.h"

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
