// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/api.h"
#include "cullet/plugin/core/precision.h"

#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>

#include <cstddef>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Does what btCollisionWorld::rayTest() does, with the tree of each mesh for which prepare() was called. World::rayTest()
/// calls it.
///
/// A btCollisionWorld::ClosestRayResultCallback is called once for a prepared mesh, with the hit that it would keep. Any
/// other callback, a derived class too, is called as by Bullet: with the same hits in the same order, and those that
/// Bullet's tree misses by a rounding. Prepared meshes may be parts of compounds. A world's own rayTest(), as that of soft
/// worlds, is not called.
///
/// Threads: as for btCollisionWorld::rayTest(); on several at once with a cullet::Broadphase.
CULLET_API void rayTest(const btCollisionWorld& world, const btVector3& from, const btVector3& to,
                        btCollisionWorld::RayResultCallback& callback);

/// Does what btCollisionWorld::convexSweepTest() does, likewise: a btCollisionWorld::ClosestConvexResultCallback is called
/// once for a prepared mesh, any other as by Bullet.
CULLET_API void convexSweepTest(const btCollisionWorld& world, const btConvexShape& shape,
                                const btTransform& from, const btTransform& to,
                                btCollisionWorld::ConvexResultCallback& callback,
                                btScalar allowedPenetration = btScalar(0));

/// A ray of a batch.
struct Ray
{
    btVector3 from, to;
};

/// The closest hit of a ray.
struct RayHit
{
    const btCollisionObject* object;  ///< null: no hit; then only the fraction is set
    btScalar fraction;                ///< of the ray; 1 without a hit
    btVector3 normal;                 ///< in world space
    int part;                         ///< as btCollisionWorld::LocalShapeInfo has them; -1 for a convex shape
    int triangle;
};

struct RayBatchOptions
{
    int group = btBroadphaseProxy::DefaultFilter;  ///< filter words of the rays
    int mask = btBroadphaseProxy::AllFilter;
    unsigned flags = 0;  ///< btTriangleRaycastCallback::EFlags
    /// 0: as many as the machine has. Above 1, shapes of classes of the application must allow calls from several threads.
    /// One thread is used for a world without a cullet::Broadphase.
    int threads = 1;
};

/// The closest hits of many rays, each as rayTest() with a ClosestRayResultCallback finds it, on any number of threads.
///
/// @param rays [count]
/// @param hits [out, count]
CULLET_API void rayTestBatch(const btCollisionWorld& world, const Ray* rays, std::size_t count, RayHit* hits,
                             const RayBatchOptions& options = {});
}  // namespace CULLET_PRECISION
}  // namespace cullet
