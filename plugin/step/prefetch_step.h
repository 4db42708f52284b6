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

/// Prefetches shape, flags, island and activation state of an object, which lie side by side.
[[gnu::always_inline]] inline void prefetchState(const void* object)
{
    constexpr std::size_t kShape = 2 * sizeof(btTransform) + 5 * sizeof(btVector3);
    prefetchBytes(object, kShape, kShape + 64);
}

/// The same, and the hit fraction and the CCD threshold, with which an object ends.
[[gnu::always_inline]] inline void prefetchStateAndThreshold(const void* object)
{
    constexpr std::size_t kShape = 2 * sizeof(btTransform) + 5 * sizeof(btVector3);
    prefetchBytes(object, kShape, sizeof(btCollisionObject) / 16 * 16);
}

/// Prefetches the pointers to the bodies of a manifold, which follow its points.
[[gnu::always_inline]] inline void prefetchBodiesOf(const btPersistentManifold* manifold)
{
    constexpr std::size_t kBodies = 16 + MANIFOLD_CACHE_SIZE * sizeof(btManifoldPoint);
    prefetchBytes(manifold, kBodies, kBodies + 32);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
