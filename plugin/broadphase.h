// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/api.h"
#include "cullet/broad/backend.h"
#include "cullet/plugin/core/broadphase_options.h"
#include "cullet/plugin/core/precision.h"
#include "cullet/plugin/dbvt_tuning.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>
#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>

#include <cstdint>
#include <memory>

class btIDebugDraw;

namespace cullet
{
class ProxyTable;

inline namespace CULLET_PRECISION
{
struct DebugDrawOptions;

/// Broad phase for Bullet: takes the place of btDbvtBroadphase in any of Bullet's worlds, or without a world.
///
/// Pairs of ordinary bodies enter and leave the pair cache in calculateOverlappingPairs(), lower unique id first and
/// sorted by ids, so that every backend and thread count gives the same pair array. A pair enters when the exact boxes
/// overlap (closed intervals) and the filter agrees, and leaves when the boxes grown by the margin separate. A filter
/// callback is asked about a pair again when one of its boxes leaves the box that it had when it was last asked, grown
/// by the margin; where it refuses a large share of all pairs, it is also asked before the boxes overlap, up to twice
/// the margin for each, as by btDbvtBroadphase.
/// Pairs of ghost objects (btGhostObject, while a ghost pair callback is installed) enter immediately, in createProxy()
/// and setAabb(). Queries find every box as soon as it is set.
///
/// Code that was written for btDbvtBroadphase compiles with this class (DbvtTuning).
///
/// Differences to btDbvtBroadphase that a caller can see: ordinary pairs do not appear before
/// calculateOverlappingPairs(); that call removes pairs of separated boxes; queries report exact boxes only, so fewer;
/// a box with a NaN or min > max has no pairs and no query finds it. A pair that the application removed from the cache
/// is added again when one of its boxes leaves the box that it had at the removal, grown by the margin; if one of its
/// boxes changed between the updates before and after the removal, the latter adds the pair.
///
/// While a pair callback is installed in the cache, client objects must be btCollisionObject, as for Bullet's own broad
/// phases; otherwise see setGhostPairsImmediate().
///
/// Threads: queries may run concurrently with each other, from any thread, also from inside a query's callback.
/// setAabb() of different proxies may run concurrently with each other while no ghost exists. All other calls need
/// exclusive access. Different broad phases are independent.
///
/// Errors: no exception leaves a member function but std::bad_alloc and what callbacks of the application throw. After
/// one, setAabb() has stored the box, destroyProxy() can be called again, and the next calculateOverlappingPairs() has
/// all pairs. Only callbacks let destroyProxy() throw. Where calculateOverlappingPairs() returns without some pairs, for
/// lack of memory, it logs a warning, and the next call adds them.
class CULLET_API Broadphase final : public btBroadphaseInterface, public DbvtTuning
{
public:
    /// @param cache  pair cache of the caller, which must outlive this object; null: an own PairCache
    explicit Broadphase(btOverlappingPairCache* cache = nullptr, const BroadphaseOptions& options = {});
    explicit Broadphase(const BroadphaseOptions& options);
    /// Uses a backend of the caller instead of the one that options.backend names. With null, which
    /// makeCudaPsapBackend() returns without a device, it uses the grid and logs a warning.
    explicit Broadphase(std::unique_ptr<Backend> backend, btOverlappingPairCache* cache = nullptr,
                        const BroadphaseOptions& options = {});
    ~Broadphase() override;
    Broadphase(const Broadphase&) = delete;
    Broadphase& operator=(const Broadphase&) = delete;

    /// Adds a proxy with the next unique id; its address is fixed until destroyProxy(). Amortised O(1), plus a box
    /// query for a ghost.
    ///
    /// After an exception the new proxy and its pairs do not exist and all else is unchanged, except that a unique id
    /// may have been used up.
    btBroadphaseProxy* createProxy(const btVector3& aabbMin, const btVector3& aabbMax, int shapeType,
                                   void* userPtr, int collisionFilterGroup, int collisionFilterMask,
                                   btDispatcher* dispatcher) override;

    /// Removes the pairs of the proxy, then the proxy. Legal at any time except during a query. O(pairs of the proxy)
    /// with an own PairCache, O(all pairs) with Bullet's caches.
    void destroyProxy(btBroadphaseProxy* proxy, btDispatcher* dispatcher) override;

    /// Stores a box. O(1), without allocation, device call or search for pairs. Exceptions: the box of a ghost costs a
    /// box query, and a box inside the bounds of all ghosts a search in the tree of ghosts.
    void setAabb(btBroadphaseProxy* proxy, const btVector3& aabbMin, const btVector3& aabbMax,
                 btDispatcher* dispatcher) override;

    /// Returns exactly the box of the last setAabb() or createProxy().
    void getAabb(btBroadphaseProxy* proxy, btVector3& aabbMin, btVector3& aabbMax) const override;

    /// Reports the proxies whose box, grown by the box [aabbMin, aabbMax] of the cast shape, meets the ray.
    ///
    /// The ray is rayFrom and the fields of the callback (inverse direction, signs, length), as in Bullet; rayTo is
    /// not read. Every proxy is reported once, in ascending unique id; the callback's return value is ignored.
    void rayTest(const btVector3& rayFrom, const btVector3& rayTo, btBroadphaseRayCallback& rayCallback,
                 const btVector3& aabbMin = btVector3(0, 0, 0),
                 const btVector3& aabbMax = btVector3(0, 0, 0)) override;

    /// Reports the proxies whose box overlaps the box, each once, in ascending unique id.
    void aabbTest(const btVector3& aabbMin, const btVector3& aabbMax,
                  btBroadphaseAabbCallback& callback) override;

    /// Updates the pair cache from the boxes. The dispatcher may be null; then, as in Bullet, the algorithms of removed
    /// pairs leak.
    void calculateOverlappingPairs(btDispatcher* dispatcher) override;

    btOverlappingPairCache* getOverlappingPairCache() override;
    const btOverlappingPairCache* getOverlappingPairCache() const override;

    /// Union of all valid boxes; zero when there is none. O(bodies).
    void getBroadphaseAabb(btVector3& aabbMin, btVector3& aabbMax) const override;

    /// Restarts unique ids at 1 and frees memory if there is no proxy; otherwise does nothing.
    void resetPool(btDispatcher* dispatcher) override;

    /// Logs the statistics at LogLevel::Info.
    void printStats() override;

    BroadphaseStats stats() const;

    /// Calls calculateOverlappingPairs(); btDbvtBroadphase::collide() does nothing else either.
    void collide(btDispatcher* dispatcher) { calculateOverlappingPairs(dispatcher); }
    /// Calls setAabb(), which always stores the box.
    void setAabbForceUpdate(btBroadphaseProxy* proxy, const btVector3& aabbMin, const btVector3& aabbMax,
                            btDispatcher* dispatcher)
    {
        setAabb(proxy, aabbMin, aabbMax, dispatcher);
    }

    /// Draws boxes, cells and pairs with the drawer of the application; see plugin/core/debug_draw_options.h.
    void debugDraw(btIDebugDraw& drawer) const;
    void debugDraw(btIDebugDraw& drawer, const DebugDrawOptions& options) const;

    /// Replaces the backend; the pairs are kept. With null, which makeCudaPsapBackend() returns without a device, the
    /// current backend is kept and a warning is logged.
    void setBackend(std::unique_ptr<Backend> backend);

    /// Sets whether ghosts exist, overriding the ghost pair callback of the pair cache.
    ///
    /// Set true for a pair cache whose callback cannot be read: a type that is neither cullet's nor Bullet's, or a
    /// class without RTTI. Otherwise pairs of its ghosts appear in calculateOverlappingPairs() only. Set false if
    /// client objects are not Bullet's and the callback is the application's own; they are then not accessed.
    void setGhostPairsImmediate(bool immediate);

    /// Whether setAabb() of different proxies may run concurrently at the moment: there is no ghost.
    bool canSetAabbsConcurrently();

    /// A number that changes with each new proxy, for callers of setAabb() whose callbacks may create some.
    std::uint32_t upcomingUniqueId() const;

    const Backend& backend() const;
    /// In double builds its boxes are relative to a place near most bodies, where the world is far from its origin.
    const ProxyTable& table() const;

private:
    struct Parts;
    std::unique_ptr<Parts> m;

public:
    /// The pair cache, under btDbvtBroadphase's name for it.
    btOverlappingPairCache* const m_paircache;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
