// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/mesh/triangle_source.h"

#include "cullet/plugin/core/dynamic_type.h"

#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btMultimaterialTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btStridingMeshInterface.h>

#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// The arrays of one part of a mesh while they are locked.
class LockedPart
{
public:
    explicit LockedPart(const btStridingMeshInterface& mesh) : m_mesh(mesh) {}
    ~LockedPart() { unlock(); }
    LockedPart(const LockedPart&) = delete;
    LockedPart& operator=(const LockedPart&) = delete;

    void lock(int part)
    {
        if (m_part == part)
            return;
        unlock();
        m_mesh.getLockedReadOnlyVertexIndexBase(&m_vertices, m_vertexCount, m_type, m_vertexStride,
                                                &m_indices, m_indexStride, m_triangleCount, m_indexType,
                                                part);
        m_part = part;
    }

    /// The corners of a triangle of the locked part, times the mesh's scale.
    void read(int triangle, btVector3 (&corners)[3]) const
    {
        const btVector3& scale = m_mesh.getScaling();
        const unsigned char* const at = m_indices + triangle * m_indexStride;
        for (int i = 0; i < 3; ++i)
            corners[i] = vertex(indexAt(at, i)) * scale;
    }

private:
    void unlock()
    {
        if (m_part >= 0)
            m_mesh.unLockReadOnlyVertexBase(m_part);
        m_part = -1;
    }

    int indexAt(const unsigned char* triangle, int i) const
    {
        switch (m_indexType)
        {
            case PHY_SHORT:
                return reinterpret_cast<const std::uint16_t*>(triangle)[i];
            case PHY_UCHAR:
                return triangle[i];
            default:
                return reinterpret_cast<const int*>(triangle)[i];
        }
    }

    btVector3 vertex(int index) const
    {
        const unsigned char* const at = m_vertices + index * m_vertexStride;
        return m_type == PHY_FLOAT ? read(reinterpret_cast<const float*>(at))
                                   : read(reinterpret_cast<const double*>(at));
    }

    template <class Number>
    static btVector3 read(const Number* v)
    {
        return btVector3(btScalar(v[0]), btScalar(v[1]), btScalar(v[2]));
    }

    const btStridingMeshInterface& m_mesh;
    int m_part = -1;  ///< locked; -1: none
    const unsigned char *m_vertices = nullptr, *m_indices = nullptr;
    int m_vertexCount = 0, m_vertexStride = 0, m_indexStride = 0, m_triangleCount = 0;
    PHY_ScalarType m_type = PHY_FLOAT, m_indexType = PHY_INTEGER;
};

/// Reads the triangles at the leaves of Bullet's tree.
class LeafReader final : public btNodeOverlapCallback
{
public:
    LeafReader(const btStridingMeshInterface& mesh, btTriangleCallback& callback)
        : m_part(mesh), m_callback(callback)
    {
    }

    void processNode(int part, int triangle) override
    {
        btVector3 corners[3];
        m_part.lock(part);
        m_part.read(triangle, corners);
        m_callback.processTriangle(corners, part, triangle);
    }

private:
    LockedPart m_part;
    btTriangleCallback& m_callback;
};

/// Scales triangles on their way to another callback.
class Scaler final : public btTriangleCallback
{
public:
    Scaler(btTriangleCallback& callback, const btVector3& scale) : m_callback(callback), m_scale(scale) {}

    void processTriangle(btVector3* corners, int part, int index) override
    {
        btVector3 scaled[3];
        for (int i = 0; i < 3; ++i)
            scaled[i] = corners[i] * m_scale;
        m_callback.processTriangle(scaled, part, index);
    }

private:
    btTriangleCallback& m_callback;
    const btVector3& m_scale;
};

/// The part of a shape's tree in a box.
///
/// @return false if the shape has no tree
bool readTree(const btBvhTriangleMeshShape& shape, btTriangleCallback& callback, const btVector3& low,
              const btVector3& high)
{
    const btOptimizedBvh* const tree = const_cast<btBvhTriangleMeshShape&>(shape).getOptimizedBvh();
    if (tree == nullptr)
        return false;
    LeafReader reader(*shape.getMeshInterface(), callback);
    tree->reportAabbOverlappingNodex(&reader, low, high);
    return true;
}

/// The unscaled mesh is asked for the box that Bullet asks it for, rounding included.
void readScaled(const btScaledBvhTriangleMeshShape& shape, btTriangleCallback& callback, const btVector3& low,
                const btVector3& high)
{
    const btVector3& scale = shape.getLocalScaling();
    btVector3 unscaledLow, unscaledHigh;
    for (int i = 0; i < 3; ++i)
    {
        const btScalar inverse = btScalar(1) / scale[i];
        unscaledLow[i] = (scale[i] >= 0 ? low[i] : high[i]) * inverse;
        unscaledHigh[i] = (scale[i] <= 0 ? low[i] : high[i]) * inverse;
    }
    Scaler scaler(callback, scale);
    forEachTriangle(*shape.getChildShape(), scaler, unscaledLow, unscaledHigh);
}
}  // namespace

void forEachTriangle(const btConcaveShape& shape, btTriangleCallback& callback, const btVector3& low,
                     const btVector3& high)
{
    if (isExactly<btScaledBvhTriangleMeshShape>(shape))
        return readScaled(static_cast<const btScaledBvhTriangleMeshShape&>(shape), callback, low, high);
    const bool hasTree =
        isExactly<btBvhTriangleMeshShape>(shape) || isExactly<btMultimaterialTriangleMeshShape>(shape);
    if (!hasTree || !readTree(static_cast<const btBvhTriangleMeshShape&>(shape), callback, low, high))
        shape.processAllTriangles(&callback, low, high);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
