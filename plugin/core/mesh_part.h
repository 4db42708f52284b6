// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <BulletCollision/CollisionShapes/btStridingMeshInterface.h>

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The arrays of one part of a mesh, as its interface names them. Reads triangles as Bullet does, with the same bits.
struct MeshPart
{
    const unsigned char* vertices = nullptr;
    const unsigned char* indices = nullptr;
    int vertexCount = 0, vertexStride = 0, indexStride = 0, triangleCount = 0;
    PHY_ScalarType vertexType = PHY_FLOAT, indexType = PHY_INTEGER;

    /// The arrays stay locked until mesh.unLockReadOnlyVertexBase().
    static MeshPart lock(const btStridingMeshInterface& mesh, int index)
    {
        MeshPart part;
        mesh.getLockedReadOnlyVertexIndexBase(&part.vertices, part.vertexCount, part.vertexType,
                                              part.vertexStride, &part.indices, part.indexStride,
                                              part.triangleCount, part.indexType, index);
        return part;
    }

    /// @param corners [out] three corners
    void read(int triangle, const btVector3& scaling, btVector3* corners) const
    {
        const unsigned char* const at = indices + static_cast<std::ptrdiff_t>(triangle) * indexStride;
        for (int corner = 0; corner < 3; ++corner)
        {
            const unsigned char* const place = vertices + indexAt(at, corner) * vertexStride;
            corners[corner] = vertexType == PHY_FLOAT ? scaledVertex<float>(place, scaling)
                                                      : scaledVertex<double>(place, scaling);
        }
    }

private:
    template <class T>
    static T valueAt(const unsigned char* place)
    {
        T value;
        std::memcpy(&value, place, sizeof(value));
        return value;
    }

    std::ptrdiff_t indexAt(const unsigned char* triangle, int corner) const
    {
        switch (indexType)
        {
            case PHY_INTEGER:
                return valueAt<std::uint32_t>(triangle + 4 * corner);
            case PHY_SHORT:
                return valueAt<std::uint16_t>(triangle + 2 * corner);
            default:
                return triangle[corner];
        }
    }

    /// Rounds to btScalar before it scales, or not at all, as Bullet does.
    template <class T>
    static btVector3 scaledVertex(const unsigned char* place, const btVector3& scaling)
    {
        return btVector3(static_cast<btScalar>(valueAt<T>(place)) * scaling.x(),
                         static_cast<btScalar>(valueAt<T>(place + sizeof(T))) * scaling.y(),
                         static_cast<btScalar>(valueAt<T>(place + 2 * sizeof(T))) * scaling.z());
    }
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
