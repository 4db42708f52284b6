// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/shapes/thread_safe_aabb.h"

#include "cullet/plugin/core/dynamic_type.h"

#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btConvexTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btEmptyShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTetrahedronShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <btBulletCollisionCommon.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
template <class... Shapes>
bool isOneOf(const btCollisionShape& shape)
{
    return (isExactly<Shapes>(shape) || ...);
}
}  // namespace

bool hasThreadSafeAabb(const btCollisionShape& shape)
{
    switch (shape.getShapeType())
    {
        case BOX_SHAPE_PROXYTYPE:
            return isOneOf<btBoxShape>(shape);
        case SPHERE_SHAPE_PROXYTYPE:
            return isOneOf<btSphereShape>(shape);
        case CONVEX_HULL_SHAPE_PROXYTYPE:
            return isOneOf<btConvexHullShape>(shape);
        case CAPSULE_SHAPE_PROXYTYPE:
            return isOneOf<btCapsuleShape, btCapsuleShapeX, btCapsuleShapeZ>(shape);
        case CYLINDER_SHAPE_PROXYTYPE:
            return isOneOf<btCylinderShape, btCylinderShapeX, btCylinderShapeZ>(shape);
        case CONE_SHAPE_PROXYTYPE:
            return isOneOf<btConeShape, btConeShapeX, btConeShapeZ>(shape);
        case COMPOUND_SHAPE_PROXYTYPE:
            return isOneOf<btCompoundShape>(shape);
        case MULTI_SPHERE_SHAPE_PROXYTYPE:
            return isOneOf<btMultiSphereShape>(shape);
        case TRIANGLE_SHAPE_PROXYTYPE:
            return isOneOf<btTriangleShape>(shape);
        case TETRAHEDRAL_SHAPE_PROXYTYPE:
            return isOneOf<btBU_Simplex1to4>(shape);
        case CONVEX_TRIANGLEMESH_SHAPE_PROXYTYPE:
            return isOneOf<btConvexTriangleMeshShape>(shape);
        case STATIC_PLANE_PROXYTYPE:
            return isOneOf<btStaticPlaneShape>(shape);
        case TRIANGLE_MESH_SHAPE_PROXYTYPE:
            return isOneOf<btBvhTriangleMeshShape>(shape);
        case SCALED_TRIANGLE_MESH_SHAPE_PROXYTYPE:
            return isOneOf<btScaledBvhTriangleMeshShape>(shape);
        case TERRAIN_SHAPE_PROXYTYPE:
            return isOneOf<btHeightfieldTerrainShape>(shape);
        case EMPTY_SHAPE_PROXYTYPE:
            return isOneOf<btEmptyShape>(shape);
        default:
            return false;
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
