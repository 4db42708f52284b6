// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/queries/mesh_target.h"

#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Tests a ray against a prepared mesh; does what btCollisionWorld::rayTestSingleInternal() does, with Bullet's test of a triangle.
///
/// The hits are those of a plain loop over all triangles. Bullet's tree leaves some of them out: those that its test of a
/// ray and a box misses by a rounding, above all at boxes of no thickness, which only an unquantized tree has.
///
/// @return false: the ray is not finite or too long; the callback was not called
bool testMeshRay(const btVector3& from, const btVector3& to, const ShapeOfObject& tested,
                 const MeshTarget& target, HitsWanted wanted, btCollisionWorld::RayResultCallback& callback);
}  // namespace CULLET_PRECISION
}  // namespace cullet
