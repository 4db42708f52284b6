// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/float_rounding.h"
#include "cullet/base/host_device.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cullet
{
/// Axis-aligned box of a part of a mesh, in the mesh's frame; closed: boxes that only touch overlap.
struct MeshBox
{
    float min[3];
    float max[3];
};

/// The box that no query finds.
inline constexpr MeshBox kEmptyMeshBox = {
    {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity(),
     std::numeric_limits<float>::infinity()},
    {-std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
     -std::numeric_limits<float>::infinity()}};

/// False for an empty box and for one with a NaN.
CULLET_HOST_DEVICE inline bool isValid(const MeshBox& box) noexcept
{
    return box.min[0] <= box.max[0] && box.min[1] <= box.max[1] && box.min[2] <= box.max[2];
}

/// The box around a triangle, grown on each axis by a share of its size there and rounded outward.
///
/// @param corners    three points of three coordinates each, indexed by []
/// @param growth     0 or more
/// @return an empty box if a coordinate is not finite or beyond the floats: such a triangle is never found
template <class Point>
MeshBox boxOfTriangle(const Point* corners, double growth) noexcept
{
    MeshBox box;
    for (int axis = 0; axis < 3; ++axis)
    {
        const double a = corners[0][axis], b = corners[1][axis], c = corners[2][axis];
        const double low = std::min({a, b, c}), high = std::max({a, b, c});
        const double grown = growth * (high - low);
        // A sum has every NaN; std::min() may drop one.
        if (!std::isfinite(a + b + c))
            return kEmptyMeshBox;
        box.min[axis] = roundDownToFloat(low - grown);
        box.max[axis] = roundUpToFloat(high + grown);
        if (!std::isfinite(box.min[axis]) || !std::isfinite(box.max[axis]))
            return kEmptyMeshBox;
    }
    return box;
}
}  // namespace cullet
