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
/// Box and filter words of one proxy; a row of an audit is the object's place in its world.
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

/// The pairs of a world's pair cache whose boxes overlap now, by row. Pairs that a margin keeps are left out.
PairDigest digestCache(btCollisionWorld& world);

/// A second broad phase, without a world, that is fed with the boxes of a world: two of them see the same boxes even
/// when the worlds that use such broad phases have drifted apart.
class ShadowBroadphase
{
public:
    ShadowBroadphase(NamedBroadphase broadphase, const std::vector<AuditedProxy>& proxies);
    ~ShadowBroadphase();

    /// Whether these are the proxies that it was made with, with other boxes.
    bool fits(const std::vector<AuditedProxy>& proxies) const;

    /// Takes over the boxes and returns the pairs whose boxes overlap now.
    PairDigest update(const std::vector<AuditedProxy>& proxies);

    std::uint64_t pairCount();

    /// Frees the broad phase and returns the bytes that this gave back to malloc: proxies, tree or grid, and pair cache,
    /// without algorithms and contacts. Memory on a GPU is not in it. The object is of no use afterwards.
    std::uint64_t releaseAndMeasure();

private:
    void release();

    NamedBroadphase m_broadphase;
    std::vector<btBroadphaseProxy*> m_proxies;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
