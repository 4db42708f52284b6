// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/mid/mesh_kernels.h"

namespace cullet
{
/// A box that moves along a segment without turning; with a box of no size, a ray. In the mesh's frame.
struct SweptBox
{
    double origin[3];  ///< start of the segment
    double motion[3];  ///< from there to its end; 0 for a box that rests
    double min[3];     ///< the box about a point of the segment
    double max[3];

    /// Bounds the motion in float, for the whole segment.
    ///
    /// @return false: a number is not finite or so large (1e18) that float would overflow
    bool prepare(SweptQuery& query) const noexcept;
};

/// The share of the segment, rounded up, as a limit of a SweptQuery.
float sweptLimit(double share) noexcept;
}  // namespace cullet
