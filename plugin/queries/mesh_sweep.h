// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/queries/mesh_target.h"

#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// A convex shape that moves from one pose to another, as the arguments of btCollisionWorld::convexSweepTest().
struct ConvexSweep
{
    const btConvexShape* shape;
    const btTransform* from;
    const btTransform* to;
    btScalar allowedPenetration;
};

/// Sweeps a shape against a prepared mesh; does what btCollisionWorld::objectQuerySingleInternal() does.
///
/// Bullet sweeps the shape against every triangle whose node it passes. Here the same triangles are taken in the order in
/// which the shape may meet them, as far as the closest hit or the callback's; each is swept by Bullet.
///
/// @return false: the motion is not finite or too long; the callback was not called
bool sweepMesh(const ConvexSweep& sweep, const ShapeOfObject& tested, const MeshTarget& target,
               HitsWanted wanted, btCollisionWorld::ConvexResultCallback& callback);
}  // namespace CULLET_PRECISION
}  // namespace cullet
