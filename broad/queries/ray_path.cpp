// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/queries/ray_path.h"

#include <cfloat>
#include <cmath>

namespace cullet
{
bool makeRayPath(const RaySegment& segment, RayPath& path) noexcept
{
    constexpr double kMost = 1e15;
    // From this inverse on the ray counts as parallel: what it moves along the axis is part of the slack.
    constexpr double kSteepest = 1e8;
    // Bullet's test rounds differences of coordinates, and their products.
    constexpr double kRounding = 16.0 / 16777216.0;
    const double length = segment.lambdaMax;
    // Written so that a NaN fails.
    if (!(length >= 0.0 && length <= kMost))
        return false;
    path.length = length * (1.0 + kRounding);
    for (int axis = 0; axis < 3; ++axis)
    {
        const double inverse = segment.inverseDirection[axis];
        const bool isParallel = std::abs(inverse) > kSteepest;
        const double direction = isParallel ? 0.0 : 1.0 / inverse;
        const double reach = std::abs(segment.origin[axis]) + std::abs(segment.growMin[axis]) +
                             std::abs(segment.growMax[axis]) + std::abs(direction) * length;
        if (!(reach <= kMost))
            return false;
        const double slack = reach * kRounding + FLT_MIN + (isParallel ? 2.0 * length / kSteepest : 0.0);
        path.origin[axis] = segment.origin[axis];
        path.direction[axis] = direction;
        path.low[axis] = segment.growMin[axis] - slack;
        path.high[axis] = segment.growMax[axis] + slack;
    }
    return true;
}
}  // namespace cullet
