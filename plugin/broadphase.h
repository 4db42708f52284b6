// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/api.h"
#include "cullet/broad/backend.h"
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

enum class BackendChoice
{
    Auto,   ///< the grid; CUDA for worlds of deviceBodies and more when a device answers
    Grid,   ///< the hierarchical hash grid on the CPU
    Brute,  ///< every box against every other: for tests and for worlds of a few dozen bodies
    Cuda    ///< CUDA; the grid, with a warning, when no device answers
};

struct BroadphaseOptions
{
    BackendChoice backend = BackendChoice::Auto;
    /// Threads of the CPU backends; 0: as many as the machine has. The pairs never depend on it.
    int threads = 0;
    GridOptions grid;  ///< `threads` above wins over grid.threads unless it is 0
    PsapOptions psap;
    /// BackendChoice::Auto: a world of so many bodies moves to CUDA, and back to the grid below half of them; the pairs
    /// stay. 0: CUDA from the start. The break-even measured on an H200 is at 500 to 2,000 bodies.
    std::uint32_t deviceBodies = 2048;
    /// Boxes of a pair that separates keep it until they are 2 * margin apart (length unit of the world).
    /// Negative: Bullet's gDbvtMargin, read in every calculateOverlappingPairs().
    btScalar margin = btScalar(-1);
};

/// Counters for people, tests and benchmarks.
struct BroadphaseStats
{
    std::uint32_t bodies = 0;  ///< live proxies
    std::uint32_t ghosts = 0;  ///< live proxies that are ghost objects, while a ghost callback is installed
    std::uint64_t pairs = 0;   ///< pairs in the pair cache
    std::uint64_t pendingPairs = 0;          ///< overlaps that are not in the cache: refused, or not exact
    std::uint64_t provisionalPairs = 0;      ///< pairs of ghosts that the backend has not seen yet
    std::uint64_t invalidBoxesTotal = 0;     ///< boxes set with a NaN or min > max; they overlap nothing
    std::uint64_t updatesTotal = 0;          ///< calls of calculateOverlappingPairs
    std::uint64_t restartsTotal = 0;         ///< times the backend was given the known pairs and began anew
    std::uint64_t fallbacksTotal = 0;        ///< backends that failed and were replaced by the grid
    std::uint64_t queryTreeBuildsTotal = 0;  ///< times the tree behind rays and box queries was built
    std::uint64_t queryTreeSyncsTotal = 0;   ///< times it took in changes; other queries scanned or reused it
    std::uint64_t bytes = 0;  ///< memory of proxies, tables and lists, without backend and pair cache
    const char* backendName = "";
    BackendStats backend;
};

/// Broad phase for Bullet: takes the place of btDbvtBroadphase in any of Bullet's worlds, or without a world.
///
/// Pairs of ordinary bodies enter and leave the pair cache in calculateOverlappingPairs(), lower unique id first and
/// sorted by ids, so that every backend and thread count gives the same pair array. They enter when the exact boxes
/// overlap (closed intervals) and the filter agrees, and leave when the boxes grown by the margin separate.
/// Pairs of ghost objects (btGhostObject, while a ghost pair callback is installed) enter at once, in createProxy()
/// and setAabb(). Queries see every box at once.
///
/// Code that was written for btDbvtBroadphase compiles with this class (DbvtTuning).
///
/// Differences to btDbvtBroadphase that a caller can see: ordinary pairs do not appear before
/// calculateOverlappingPairs(); pairs of separated boxes are gone after it; queries report exact boxes only, so fewer;
/// a box with a NaN or min > max has no pairs and is in no query; a pair that the application took out of the cache
/// comes back when one of its boxes leaves the place it had then, grown by the margin, and at once where one has changed
/// since the update before.
///
/// While a pair callback is installed in the cache, client objects have to be btCollisionObject, as for Bullet's own; else
/// see setGhostPairsImmediate().
///
/// Threads: queries may run concurrently with each other, from any thread, also from inside a query's callback.
/// setAabb() of different proxies may run concurrently with each other while no ghost exists. Everything else is for
/// one thread at a time. Different broad phases are independent.
///
/// Errors: no exception leaves a member function but std::bad_alloc and what callbacks of the application throw.
class CULLET_API Broadphase final : public btBroadphaseInterface, public DbvtTuning
{
public:
    /// @param cache  pair cache of the caller, which must outlive this object; null: an own PairCache
    explicit Broadphase(btOverlappingPairCache* cache = nullptr, const BroadphaseOptions& options = {});
    explicit Broadphase(const BroadphaseOptions& options);
    /// A backend of the caller's instead of the one that options.backend names; null, as from makeCudaPsapBackend()
    /// without a device: the grid, with a warning.
    explicit Broadphase(std::unique_ptr<Backend> backend, btOverlappingPairCache* cache = nullptr,
                        const BroadphaseOptions& options = {});
    ~Broadphase() override;
    Broadphase(const Broadphase&) = delete;
    Broadphase& operator=(const Broadphase&) = delete;

    /// Adds a proxy with the next unique id; its address is fixed until destroyProxy(). Amortised O(1), plus a box
    /// query for a ghost.
    ///
    /// Whatever throws: then there is no new proxy and no pair of it, and all else is as before, but for a unique id that
    /// may have been used up.
    btBroadphaseProxy* createProxy(const btVector3& aabbMin, const btVector3& aabbMax, int shapeType,
                                   void* userPtr, int collisionFilterGroup, int collisionFilterMask,
                                   btDispatcher* dispatcher) override;

    /// Removes the pairs of the proxy, then the proxy. Legal at any time but during a query. O(pairs of the proxy)
    /// with the own pair cache, O(all pairs) with Bullet's.
    void destroyProxy(btBroadphaseProxy* proxy, btDispatcher* dispatcher) override;

    /// Stores a box. O(1): no allocation, no device call, no pair work, except for a ghost, which costs a box query, and within the
    /// bounds of all ghosts, which costs O(ghosts / 8) at most.
    void setAabb(btBroadphaseProxy* proxy, const btVector3& aabbMin, const btVector3& aabbMax,
                 btDispatcher* dispatcher) override;

    /// The box of the last setAabb() or createProxy(), exactly.
    void getAabb(btBroadphaseProxy* proxy, btVector3& aabbMin, btVector3& aabbMax) const override;

    /// Reports the proxies whose box, grown by the box [aabbMin, aabbMax] of the cast shape, meets the ray.
    ///
    /// The ray is rayFrom and the fields of the callback (inverse direction, signs, length), as in Bullet; rayTo is
    /// not read. Each proxy once, in ascending unique id; the callback's return value is ignored.
    void rayTest(const btVector3& rayFrom, const btVector3& rayTo, btBroadphaseRayCallback& rayCallback,
                 const btVector3& aabbMin = btVector3(0, 0, 0),
                 const btVector3& aabbMax = btVector3(0, 0, 0)) override;

    /// Reports the proxies whose box overlaps the box, each once, in ascending unique id.
    void aabbTest(const btVector3& aabbMin, const btVector3& aabbMax,
                  btBroadphaseAabbCallback& callback) override;

    /// Brings the pair cache up to date with the boxes. The dispatcher may be null; then, as in Bullet, the algorithms
    /// of removed pairs leak.
    void calculateOverlappingPairs(btDispatcher* dispatcher) override;

    btOverlappingPairCache* getOverlappingPairCache() override;
    const btOverlappingPairCache* getOverlappingPairCache() const override;

    /// Union of all valid boxes; zero when there is none. O(bodies).
    void getBroadphaseAabb(btVector3& aabbMin, btVector3& aabbMax) const override;

    /// Starts unique ids at 1 again and gives memory back, if there is no proxy; else does nothing.
    void resetPool(btDispatcher* dispatcher) override;

    /// Logs the statistics at LogLevel::Info.
    void printStats() override;

    BroadphaseStats stats() const;

    /// As calculateOverlappingPairs(), which does nothing else in btDbvtBroadphase either.
    void collide(btDispatcher* dispatcher) { calculateOverlappingPairs(dispatcher); }
    /// As setAabb(), which never leaves a box as it is.
    void setAabbForceUpdate(btBroadphaseProxy* proxy, const btVector3& aabbMin, const btVector3& aabbMax,
                            btDispatcher* dispatcher)
    {
        setAabb(proxy, aabbMin, aabbMax, dispatcher);
    }

    /// Shows boxes, cells and pairs in the viewer of the application; see plugin/core/debug_draw_options.h.
    void debugDraw(btIDebugDraw& drawer) const;
    void debugDraw(btIDebugDraw& drawer, const DebugDrawOptions& options) const;

    /// Replaces the backend; the pairs stay as they are. With null, as from makeCudaPsapBackend() without a device, the
    /// present one stays, with a warning.
    void setBackend(std::unique_ptr<Backend> backend);

    /// Says whether there are ghosts, in place of what the pair cache has for a ghost pair callback.
    ///
    /// True for a pair cache of a type that is neither cullet's nor Bullet's, or of a class without RTTI, which cannot be asked;
    /// else pairs of its ghosts appear in calculateOverlappingPairs(). False where client objects are none of Bullet's and the
    /// callback is the application's own: they are then not looked at.
    void setGhostPairsImmediate(bool immediate);

    /// Whether setAabb() of different proxies may run concurrently now: there is no ghost.
    bool canSetAabbsConcurrently();

    const Backend& backend() const;
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
