// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/epa/epa_cache.h"
#include "cullet/narrow/gjk/gjk_types.h"
#include "cullet/plugin/convex/body_motions.h"
#include "cullet/plugin/convex/convex_pair.h"
#include "cullet/plugin/isa_gjk.h"
#include "cullet/plugin/shapes/hull_cache.h"

#include <BulletCollision/CollisionDispatch/btActivatingCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
struct Touch;

/// The contacts of one pair of convex shapes; takes the place of btConvexConvexAlgorithm. See registerIsaGjk().
///
/// Shapes and transforms are read anew in every call; between calls it keeps the manifold, the separating axis or
/// simplex of the last query, what proved its depth, and the graphs of the two hulls. All of that is checked when it is used, so that a body
/// may change its shape, order or place at any time.
class IsaGjkAlgorithm final : public btActivatingCollisionAlgorithm
{
public:
    /// What staysIdle() reads.
    static constexpr std::size_t kFirstBytes = sizeof(btActivatingCollisionAlgorithm) + 28;

    /// @param manifold    of a parent algorithm, which then owns and refreshes it; null: an own one, made when needed
    /// @param closestOnly one point per query, the closest: what queries outside of a step expect
    /// Neither this nor the destructor touches the heap: triangles of meshes come and go in every step.
    IsaGjkAlgorithm(IsaGjkRegistration& isaGjk, btPersistentManifold* manifold,
                    const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* a,
                    const btCollisionObjectWrapper* b, bool closestOnly);
    ~IsaGjkAlgorithm() override;

    void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                          const btDispatcherInfo& info, btManifoldResult* result) override;
    btScalar calculateTimeOfImpact(btCollisionObject* a, btCollisionObject* b, const btDispatcherInfo& info,
                                   btManifoldResult* result) override;
    void getAllContactManifolds(btManifoldArray& manifolds) override;

    /// Lets isIdle() answer before the first processCollision(), so that a pair that never touches needs no manifold.
    ///
    /// @param breakingThreshold that its manifold would have
    void expect(btScalar breakingThreshold) { m_breakingThreshold = breakingThreshold; }

    /// For a pair in the pair cache that the registration's BodyMotions serve; again if they have abandoned its bodies.
    void watch(const btCollisionObject& a, const btCollisionObject& b);
    bool isWatching() const { return m_places[0] != BodyMotions::kNone; }
    /// False in an array that another dispatcher fills too, whose BodyMotions know nothing of this pair, and for an algorithm
    /// of queries outside of a step.
    bool isOf(const btDispatcher& dispatcher) const { return m_dispatcher == &dispatcher && !m_closestOnly; }

    /// True if the last isIdle() was true, nothing has happened to the pair since, and its bodies have not moved far enough
    /// to make it false now. To be asked after every update of the motions.
    bool staysIdle(BodyMotions& motions)
    {
        // Nothing is remembered of a pair that is not watched.
        if (m_leeway.isForgotten() ||
            !m_leeway.outlasts(motions.approach(m_places[0], m_places[1], m_cache.axis, m_leeway.rates())))
            return false;
        motions.use(m_places[0]);
        motions.use(m_places[1]);
        return true;
    }

    /// True if processCollision() of these bodies would change nothing but what this remembers, and perhaps make an empty
    /// manifold that nothing needs: the shapes are too far apart, there is no contact to take back, and a kinematic body, with
    /// which Bullet's islands wake what shares a manifold, has that.
    ///
    /// Reads bodies and shapes, writes to this object only: safe to run for different pairs at the same time.
    bool isIdle(const btCollisionObject& a, const btCollisionObject& b);

private:
    void touch() noexcept;
    void unwatch() noexcept;
    bool remembersRoom() const
    {
        return isWatching() && !m_isaGjk.motions().isPaused(m_places[0]) &&
               !m_isaGjk.motions().isPaused(m_places[1]);
    }
    /// What is known when the cheap proof has failed.
    struct ApartTest
    {
        AxisTest<btScalar> axis;
        KnownHulls hulls = {};
    };
    std::uint64_t passOf(bool isStep) const;
    bool staysApart(const ConvexPair& pair, btScalar limit, std::uint64_t pass, ApartTest& failed,
                    AxisRoom* room = nullptr);
    bool findsAxis(const btCollisionObject& a, const btCollisionObject& b, ApartTest& failed, bool remembers);
    void collideAndRefresh(const ConvexPair& pair, const btDispatcherInfo& info, ApartTest& failed,
                           btManifoldResult& result);
    bool collide(const ConvexPair& pair, const btDispatcherInfo& info, ApartTest& failed,
                 btManifoldResult& result);
    bool collideOrThrow(const ConvexPair& pair, const btDispatcherInfo& info, ApartTest& failed,
                        btManifoldResult& result, bool& isReporting);
    GjkState search(const ConvexPair& pair, ConvexCores& cores, btScalar limit,
                    const AxisTest<btScalar>& failed, std::uint64_t pass, Touch& touch);
    bool findsFaces(ConvexCores& cores, const Touch& touch) const;
    void countContact() noexcept;
    void forget();
    void refresh(btManifoldResult& result);
    void report(const ConvexPair& pair, const ConvexCores& cores, const Touch& touch, btScalar reach,
                btManifoldResult& result);
    void runStock(const ConvexPair& pair, const btDispatcherInfo& info, btManifoldResult& result);

    // First what a pair that stays idle needs.
    std::uint32_t m_places[2] = {BodyMotions::kNone, BodyMotions::kNone};
    Leeway m_leeway;
    GjkCache<btScalar> m_cache;
    EpaCache m_depth;
    bool m_ownsManifold : 1;
    bool m_closestOnly : 1;
    bool m_hasContacts : 1;  ///< or may have: the manifold is in other hands too
    bool m_isSettled : 1;    ///< the last search ended where any would
    IsaGjkRegistration& m_isaGjk;
    btPersistentManifold* m_manifold;
    HullUse m_hulls[2];
    btScalar m_breakingThreshold = -1;  ///< negative: not known yet
};

// Bullet's pool hands out elements of this size and does not look at the request.
static_assert(sizeof(IsaGjkAlgorithm) <= 192, "too large for the pool of Bullet's configuration");
}  // namespace CULLET_PRECISION
}  // namespace cullet
