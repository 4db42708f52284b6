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
/// Which boxes a world brings up to date, and how.
enum class BoxRule : std::uint8_t
{
    Collision,  ///< btCollisionWorld::updateAabbs(), which all worlds but one inherit
    Simple      ///< btSimpleDynamicsWorld::updateAabbs(): active bodies, without threshold and prediction
};

/// What the last update did.
struct WorldBoxesStats
{
    std::uint64_t parallelBoxes = 0;  ///< boxes computed on the threads
    std::uint64_t serialBoxes =
        0;  ///< boxes of shapes that are not known to be safe there, and oversized ones
    bool hasParallelSets = false;  ///< the broad phase took the boxes from the threads, too
};

/// Brings the boxes of all objects of a world up to date on several threads: the work behind World<Base>.
///
/// The threads only read objects and shapes, so that a Bullet library without thread support will do. A box is computed
/// there when its shape is exactly of one of Bullet's classes whose getAabb() writes to nothing: box, sphere, capsule,
/// cylinder, cone, convex hull, multi-sphere, triangle, tetrahedron, convex mesh, compound, plane, triangle mesh, scaled
/// mesh, terrain and the empty shape. All others are handled one by one on the calling thread: shapes of the application,
/// those derived from Bullet's, those that ask another shape (Minkowski sum, uniform scaling, 2D hull), GImpact meshes
/// and soft bodies.
///
/// cullet::Broadphase takes boxes from the threads directly while it has no ghosts; any other broad phase gets them
/// from the calling thread, by ascending index, as from Bullet. Its callbacks may add and remove objects then: those that
/// come after are handled one by one, as Bullet does it.
class CULLET_API WorldBoxes
{
public:
    /// Objects per task. Below two of them Bullet's own function is as fast. Several threads are worth it from some 8,000 boxes.
    static constexpr std::size_t kGrain = 256;

    WorldBoxes();
    ~WorldBoxes();

    /// @param threads 0: as many as the machine has
    void setThreads(int threads);

    /// Does what the world's own updateAabbs() does, bit for bit.
    ///
    /// @return false: nothing was done, because there are too few objects for it to pay
    bool update(btCollisionWorld& world, BoxRule rule);

    const WorldBoxesStats& stats() const;

private:
    class Job;
    struct Parts;

    std::unique_ptr<Parts> m;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
