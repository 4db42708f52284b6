// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/mesh_part.h"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Whether the coordinates of two vectors are the same, NaN and signs of zeros included.
inline bool hasSameBits(const btVector3& a, const btVector3& b)
{
    // One coordinate at a time, of a constant size: the compiler makes a comparison of each.
    return std::memcmp(&a.m_floats[0], &b.m_floats[0], sizeof(btScalar)) == 0 &&
           std::memcmp(&a.m_floats[1], &b.m_floats[1], sizeof(btScalar)) == 0 &&
           std::memcmp(&a.m_floats[2], &b.m_floats[2], sizeof(btScalar)) == 0;
}

/// Part and index of a triangle, as Bullet's callbacks get them.
struct TriangleName
{
    int part;
    int index;
};

/// Where an application keeps the triangles of a mesh. Reads them as Bullet does, with the same bits.
class MeshArrays
{
public:
    explicit MeshArrays(const btStridingMeshInterface& mesh);

    /// Whether all coordinates and indices have types that Bullet reads.
    bool isReadable() const noexcept { return m_isReadable; }

    /// Whether the mesh interface names the same arrays, of the same sizes and types, and has the same scaling.
    bool areThoseOf(const btStridingMeshInterface& mesh) const;

    bool has(TriangleName name) const noexcept;

    /// Triangles are numbered from part to part.
    ///
    /// @return UINT32_MAX or more: too many for numbers of 32 bits
    std::uint64_t triangleCount() const noexcept;

    /// @pre has(name)
    std::uint32_t numberOf(TriangleName name) const
    {
        return m_parts[static_cast<std::size_t>(name.part)].first + static_cast<std::uint32_t>(name.index);
    }

    TriangleName nameOf(std::uint32_t number) const
    {
        int part = static_cast<int>(m_parts.size()) - 1;
        while (number < m_parts[static_cast<std::size_t>(part)].first)
            --part;
        return {part, static_cast<int>(number - m_parts[static_cast<std::size_t>(part)].first)};
    }

    /// @param corners [out] three corners
    void read(TriangleName name, btVector3* corners) const;

    std::uint64_t bytes() const noexcept;

private:
    struct Part : MeshPart
    {
        std::uint32_t first = 0;  ///< number of its first triangle
    };

    static Part readPart(const btStridingMeshInterface& mesh, int index);

    std::vector<Part> m_parts;
    btVector3 m_scaling;
    bool m_isReadable = true;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
