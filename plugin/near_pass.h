// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/convex/contact_jobs.h"
#include "cullet/plugin/convex/pair_kind.h"
#include "cullet/plugin/convex_dispatcher.h"
#include "cullet/plugin/core/class_memo.h"
#include "cullet/plugin/shapes/shape_contents.h"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>

#include <optional>

namespace cullet
{
inline namespace CULLET_PRECISION
{
class IsaGjkAlgorithm;
class PairCache;

/// Null for a pair with another algorithm, or with one of another dispatcher.
IsaGjkAlgorithm* isaGjkOf(const btBroadphasePair& pair, const btDispatcher& dispatcher);

inline btCollisionObject& bodyOf(const btBroadphaseProxy* proxy)
{
    return *static_cast<btCollisionObject*>(proxy->m_clientObject);
}

/// Bullet's path returns at once for a pair of sleeping bodies.
inline bool areAsleep(const btCollisionObject& a, const btCollisionObject& b)
{
    return !a.isActive() && !b.isActive();
}

/// The pass of a dispatch over all pairs in order. What Bullet's near callback does for a pair is done here in line:
/// filters, creation of the algorithm and of its manifold. The rest is a job, if pair and dispatch permit that, and is
/// done at once otherwise. So the manifolds are created and released in the order of the pairs.
class Dispatcher::NearPass final : public btOverlapCallback
{
public:
    NearPass(Dispatcher& dispatcher, btOverlappingPairCache& cache, const btDispatcherInfo& info);

    bool processOverlap(btBroadphasePair& pair) override;
    /// Processes all pairs of the cache, in its order.
    ///
    /// @param dispatcher as of btOverlappingPairCache::processAllOverlappingPairs()
    void run(btDispatcher* dispatcher);
    /// Runs the jobs that are left, and counts. Call it after the pass, even if that ended by an exception.
    void finish();

private:
    SerialReason serialReason() const;
    const PairCache* unreadPairs() const;
    bool isIdle(const btBroadphasePair& pair) const;
    void prefetchAhead(const btBroadphasePair& pair) const;
    bool usesOwnNearCallback() const
    {
        return m_dispatcher.getNearCallback() == m_dispatcher.m_ownNearCallback;
    }
    bool isIdleInTurn(const btBroadphasePair& pair);
    void noteForeign(const btBroadphasePair& pair);
    bool isForeign(const btBroadphasePair& pair);
    PairKind kindOf(btCollisionAlgorithm& algorithm, const btCollisionObject& a, const btCollisionObject& b);
    void takeBulletsPath(btBroadphasePair& pair);
    void makeAlgorithm(btBroadphasePair& pair, btCollisionObject& a, btCollisionObject& b);
    void collide(btBroadphasePair& pair, btCollisionObject& a, btCollisionObject& b);
    bool isAtRest(const ContactJob& job);
    void deferOrRun(const ContactJob& job);
    bool defer(const ContactJob& job, PairKind kind);
    void runUnknown(const ContactJob& job);

    Dispatcher& m_dispatcher;
    btOverlappingPairCache& m_cache;
    const btBroadphasePair* m_pairs;
    const PairCache* m_unreadPairs;  ///< the cache if its bodies are worth prefetching, else null
    bool m_wereMostAsleep;           ///< of the last dispatch, most pairs had no contacts to compute
    const btDispatcherInfo& m_info;
    ContactJobs& m_jobs;
    std::optional<PairKinds> m_kinds;        ///< none before the first pair whose kind is asked
    ClassMemo<bool> m_bodies;                ///< whether the class is Bullet's
    ClassMemo<bool> m_compounds;             ///< whether an algorithm is a CompoundAlgorithm
    std::optional<ContentsMemo> m_contents;  ///< exists once a compound has not moved
    bool m_isInLine;                         ///< Bullet's near callback, without the call
    bool m_findsForeign;                     ///< some pairs may be found not to be foreign
    SerialReason m_reason;
    std::uint64_t m_near = 0;  ///< pairs whose contacts are computed
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
