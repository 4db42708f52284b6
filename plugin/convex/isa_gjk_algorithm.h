// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/epa/epa_cache.h"
#include "cullet/narrow/gjk/gjk_types.h"
#include "cullet/plugin/convex/body_motions.h"
#include "cullet/plugin/convex/convex_pair.h"
#include "cullet/plugin/convex/isa_gjk_registration.h"
#include "cullet/plugin/convex/kept_contacts.h"
#include "cullet/plugin/shapes/hull_cache.h"

#include <BulletCollision/CollisionDispatch/btActivatingCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include <cmath>
#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
struct Touch;
class TriangleTouch;

/// The contacts of one pair of convex shapes; replaces btConvexConvexAlgorithm. See registerIsaGjk().
///
/// Every call reads shapes and transforms anew. Between calls the algorithm keeps the manifold, the separating axis or
/// simplex of the last query, the surface that proved its depth, and references to the cached hulls. All of these are
/// verified when used, so that a body may change its shape, order or transform at any time.
class IsaGjkAlgorithm final : public btActivatingCollisionAlgorithm
{
public:
    /// The bytes that stillness() reads.
    static constexpr std::size_t kFirstBytes = sizeof(btActivatingCollisionAlgorithm) + 28;

    /// @param manifold    the manifold of a parent algorithm, which owns and refreshes it; null: an own one, created
    ///                    when needed
    /// @param closestOnly one point per query, the closest: for queries outside of a step
    /// Constructor and destructor do not use the heap: algorithms of a mesh's triangles are created in every step.
    IsaGjkAlgorithm(IsaGjkRegistration& isaGjk, btPersistentManifold* manifold,
                    const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* a,
                    const btCollisionObjectWrapper* b, bool closestOnly);
    ~IsaGjkAlgorithm() override;

    void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                          const btDispatcherInfo& info, btManifoldResult* result) override;
    btScalar calculateTimeOfImpact(btCollisionObject* a, btCollisionObject* b, const btDispatcherInfo& info,
                                   btManifoldResult* result) override;
    void getAllContactManifolds(btManifoldArray& manifolds) override;

    /// What processCollision() of these bodies does first, unless the pair has a manifold. Afterwards processCollision()
    /// writes to this object and its manifold only: safe to run for different pairs at the same time.
    void makeManifold(const btCollisionObject& a, const btCollisionObject& b);

    /// Enables isIdle() before the first processCollision(), so that a pair that never touches needs no manifold.
    ///
    /// @param breakingThreshold the one that its manifold would have
    void setBreakingThreshold(btScalar breakingThreshold) { m_breakingThreshold = breakingThreshold; }

    /// For a pair in the pair cache that the registration's BodyMotions serve; call again after abandon().
    void track(const btCollisionObject& a, const btCollisionObject& b);
    bool isTracking() const { return m_places[0] != BodyMotions::kNone; }
    /// False for a pair of another dispatcher in a shared array, whose bodies these BodyMotions do not track, and for
    /// an algorithm of queries outside of a step.
    bool belongsTo(const btDispatcher& dispatcher) const
    {
        return m_dispatcher == &dispatcher && !m_closestOnly;
    }

    /// What is known of a pair without a test.
    enum class Stillness : std::uint8_t
    {
        Unknown,
        Idle,   ///< isIdle() would be true
        Asleep  ///< so are both bodies; isIdle() would be true
    };

    /// Not Unknown if the last isIdle() was true, the pair has not changed since, and its bodies have not moved far
    /// enough to make it false now. Call after every update of the motions.
    Stillness stillness(BodyMotions& motions)
    {
        // Untracked pairs have no budget.
        if (m_budget.isForgotten())
            return Stillness::Unknown;
        const float moved = motions.approachBound(m_places[0], m_places[1], m_cache.axis, m_budget.rates());
        if (!m_budget.consume(moved))
            return Stillness::Unknown;
        motions.use(m_places[0]);
        motions.use(m_places[1]);
        return moved == 0.0f && std::signbit(moved) ? Stillness::Asleep : Stillness::Idle;
    }

    /// True if processCollision() of these bodies would change nothing but cached state, and maybe create an empty
    /// manifold that is not needed: the shapes are too far apart, there is no contact to remove, and a pair with a
    /// kinematic body already has a manifold, since Bullet's islands wake bodies that share one with it.
    ///
    /// Reads bodies and shapes and writes to this object only: safe to run for different pairs at the same time.
    bool isIdle(const btCollisionObject& a, const btCollisionObject& b);

private:
    void process(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b,
                 const btDispatcherInfo& info, btManifoldResult& result);
    void processHulls(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b,
                      const btDispatcherInfo& info, btManifoldResult& result);
    IsaGjkRegistration& isaGjk() const { return m_keeper.isaGjk(); }
    void touch() noexcept;
    void untrack() noexcept;
    bool canUseBudget() const
    {
        return isTracking() && !isaGjk().motions().isPaused(m_places[0]) &&
               !isaGjk().motions().isPaused(m_places[1]);
    }
    /// The results of a failed proof by the cached axis.
    struct FailedProof
    {
        AxisTest<btScalar> axis;
        KnownHulls hulls = {};
    };
    std::uint64_t passOf(bool isStep) const;
    bool axisStillSeparates(const ConvexPair& pair, btScalar limit, std::uint64_t pass, FailedProof& failed,
                            AxisSurplus* surplus = nullptr);
    bool findsSeparatingAxis(const btCollisionObject& a, const btCollisionObject& b, FailedProof& failed,
                             bool usesBudget);
    void collideAndRefresh(const ConvexPair& pair, const btDispatcherInfo& info, FailedProof& failed,
                           btManifoldResult& result);
    bool collide(const ConvexPair& pair, const btDispatcherInfo& info, FailedProof& failed,
                 btManifoldResult& result);
    bool collideOrThrow(const ConvexPair& pair, const btDispatcherInfo& info, FailedProof& failed,
                        btManifoldResult& result, bool& isReporting);
    GjkState search(const ConvexPair& pair, ConvexCores& cores, btScalar limit,
                    const AxisTest<btScalar>& failed, std::uint64_t pass, Touch& touch);
    void refresh(btManifoldResult& result);
    void report(const ConvexPair& pair, const ConvexCores& cores, const Touch& touch, btScalar extraDistance,
                btManifoldResult& result);
    void reportTriangles(const ConvexPair& pair, const TriangleTouch& triangles, btScalar extraDistance,
                         btManifoldResult& result);
    void runBulletAlgorithm(const ConvexPair& pair, const btDispatcherInfo& info, btManifoldResult& result);

    // The members that stillness() reads are first.
    std::uint32_t m_places[2] = {BodyMotions::kNone, BodyMotions::kNone};
    SeparationBudget m_budget;
    GjkCache<btScalar> m_cache;
    EpaCache m_epaCache;
    bool m_ownsManifold : 1;
    bool m_closestOnly : 1;
    bool m_hasContacts : 1;  ///< may be true without contacts, if others share the manifold
    bool m_isSettled : 1;    ///< the last result did not depend on the start of its search
    bool m_isRefreshed : 1;  ///< the manifold, in this call
    ContactKeeper m_keeper;
    btPersistentManifold* m_manifold;
    HullUse m_hulls[2];
    btScalar m_breakingThreshold = -1;  ///< negative: unknown
};

// Bullet's pool has elements of this size and ignores the requested size.
static_assert(sizeof(IsaGjkAlgorithm) <= 192, "too large for the pool of Bullet's configuration");
}  // namespace CULLET_PRECISION
}  // namespace cullet
