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
inline void identify(btManifoldResult& result, const btCollisionObjectWrapper& mesh, int part, int index)
{
    if (result.getBody0Internal() == mesh.getCollisionObject())
        result.setShapeIdentifiersA(part, index);
    else
        result.setShapeIdentifiersB(part, index);
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
        wrap(&triangle);
        identify(result, mesh, triangle.m_partId, triangle.m_index);
    }
    ~ShownTriangle() { wrap(m_before); }
    ShownTriangle(const ShownTriangle&) = delete;
    ShownTriangle& operator=(const ShownTriangle&) = delete;

private:
    void wrap(const btCollisionObjectWrapper* body)
    {
        if (m_isFirst)
            m_result.setBody0Wrap(body);
        else
            m_result.setBody1Wrap(body);
    }

    btManifoldResult& m_result;
    const btCollisionObjectWrapper* m_before;
    bool m_isFirst;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
