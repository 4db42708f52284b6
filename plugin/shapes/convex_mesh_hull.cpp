// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/shapes/convex_mesh_hull.h"

#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/core/mesh_part.h"
#include "cullet/plugin/shapes/hull_preparation.h"

#include <BulletCollision/CollisionShapes/btConvexTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <tuple>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
auto coordinates(const btVector3& v)
{
    return std::make_tuple(v.x(), v.y(), v.z());
}
}  // namespace

bool ConvexMeshHull::isPossible(const btCollisionShape& shape)
{
    if (shape.getShapeType() != CONVEX_TRIANGLEMESH_SHAPE_PROXYTYPE ||
        !isExactly<btConvexTriangleMeshShape>(shape))
        return false;
    const btStridingMeshInterface& mesh =
        *static_cast<const btConvexTriangleMeshShape&>(shape).getMeshInterface();
    return isExactly<btTriangleIndexVertexArray>(mesh) || isExactly<btTriangleMesh>(mesh);
}

const btConvexHullShape* ConvexMeshHull::hullOf(const btConvexTriangleMeshShape& shape)
try
{
    readCorners(shape);
    if (!areFinite())
        return nullptr;
    if (hasChanged())
        makeHull();
    if (m_hull && m_hull->getMargin() != shape.getMargin())
        m_hull->setMargin(shape.getMargin());
    return m_hull.get();
}
catch (const std::bad_alloc&)
{
    m_hull.reset();
    m_lastCorners.clear();
    return nullptr;
}

void ConvexMeshHull::readCorners(const btConvexTriangleMeshShape& shape)
{
    const btStridingMeshInterface& mesh = *shape.getMeshInterface();
    m_corners.clear();
    for (int index = 0; index < mesh.getNumSubParts(); ++index)
    {
        const MeshPart part = MeshPart::lock(mesh, index);
        for (int triangle = 0; triangle < part.triangleCount; ++triangle)
        {
            btVector3 corners[3];
            part.read(triangle, mesh.getScaling(), corners);
            m_corners.insert(m_corners.end(), corners, corners + 3);
        }
        mesh.unLockReadOnlyVertexBase(index);
    }
}

bool ConvexMeshHull::areFinite() const
{
    return std::all_of(m_corners.begin(), m_corners.end(),
                       [](const btVector3& v)
                       { return std::isfinite(v.x()) && std::isfinite(v.y()) && std::isfinite(v.z()); });
}

bool ConvexMeshHull::hasChanged() const
{
    return !std::equal(m_corners.begin(), m_corners.end(), m_lastCorners.begin(), m_lastCorners.end(),
                       [](const btVector3& a, const btVector3& b)
                       { return coordinates(a) == coordinates(b); });
}

void ConvexMeshHull::makeHull()
{
    std::vector<btVector3> points = m_corners;
    std::sort(points.begin(), points.end(),
              [](const btVector3& a, const btVector3& b) { return coordinates(a) < coordinates(b); });
    points.erase(
        std::unique(points.begin(), points.end(),
                    [](const btVector3& a, const btVector3& b) { return coordinates(a) == coordinates(b); }),
        points.end());
    m_hull.reset();
    if (!points.empty())
        m_hull = std::make_unique<btConvexHullShape>(points[0].m_floats, static_cast<int>(points.size()),
                                                     static_cast<int>(sizeof(btVector3)));
    // Another hull may have been at this address, and its points compared in this pass.
    if (m_hull)
        invalidate(*m_hull);
    m_lastCorners = m_corners;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
