// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/scenes/bodies/broadphase_factory.h"
#include "cullet/demos/scenes/exact_pairs.h"

#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Box and filter words of one proxy; a row of an audit is the object's index in its world.
struct AuditedProxy
{
    ExactBox box;
    int group;
    int mask;
};

/// The proxies of a world, by row.
std::vector<AuditedProxy> collectProxies(const btCollisionWorld& world);

/// The pairs that a perfect broad phase reports for these proxies: overlapping boxes whose filter words agree.
PairDigest digestExact(const std::vector<AuditedProxy>& proxies);

/// The pairs of a world's pair cache whose boxes overlap now, by row. Pairs kept by a margin are excluded.
PairDigest digestCache(btCollisionWorld& world);

/// A broad phase without a world that receives the boxes of a world: two of them have the same boxes even when the
/// worlds that use such broad phases have diverged.
class ShadowBroadphase
{
public:
    ShadowBroadphase(NamedBroadphase broadphase, const std::vector<AuditedProxy>& proxies);
    ~ShadowBroadphase();

    /// Whether these proxies match those of the constructor except for their boxes.
    bool fits(const std::vector<AuditedProxy>& proxies) const;

    /// Sets the boxes and returns the overlapping pairs.
    PairDigest update(const std::vector<AuditedProxy>& proxies);

    std::uint64_t pairCount();

    /// Frees the broad phase and returns the bytes returned to malloc: proxies, tree or grid, and pair cache, without
    /// algorithms and contacts. GPU memory is not included. The object is unusable afterwards.
    std::uint64_t releaseAndMeasure();

private:
    void release();

    NamedBroadphase m_broadphase;
    std::vector<btBroadphaseProxy*> m_proxies;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
