// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/queries/mesh_sweep.h"
#include "cullet/plugin/queries/mesh_target.h"

#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Tests a ray against a shape: prepared meshes by their trees, also as parts of compounds, which are visited in Bullet's
/// order; anything else by btCollisionWorld::rayTestSingleInternal().
///
/// @param from, to without rotation
void testRay(const btTransform& from, const btTransform& to, const ShapeOfObject& tested, HitsWanted wanted,
             btCollisionWorld::RayResultCallback& callback);

/// Sweeps a convex shape against a shape, likewise; anything else by btCollisionWorld::objectQuerySingleInternal().
void sweepConvex(const ConvexSweep& sweep, const ShapeOfObject& tested, HitsWanted wanted,
                 btCollisionWorld::ConvexResultCallback& callback);
}  // namespace CULLET_PRECISION
}  // namespace cullet
