// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/mesh/triangle_source.h"

#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/mesh/locked_part.h"

#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btMultimaterialTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
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
