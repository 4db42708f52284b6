// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <array>
#include <cstdint>

namespace cullet
{
/// The state that a depth query keeps for the next query of the same two shapes in the same order: a closed surface of
/// triangles inside of A - B, as vertex pairs. 82 bytes.
///
/// The answer is right or NotConverged wherever the shapes have moved; see Penetration.
struct EpaCache
{
    static constexpr int kVertices = 11;
    static constexpr int kFaces = 2 * kVertices - 4;

    std::array<std::int16_t, 3> corners(int face) const
    {
        const int bits = faces[face];
        return {static_cast<std::int16_t>(bits & 15), static_cast<std::int16_t>(bits >> 4 & 15),
                static_cast<std::int16_t>(bits >> 8)};
    }
    void setCorners(int face, int i, int j, int k)
    {
        faces[face] = static_cast<std::uint16_t>(i | j << 4 | k << 8);
    }

    std::array<std::uint16_t, kVertices> verticesA, verticesB;
    std::array<std::uint16_t, kFaces> faces;  ///< three corners of four bits, counter-clockwise from outside
    std::uint8_t vertexCount = 0;             ///< 0: the cache is empty
    std::uint8_t faceCount = 0;
};
static_assert(sizeof(EpaCache) <= 84);
}  // namespace cullet
