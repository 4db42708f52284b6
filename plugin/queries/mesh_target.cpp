// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/queries/mesh_target.h"

#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/queries/mesh_registry.h"

#include <BulletCollision/CollisionShapes/btMultimaterialTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
MeshTarget meshTargetOf(const btCollisionShape& shape)
{
    const bool isMultiMaterial = shape.getShapeType() == MULTIMATERIAL_TRIANGLE_MESH_PROXYTYPE &&
                                 isExactly<btMultimaterialTriangleMeshShape>(shape);
    if (shape.getShapeType() == TRIANGLE_MESH_SHAPE_PROXYTYPE || isMultiMaterial)
    {
        const auto& mesh = static_cast<const btBvhTriangleMeshShape&>(shape);
        return {MeshRegistry::shared().find(mesh), &mesh, false, isMultiMaterial};
    }
    if (shape.getShapeType() == SCALED_TRIANGLE_MESH_SHAPE_PROXYTYPE &&
        isExactly<btScaledBvhTriangleMeshShape>(shape))
    {
        const auto& scaled = static_cast<const btScaledBvhTriangleMeshShape&>(shape);
        return {MeshRegistry::shared().find(*scaled.getChildShape()), &scaled, true, true};
    }
    return {nullptr, nullptr, false, false};
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
