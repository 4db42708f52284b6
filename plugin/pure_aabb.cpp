// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "plugin/pure_aabb.h"

#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btConvexTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btEmptyShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTetrahedronShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <btBulletCollisionCommon.h>

#include <typeinfo>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Classes without a function in Bullet's library, such as btCapsuleShapeX, have a type_info in every library with hidden
/// visibility; hence a comparison by name, which type_info does.
template <class... Shapes>
bool isExactly(const btCollisionShape& shape)
{
    // The virtual table of a class that was compiled without RTTI has null here, which the compiler does not expect.
    const std::type_info* const volatile place = &typeid(shape);
    const std::type_info* const type = place;
    return type != nullptr && ((*type == typeid(Shapes)) || ...);
}
}  // namespace

bool hasPureAabb(const btCollisionShape& shape)
{
    switch (shape.getShapeType())
    {
        case BOX_SHAPE_PROXYTYPE:
            return isExactly<btBoxShape>(shape);
        case SPHERE_SHAPE_PROXYTYPE:
            return isExactly<btSphereShape>(shape);
        case CONVEX_HULL_SHAPE_PROXYTYPE:
            return isExactly<btConvexHullShape>(shape);
        case CAPSULE_SHAPE_PROXYTYPE:
            return isExactly<btCapsuleShape, btCapsuleShapeX, btCapsuleShapeZ>(shape);
        case CYLINDER_SHAPE_PROXYTYPE:
            return isExactly<btCylinderShape, btCylinderShapeX, btCylinderShapeZ>(shape);
        case CONE_SHAPE_PROXYTYPE:
            return isExactly<btConeShape, btConeShapeX, btConeShapeZ>(shape);
        case COMPOUND_SHAPE_PROXYTYPE:
            return isExactly<btCompoundShape>(shape);
        case MULTI_SPHERE_SHAPE_PROXYTYPE:
            return isExactly<btMultiSphereShape>(shape);
        case TRIANGLE_SHAPE_PROXYTYPE:
            return isExactly<btTriangleShape>(shape);
        case TETRAHEDRAL_SHAPE_PROXYTYPE:
            return isExactly<btBU_Simplex1to4>(shape);
        case CONVEX_TRIANGLEMESH_SHAPE_PROXYTYPE:
            return isExactly<btConvexTriangleMeshShape>(shape);
        case STATIC_PLANE_PROXYTYPE:
            return isExactly<btStaticPlaneShape>(shape);
        case TRIANGLE_MESH_SHAPE_PROXYTYPE:
            return isExactly<btBvhTriangleMeshShape>(shape);
        case SCALED_TRIANGLE_MESH_SHAPE_PROXYTYPE:
            return isExactly<btScaledBvhTriangleMeshShape>(shape);
        case TERRAIN_SHAPE_PROXYTYPE:
            return isExactly<btHeightfieldTerrainShape>(shape);
        case EMPTY_SHAPE_PROXYTYPE:
            return isExactly<btEmptyShape>(shape);
        default:
            return false;
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
