// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/api.h"
#include "cullet/plugin/core/precision.h"

#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>

#include <cstddef>
#include <cstdint>
#include <memory>

namespace cullet
{
inline namespace CULLET_PRECISION
{
class WorldRest;

/// Which boxes a world updates, and how.
enum class BoxRule : std::uint8_t
{
    Collision,  ///< btCollisionWorld::updateAabbs(), which all worlds but btSimpleDynamicsWorld inherit
    Simple      ///< btSimpleDynamicsWorld::updateAabbs(): active bodies, without threshold and prediction
};

/// Counters of the last update.
struct WorldBoxesStats
{
    std::uint64_t parallelBoxes = 0;  ///< boxes computed in the parallel loops
    /// Boxes computed on the calling thread: oversized ones, and those of shapes without a thread-safe getAabb().
    std::uint64_t serialBoxes = 0;
    bool hasParallelSets = false;  ///< the parallel loop called setAabb() too
};

/// Updates the boxes of all objects of a world on several threads; the implementation of World<Base>.
///
/// The threads only read objects and shapes, so a Bullet library without thread support suffices. A thread computes a
/// box if its shape is exactly of one of Bullet's classes whose getAabb() is free of writes: box, sphere, capsule,
/// cylinder, cone, convex hull, multi-sphere, triangle, tetrahedron, convex mesh, compound, plane, triangle mesh,
/// scaled mesh, terrain and the empty shape. The calling thread handles all others one by one: shapes of the
/// application, classes derived from Bullet's, shapes that call another shape (Minkowski sum, uniform scaling, 2D
/// hull), GImpact meshes and soft bodies.
///
/// The threads call setAabb() of a cullet::Broadphase directly while it has no ghosts. Any other broad phase is called
/// from the calling thread only, by ascending index, as by Bullet. Its callbacks may then add and remove objects;
/// objects after the first changed index are handled one by one, as by Bullet. On one thread all are.
class CULLET_API WorldBoxes
{
public:
    /// Objects per task. With fewer than two tasks Bullet's own function is as fast; several threads pay from about
    /// 8,000 boxes on.
    static constexpr std::size_t kGrain = 256;
    static constexpr int kLeastObjects = 2 * kGrain;

    WorldBoxes();
    ~WorldBoxes();

    /// @param threads 0: as many as the machine has
    void setThreads(int threads);

    /// Does the same as the world's own updateAabbs(), bit for bit.
    ///
    /// @param rest finds the objects whose boxes need not be set, by the rule Collision; it is not used for Simple
    /// @return false: the world's own function must run, because there are too few objects for several threads, or no
    ///         memory
    bool update(btCollisionWorld& world, BoxRule rule, WorldRest& rest);

    const WorldBoxesStats& stats() const;

private:
    class Job;
    struct Parts;

    std::unique_ptr<Parts> m;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
