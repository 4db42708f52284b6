// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/row_pair.h"

#include <cstdint>

namespace cullet
{
/// A mesh in device memory. A triangle with a vertex that does not exist, or with a coordinate that is not finite, is
/// invalid: it is in no pair, until a build or a refit finds it valid.
///
/// Strides count elements, as those of DLPack do: a tensor of floats of shape [vertices, 3] with strides (s, 1), and one of
/// 32-bit integers of shape [triangles, 3] with strides (t, 1).
struct DeviceTriangles
{
    const float* vertices = nullptr;  ///< x, y and z of vertex i from vertices[i * vertexStride] on
    std::uint64_t vertexStride = 3;
    std::uint32_t vertexCount = 0;
    std::uint32_t triangleCount = 0;  ///< below 2^31
    /// The vertices of triangle k from indices[k * indexStride] on; null: they are 3k, 3k + 1 and 3k + 2.
    const std::uint32_t* indices = nullptr;
    std::uint64_t indexStride = 3;
};

/// Which pairs of triangles of one mesh count.
enum class OwnPairs : std::uint8_t
{
    All,
    WithoutNeighbours  ///< not those with a common vertex, by its number
};

/// The pairs of triangles that DeviceTriangleTrees found, in device memory.
struct DeviceTrianglePairs
{
    const RowPair* pairs = nullptr;  ///< [count] ascending by a, then by b
    std::uint64_t count = 0;
    std::uint64_t invalid = 0;  ///< triangles of the meshes that are invalid
};
}  // namespace cullet
