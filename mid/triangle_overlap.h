// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/mid/mesh_kernels.h"

#include <cstdint>

namespace cullet
{
/// Tests eight triangles against one by separating axes: the normals of both, the nine products of their edges, and for
/// triangles in one plane the six normals of edges in it.
///
/// Coordinates are of one frame, in float. The same bits on every instruction set. No axis separates triangles that cross or
/// touch; those that are apart by less than about 1e-5 of their size and distance may not be separated either.
///
/// @param one corners of the triangle
/// @return a bit for each lane whose triangle is apart from it; none for lanes with a NaN
inline std::uint32_t trianglesApart(const TriangleBlock& block, const float (&one)[3][3],
                                    const MeshKernels& kernels = meshKernels(false))
{
    return kernels.apart(block, one);
}
}  // namespace cullet
