// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/broad/backend.h"

#include <array>
#include <limits>

namespace cullet::test
{
inline constexpr float kInfinity = std::numeric_limits<float>::infinity();
inline constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// Filter words that pair with everything.
inline constexpr Filter kEverything = {1, -1};

/// Box of the given half size around (x, y, z).
inline Aabb boxAt(float x, float y, float z, float half = 0.5f)
{
    return {{x - half, y - half, z - half}, {x + half, y + half, z + half}};
}

inline Aabb boxAt(const std::array<float, 3>& centre, float half = 0.5f)
{
    return boxAt(centre[0], centre[1], centre[2], half);
}

/// Box with the same interval on every axis.
inline Aabb cube(float min, float max)
{
    return {{min, min, min}, {max, max, max}};
}

inline Aabb translated(Aabb box, float x, float y, float z)
{
    const float shift[3] = {x, y, z};
    for (int axis = 0; axis < 3; ++axis)
    {
        box.min[axis] += shift[axis];
        box.max[axis] += shift[axis];
    }
    return box;
}

inline Aabb translated(const Aabb& box, const std::array<float, 3>& shift)
{
    return translated(box, shift[0], shift[1], shift[2]);
}
}  // namespace cullet::test
