// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <BulletCollision/CollisionShapes/btStridingMeshInterface.h>

#include <cstdint>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
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

    /// @param corners [out] three corners
    void read(TriangleName name, btVector3* corners) const;

    std::uint64_t bytes() const noexcept;

private:
    struct Part
    {
        const unsigned char* vertices;
        const unsigned char* indices;
        int vertexCount, vertexStride, indexStride, triangleCount;
        PHY_ScalarType vertexType, indexType;
    };

    static Part readPart(const btStridingMeshInterface& mesh, int index);

    std::vector<Part> m_parts;
    btVector3 m_scaling;
    bool m_isReadable = true;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
