// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/CollisionShapes/btCollisionShape.h>
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

/// A shape of an object, or a part of one.
struct ShapeOfObject
{
    const btCollisionObject* object;
    const btCollisionShape* shape;
    btTransform at;  ///< of the shape, in the world
    int child;       ///< number in its compound; -1: no part of one
};

/// A prepared mesh that a query may hit.
struct MeshTarget
{
    const MeshQueries* mesh;  ///< null: the shape is no mesh that is prepared
    const btConcaveShape* shape;
    bool isScaled;     ///< the shape is a btScaledBvhTriangleMeshShape of the mesh
    bool sweepsInBox;  ///< Bullet sweeps against all triangles in the box of the whole motion
};

/// The prepared mesh that a shape is, if it is one.
MeshTarget meshTargetOf(const btCollisionShape& shape);
}  // namespace CULLET_PRECISION
}  // namespace cullet
