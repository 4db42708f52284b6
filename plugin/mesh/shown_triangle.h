// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"
#include "cullet/plugin/mesh/triangle_batch.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// A triangle of a mesh as Bullet shows it to its algorithms.
class WrappedTriangle
{
public:
    WrappedTriangle(const btCollisionObjectWrapper& mesh, const TriangleBatch::Triangle& triangle)
        : m_shape(triangle.corners[0], triangle.corners[1], triangle.corners[2]),
          m_wrap(&mesh, &m_shape, mesh.getCollisionObject(), mesh.getWorldTransform(), triangle.part,
                 triangle.index)
    {
        m_shape.setMargin(mesh.getCollisionShape()->getMargin());
    }

    const btCollisionObjectWrapper& wrap() const { return m_wrap; }

private:
    btTriangleShape m_shape;
    const btCollisionObjectWrapper m_wrap;
};

/// Gives a result the identifiers of a triangle, for the points that follow.
inline void identify(btManifoldResult& result, const btCollisionObjectWrapper& mesh,
                     const TriangleBatch::Triangle& triangle)
{
    if (result.getBody0Internal() == mesh.getCollisionObject())
        result.setShapeIdentifiersA(triangle.part, triangle.index);
    else
        result.setShapeIdentifiersB(triangle.part, triangle.index);
}

/// Shows the result of a pair the triangle in place of its mesh, as contact callbacks expect it.
class ShownTriangle
{
public:
    ShownTriangle(btManifoldResult& result, const btCollisionObjectWrapper& mesh,
                  const btCollisionObjectWrapper& triangle)
        : m_result(result), m_isFirst(result.getBody0Internal() == mesh.getCollisionObject())
    {
        m_before = m_isFirst ? result.getBody0Wrap() : result.getBody1Wrap();
        if (m_isFirst)
        {
            result.setBody0Wrap(&triangle);
            result.setShapeIdentifiersA(triangle.m_partId, triangle.m_index);
        }
        else
        {
            result.setBody1Wrap(&triangle);
            result.setShapeIdentifiersB(triangle.m_partId, triangle.m_index);
        }
    }
    ~ShownTriangle()
    {
        if (m_isFirst)
            m_result.setBody0Wrap(m_before);
        else
            m_result.setBody1Wrap(m_before);
    }
    ShownTriangle(const ShownTriangle&) = delete;
    ShownTriangle& operator=(const ShownTriangle&) = delete;

private:
    btManifoldResult& m_result;
    const btCollisionObjectWrapper* m_before;
    bool m_isFirst;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
