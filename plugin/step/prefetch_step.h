// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/prefetch.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

#include <cstddef>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Objects between a prefetch and its use.
inline constexpr int kPrefetchDistance = 8;

/// Where the flags of an object are, which its marks and its activation state follow.
inline constexpr std::size_t kFlags = sizeof(void*) + 2 * sizeof(btTransform) + 3 * sizeof(btVector3) +
                                      2 * sizeof(btScalar) + 4 * sizeof(void*);

/// Prefetches flags, island and activation state of an object, which lie side by side.
[[gnu::always_inline]] inline void prefetchState(const void* object)
{
    prefetchByte(object, kFlags);
    prefetchByte(object, kFlags + 5 * sizeof(int));
}

/// Prefetches flags, island, activation state, hit fraction and CCD threshold, with which an object ends.
[[gnu::always_inline]] inline void prefetchStateAndThreshold(const void* object)
{
    constexpr std::size_t kShape = 2 * sizeof(btTransform) + 5 * sizeof(btVector3);
    prefetchBytes(object, kShape, sizeof(btCollisionObject) / 16 * 16);
}

/// Prefetches of an object what decides whether it is at rest: flags and marks; transform, proxy and shape if its box is
/// compared, else its state. By single bytes, since each further cache line of a static world counts.
[[gnu::always_inline]] inline void prefetchResting(const void* object, bool hasBox)
{
    constexpr std::size_t kTransform = sizeof(void*), kProxy = kFlags - 4 * sizeof(void*);
    constexpr std::size_t kHitFraction =
        sizeof(btCollisionObject) - sizeof(btVector3) - 3 * sizeof(btScalar) - 12 * sizeof(int);
    for (std::size_t at = kTransform; hasBox && at < kTransform + sizeof(btTransform); at += 64)
        prefetchByte(object, at);
    if (hasBox)
        prefetchByte(object, kTransform + sizeof(btTransform) - 1);
    prefetchByte(object, hasBox ? kProxy : kFlags);
    prefetchByte(object, kFlags + (hasBox ? 2 : 4) * sizeof(int));
    prefetchByte(object, kHitFraction);
}

/// Prefetches all of a rigid body that decides whether the loops of a step may leave it out while it sleeps: up to its damping,
/// which follows the forces.
[[gnu::always_inline]] inline void prefetchSleeper(const void* body)
{
    constexpr std::size_t kRigidPart = sizeof(btCollisionObject) / 16 * 16;
    prefetchBytes(body, 0, kRigidPart + 12 * sizeof(btVector3));
}

/// Prefetches the points of a manifold, as far as rows are made from them.
[[gnu::always_inline]] inline void prefetchPointsOf(const btPersistentManifold* manifold)
{
    prefetchBytes(manifold, 0, 16 + MANIFOLD_CACHE_SIZE * sizeof(btManifoldPoint) + 32);
}

/// Prefetches the pointers to the bodies of a manifold, which follow its points.
[[gnu::always_inline]] inline void prefetchBodiesOf(const btPersistentManifold* manifold)
{
    constexpr std::size_t kBodies = 16 + MANIFOLD_CACHE_SIZE * sizeof(btManifoldPoint);
    prefetchBytes(manifold, kBodies, kBodies + 32);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
