// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/CollisionShapes/btConcaveShape.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
class MeshQueries;

/// Which of the hits of a mesh a callback is to get.
enum class HitsWanted : unsigned char
{
    All,  ///< as Bullet calls it: with each hit nearer than what it last returned, in Bullet's order of triangles
    Closest  ///< once, with the one that would remain: that which a callback of Bullet's class for closest hits keeps
};

/// A prepared mesh that a query may hit, as a shape of an object.
struct MeshTarget
{
    const MeshQueries* mesh;  ///< null: the object's shape is no mesh that is prepared
    const btConcaveShape* shape;
    bool isScaled;  ///< the shape is a btScaledBvhTriangleMeshShape of the mesh
};

/// The prepared mesh of an object, if there is one.
MeshTarget meshTargetOf(const btCollisionObject& object);
}  // namespace CULLET_PRECISION
}  // namespace cullet
