// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/api.h"
#include "cullet/broad/pair.h"
#include "cullet/plugin/core/precision.h"
#include "cullet/plugin/pair_cache/pair_hash.h"
#include "cullet/plugin/pair_cache/pair_links.h"
#include "cullet/plugin/pair_cache/pair_order.h"

#include <BulletCollision/BroadphaseCollision/btDispatcher.h>
#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>

#include <cstddef>
#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Two proxies of a pair, in any order.
struct ProxyPair
{
    btBroadphaseProxy* first;
    btBroadphaseProxy* second;
};

struct PairCacheStats
{
    std::uint64_t pairs = 0;         ///< pairs now held
    std::uint64_t slots = 0;         ///< slots of the hash
    double load = 0.0;               ///< pairs / slots
    std::uint64_t longestProbe = 0;  ///< cache lines of the hash that the worst successful search reads, now
    double meanProbe = 0.0;          ///< the same, mean over the pairs
    std::uint64_t rehashes = 0;      ///< times the hash grew since construction
    std::uint64_t proxies = 0;       ///< proxies with at least one pair
    std::uint64_t visited =
        0;  ///< pairs walked over since construction: processed, cleaned, or removed by proxy
    std::uint64_t bytes = 0;  ///< memory held
};

/// Overlapping pair cache with constant-time add, find and remove, and per-proxy lists of pairs.
///
/// The lecture's pair manager (Broad Phase: "bag" array, hash h = (ID1*p1 + ID2*p2) mod N, the last element moves into
/// the hole) with two changes: the hash is an open one whose searches read one cache line and no proxy (PairHash), over
/// all 64 bits of the two ids, where Bullet's own cache chains `id1 | id2 << 16`; and every pair is linked into the lists
/// of its two proxies (PairLinks), so that removing or cleaning a proxy costs its own pairs instead of a scan of all.
///
/// Pairs are identified by the unique ids of their proxies, which must be unique among the proxies in the cache and
/// must not change while they are in it. The lower id is `m_pProxy0`. Pairs of two equal ids are refused.
///
/// Order: the pair array is contiguous, without null or duplicate entries, and its order depends on the sequence of
/// operations only: new pairs at the end, the last one moves into the place of a removed one. An algorithm stays with
/// its pair.
///
/// The array from getOverlappingPairArray(): reading it, writing `m_algorithm` and `m_internalInfo1`, and reserve() are
/// allowed; anything that changes its size, its order or a proxy pointer is not (as in Bullet's hashed cache, where
/// reserve() is not allowed either). Pointers to pairs live until the next change of the cache.
///
/// Re-entrancy: see processAllOverlappingPairs(). Ghost callbacks and destructors of algorithms may call any method.
///
/// Threads: const methods may run concurrently with each other; everything else is for one thread at a time.
///
/// Errors: a pair that cannot be stored for lack of memory is not added (null is returned, the ghost callback is not
/// told); Bullet's array class itself does not survive a failed allocation. No method throws by itself; what a callback
/// throws passes through and leaves the cache usable.
///
/// Memory: 57 to 62 bytes per pair (32 pair, 16 links, 9 to 14 hash) and 12 per proxy with pairs, plus the usual slack of
/// growing arrays (a factor 1.5, none after reserve()); 24 more per pair once pairs were ordered (deterministic
/// processing or sortOverlappingPairs). It never shrinks.
class CULLET_API PairCache final : public btOverlappingPairCache
{
public:
    PairCache() = default;
    ~PairCache() override = default;
    PairCache(const PairCache&) = delete;
    PairCache& operator=(const PairCache&) = delete;

    // Bullet's interface.

    /// First pair; null while there are none.
    btBroadphasePair* getOverlappingPairArrayPtr() override;
    const btBroadphasePair* getOverlappingPairArrayPtr() const override;
    btBroadphasePairArray& getOverlappingPairArray() override { return m_pairs; }
    int getNumOverlappingPairs() const override { return m_pairs.size(); }

    /// Adds the pair when the filter lets it pass and returns it; an existing pair is returned as it is, without a
    /// word to the ghost callback; null when the filter refuses. Amortised O(1).
    ///
    /// The ghost callback is told of a new pair before it is in the cache. Filter and ghost callback may remove the pair, or a
    /// proxy of it with all of its pairs: then it does not come, and the ghost callback, if it has been told, is told so. While
    /// either runs, adding the same pair once more gives null.
    btBroadphasePair* addOverlappingPair(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1) override;

    /// Destroys the pair's algorithm, takes the pair out, and returns what its `m_internalInfo1` was; null when there is
    /// no such pair. O(1).
    ///
    /// The ghost callback is told after the algorithm went and the pair can no longer be found, while the array still
    /// has its entry.
    void* removeOverlappingPair(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1,
                                btDispatcher* dispatcher) override;

    /// removeOverlappingPair() for every pair of the proxy, the one added last first. O(pairs of the proxy).
    void removeOverlappingPairsContainingProxy(btBroadphaseProxy* proxy, btDispatcher* dispatcher) override;

    /// Destroys the pair's algorithm and keeps the pair. Without a dispatcher nothing happens: a pair that is removed
    /// without one leaks its algorithm, as in Bullet's caches.
    void cleanOverlappingPair(btBroadphasePair& pair, btDispatcher* dispatcher) override;

    /// cleanOverlappingPair() for every pair of the proxy. O(pairs of the proxy).
    void cleanProxyFromPairs(btBroadphaseProxy* proxy, btDispatcher* dispatcher) override;

    /// The callback alone when there is one, otherwise both group-and-mask words.
    bool needsBroadphaseCollision(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1) const override;
    btOverlapFilterCallback* getOverlapFilterCallback() override { return m_filter; }

    /// Not owned; null for the group-and-mask rule. Pairs that exist stay.
    void setOverlapFilterCallback(btOverlapFilterCallback* callback) override { m_filter = callback; }

    /// Visits the pairs in array order; a pair for which the callback returns true is removed, and the pair that takes
    /// its place is visited next.
    ///
    /// The callback may add and remove pairs, which invalidates its reference. Pairs added during the pass are visited
    /// too, at its end. No pair is visited twice, and none is skipped unless the callback itself removes pairs that were
    /// visited before: each of those may take the last pair out of the rest of the pass. When the callback removes the
    /// pair it was called for, its return value has no effect.
    void processAllOverlappingPairs(btOverlapCallback* callback, btDispatcher* dispatcher) override;

    /// As above; with `m_deterministicOverlappingPairs` in descending order of (lower id, higher id), the order of
    /// Bullet's hashed cache. Then no pair is ever skipped, and pairs added during the pass wait for the next one.
    ///
    /// O(pairs) to sort, nothing when no pair came or went since the last sort. Falls back to array order when there is
    /// no memory to sort.
    void processAllOverlappingPairs(btOverlapCallback* callback, btDispatcher* dispatcher,
                                    const btDispatcherInfo& dispatchInfo) override;

    /// The pair of two proxies in any order, or null. O(1).
    btBroadphasePair* findPair(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1) override;

    bool hasDeferredRemoval() override { return false; }

    /// Not owned; null for none. It is told of later changes only.
    void setInternalGhostPairCallback(btOverlappingPairCallback* callback) override { m_ghosts = callback; }
    btOverlappingPairCallback* ghostPairCallback() const noexcept { return m_ghosts; }
    /// Where the callback is kept.
    btOverlappingPairCallback* const& ghostPairCallbackSlot() const noexcept { return m_ghosts; }

    /// Sorts the array in descending order of (lower id, higher id). Algorithms stay, no callback is called.
    ///
    /// Does nothing while pairs are being processed or removed (a call from a callback). O(pairs).
    void sortOverlappingPairs(btDispatcher* dispatcher) override;

    // For the broad phase: changes in bulk and by unique id.

    /// Makes room for so many pairs in all, so that adding them moves nothing. What grows, grows by a quarter at least.
    void reserve(std::size_t pairCount);

    /// How often pairs were added or removed by Bullet's interface, so not by the functions below. A number that is too high
    /// is possible: of a pair that was there, or not there.
    std::uint64_t changesByCallers() const noexcept { return m_changesByCallers; }

    /// How many pairs were not added for lack of memory, which null from addOverlappingPair() does not tell from refusals.
    std::uint64_t pairsWithoutMemory() const noexcept { return m_pairsWithoutMemory; }

    /// As addOverlappingPair().
    btBroadphasePair* addPair(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1);

    /// As removeOverlappingPairsContainingProxy().
    void removePairsOf(btBroadphaseProxy* proxy, btDispatcher* dispatcher);

    /// addOverlappingPair() without the filter.
    btBroadphasePair* addPairUnfiltered(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1);

    /// addPairUnfiltered() for each, in order, after one reserve(); returns how many are new.
    std::size_t addPairsUnfiltered(const ProxyPair* pairs, std::size_t count);

    /// As removeOverlappingPair(), by ids.
    void* removePair(Pair ids, btDispatcher* dispatcher);

    /// removePair() for each, in order; returns how many there were.
    std::size_t removePairs(const Pair* ids, std::size_t count, btDispatcher* dispatcher);

    /// As findPair(), by ids.
    btBroadphasePair* findPair(Pair ids);

    /// Walks over the hash: O(pairs).
    PairCacheStats stats() const;

    /// Memory held. O(1).
    std::uint64_t bytes() const;

    /// Whether array, hash and lists agree; for tests and debugging. Not from within callbacks. O(pairs).
    bool isConsistent() const;

private:
    /// Follows one pair of the array while callbacks may move or remove it.
    class Cursor;
    /// A pair on its way into the cache, while callbacks are asked or told about it.
    class Addition;
    class CallerChange;

    static constexpr std::uint32_t kNone = PairHash::kNone;

    std::uint32_t size() const { return static_cast<std::uint32_t>(m_pairs.size()); }
    btBroadphasePair* pairAt(std::uint32_t index);
    bool isDetached(std::uint32_t index) const { return m_detachedCount != 0 && m_links.isDetached(index); }
    std::uint32_t indexOf(const ProxyPair& sorted) const;
    std::uint32_t indexOf(Pair ids) const;
    void makeRoom();
    void growTo(std::size_t pairCount);
    bool isBeingTold(const ProxyPair& sorted) const;
    btBroadphasePair* addTold(const ProxyPair& sorted, Addition& addition);
    template <class IsMeant>
    void cancelAdditions(IsMeant isMeant, btDispatcher* dispatcher);
    void* cancelAddition(Pair ids, btDispatcher* dispatcher);
    bool hasMemory(const ProxyPair& sorted);
    bool isAwaited(std::uint32_t id) const noexcept;
    void dropAnchors(Pair ids) noexcept;
    btBroadphasePair* append(const ProxyPair& sorted);
    void prefetchRemoval(const Pair* coming, std::size_t count);
    void prefetchPair(std::uint32_t index);
    void prefetchNeighbours(std::uint32_t index);
    void* removeAt(std::uint32_t index, btDispatcher* dispatcher);
    void* removeWithCallbacks(std::uint32_t index, btDispatcher* dispatcher);
    void removeAsAsked(const Cursor& cursor, btDispatcher* dispatcher);
    void* removeFollowed(const Cursor& cursor, btDispatcher* dispatcher);
    void detach(std::uint32_t index);
    void fillHole(std::uint32_t hole);
    void fillDetached(std::uint32_t hole);
    void movePair(std::uint32_t from, std::uint32_t to);
    bool order();
    void processOrdered(btOverlapCallback* callback, btDispatcher* dispatcher);

    btBroadphasePairArray m_pairs;
    PairHash m_hash;    ///< ids -> index into m_pairs
    PairLinks m_links;  ///< lists of the pairs of each proxy
    PairOrder m_order;
    btOverlapFilterCallback* m_filter = nullptr;
    btOverlappingPairCallback* m_ghosts = nullptr;
    Cursor* m_cursors = nullptr;      ///< innermost first
    Addition* m_additions = nullptr;  ///< innermost first
    std::uint64_t m_version = 0;      ///< changes when a pair comes, goes or moves
    std::uint64_t m_changesByCallers = 0;
    std::uint64_t m_pairsWithoutMemory = 0;
    std::uint32_t m_detachedCount = 0;  ///< entries whose ghost callback is running
    std::uint64_t m_visited = 0;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
