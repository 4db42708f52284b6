// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/row_source.h"

#include <algorithm>

namespace cullet
{
Aabb RayPath::around(double begin, double end) const noexcept
{
    Aabb box;
    for (int axis = 0; axis < 3; ++axis)
    {
        const double a = origin[axis] + direction[axis] * begin;
        const double b = origin[axis] + direction[axis] * end;
        box.min[axis] = roundDownToFloat(std::min(a, b) + low[axis]);
        box.max[axis] = roundUpToFloat(std::max(a, b) + high[axis]);
    }
    return box;
}
}  // namespace cullet
