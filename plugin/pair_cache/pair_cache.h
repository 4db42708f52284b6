// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/api.h"
#include "cullet/broad/huge_vector.h"
#include "cullet/broad/pair.h"
#include "cullet/plugin/core/precision.h"
#include "cullet/plugin/core/proxy_ids.h"
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
    std::uint64_t pairs = 0;         ///< current number of pairs
    std::uint64_t slots = 0;         ///< slots of the hash
    double load = 0.0;               ///< pairs / slots
    std::uint64_t longestProbe = 0;  ///< most cache lines of the hash that a successful search reads
    double meanProbe = 0.0;          ///< mean number of those cache lines, over all pairs
    std::uint64_t rehashes = 0;      ///< number of times the hash has grown since construction
    std::uint64_t proxies = 0;       ///< proxies with at least one pair; 0 while pairs are not linked
    /// Pairs visited since construction: processed, cleaned, or removed by proxy.
    std::uint64_t visited = 0;
    /// Searches of the hash since construction, to add pairs or to remove batches.
    std::uint64_t searched = 0;
    std::uint64_t moved = 0;  ///< pairs moved into the entry of a removed one since construction
    std::uint64_t bytes = 0;  ///< allocated memory
};

/// Overlapping pair cache with constant-time add, find and remove, and per-proxy lists of pairs.
///
/// The pair manager of "Lesson 04, Broad Phase Collision Detection" (docs/references.md: "bag" array, hash
/// h = (ID1*p1 + ID2*p2) mod N, the last element moves into the hole) with two changes. The hash uses open addressing;
/// a search reads one cache line and no proxy (PairHash), over all 64 bits of the two ids, where Bullet's own cache
/// chains `id1 | id2 << 16`. Every pair is linked into the lists of its two proxies (PairLinks), so that removing or
/// cleaning a proxy costs its own pairs instead of a scan of all.
///
/// Pairs are identified by the unique ids of their proxies, which must be unique among the proxies in the cache and
/// must not change while they are in it. Pairs of two equal ids are refused. As everywhere in Bullet ids are compared
/// as int, so that ids from 2^31 on come before all others: the lower id is `m_pProxy0`, and sorting and ordered passes
/// follow the same order.
///
/// Order: the pair array is contiguous, without null or duplicate entries, and its order depends on the sequence of
/// operations only: new pairs are appended, and the last pair moves into the entry of a removed one. An algorithm stays
/// with its pair.
///
/// The array from getOverlappingPairArray(): reading it, writing `m_algorithm` and `m_internalInfo1`, and reserve() are
/// allowed; changing its size, its order or a proxy pointer is not (as in Bullet's hashed cache, where reserve() is not
/// allowed either). Pointers to pairs are valid until the next change of the cache.
///
/// Re-entrancy: see processAllOverlappingPairs(). Ghost callbacks and destructors of algorithms may call any method.
///
/// Threads: const methods may run concurrently with each other; all other methods need exclusive access.
///
/// Errors: a pair that cannot be stored for lack of memory is not added (null is returned, the ghost callback is not
/// called); Bullet's array class itself does not survive a failed allocation. No method throws by itself; an exception
/// of a callback passes through and leaves the cache usable.
///
/// Memory: 57 to 62 bytes per pair (32 pair, 16 links, 9 to 14 hash) and 12 per proxy with pairs, plus the unused
/// capacity of growing arrays (a quarter, none after reserve()); 24 more per pair once pairs were ordered
/// (deterministic processing or sortOverlappingPairs). It never shrinks, but for the links (setLinked()).
class CULLET_API PairCache final : public btOverlappingPairCache
{
public:
    PairCache() = default;
    ~PairCache() override = default;
    PairCache(const PairCache&) = delete;
    PairCache& operator=(const PairCache&) = delete;

    // Bullet's interface.

    /// First pair; null if there are none.
    btBroadphasePair* getOverlappingPairArrayPtr() override;
    const btBroadphasePair* getOverlappingPairArrayPtr() const override;
    btBroadphasePairArray& getOverlappingPairArray() override { return m_pairs; }
    int getNumOverlappingPairs() const override { return m_pairs.size(); }

    /// Adds the pair if the filter lets it pass, and returns it. Returns an existing pair without calling the ghost
    /// callback, and null if the filter refuses. Amortised O(1).
    ///
    /// The ghost callback is called before a new pair is in the cache. Filter and ghost callback may remove the pair,
    /// or all pairs of one of its proxies: then the pair is not added, and the ghost callback's
    /// removeOverlappingPair() is called if its addOverlappingPair() was, also if that threw. While either runs, adding
    /// the same pair again, in any way, calls neither and adds nothing: it returns null, or the pair if it is in the
    /// cache.
    btBroadphasePair* addOverlappingPair(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1) override;

    /// Destroys the pair's algorithm, removes the pair, and returns its former `m_internalInfo1`; null if there is no
    /// such pair. O(1).
    ///
    /// The ghost callback is called after the algorithm was destroyed and the pair can no longer be found, while the
    /// array still has its entry.
    void* removeOverlappingPair(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1,
                                btDispatcher* dispatcher) override;

    /// Calls removeOverlappingPair() for every pair of the proxy, most recent first. O(pairs of the proxy).
    void removeOverlappingPairsContainingProxy(btBroadphaseProxy* proxy, btDispatcher* dispatcher) override;

    /// Destroys the pair's algorithm and keeps the pair. Without a dispatcher it does nothing: a pair that is removed
    /// without one leaks its algorithm, as in Bullet's caches.
    void cleanOverlappingPair(btBroadphasePair& pair, btDispatcher* dispatcher) override;

    /// Calls cleanOverlappingPair() for every pair of the proxy. O(pairs of the proxy).
    void cleanProxyFromPairs(btBroadphaseProxy* proxy, btDispatcher* dispatcher) override;

    /// Only the callback decides if there is one, otherwise both group and mask words.
    bool needsBroadphaseCollision(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1) const override;
    btOverlapFilterCallback* getOverlapFilterCallback() override { return m_filter; }

    /// Not owned; null for the group and mask words. Existing pairs stay.
    void setOverlapFilterCallback(btOverlapFilterCallback* callback) override { m_filter = callback; }

    /// Visits the pairs in array order; a pair for which the callback returns true is removed, and the pair that takes
    /// its place is visited next.
    ///
    /// The callback may add and remove pairs, which invalidates its reference. Pairs added during the pass are visited
    /// too, at its end, so a pass whose callback adds a pair in every call does not end. No pair is visited twice, and
    /// none is skipped unless the callback itself removes pairs that were already visited: each of those may move the
    /// last pair to an entry behind the pass. If the callback removes the pair it was called for, its return value has
    /// no effect.
    void processAllOverlappingPairs(btOverlapCallback* callback, btDispatcher* dispatcher) override;

    /// Visits the pairs in array order, or with `m_deterministicOverlappingPairs` in descending order of (lower id,
    /// higher id), the order of Bullet's hashed cache. In that order the pass visits what was in the cache at its
    /// beginning: no such pair is skipped or visited twice, and a new one waits for the next pass. A pair that was
    /// removed and added again before its turn keeps its turn, as in Bullet's cache; so no step misses its contacts.
    ///
    /// O(pairs) to sort, nothing if no pair was added or removed since the last sort. Uses array order if there is no
    /// memory to sort.
    void processAllOverlappingPairs(btOverlapCallback* callback, btDispatcher* dispatcher,
                                    const btDispatcherInfo& dispatchInfo) override;

    /// The pair of two proxies in any order, or null. O(1).
    btBroadphasePair* findPair(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1) override;

    bool hasDeferredRemoval() override { return false; }

    /// Not owned; null for none. The callback receives later changes only.
    void setInternalGhostPairCallback(btOverlappingPairCallback* callback) override { m_ghosts = callback; }
    btOverlappingPairCallback* ghostPairCallback() const noexcept { return m_ghosts; }
    /// The location of the callback pointer.
    btOverlappingPairCallback* const& ghostPairCallbackSlot() const noexcept { return m_ghosts; }

    /// Sorts the array in descending order of (lower id, higher id). Algorithms stay with their pairs, and no callback
    /// is called.
    ///
    /// Does nothing while pairs are being processed or removed, that is from a callback. O(pairs).
    void sortOverlappingPairs(btDispatcher* dispatcher) override;

    // For the broad phase: changes in batches and by unique id.

    /// Reserves memory for a total number of pairs, so that adding them moves nothing. They grow by at least a quarter, without links
    /// by a 32nd.
    void reserve(std::size_t pairCount);

    /// Whether pairs are linked into the lists of their proxies, as they are at first. Without these lists a pair takes 16
    /// bytes less, arrays grow by a 32nd, and functions for the pairs of a proxy scan all pairs, as those of Bullet's
    /// cache do; they visit the same pairs in another order.
    ///
    /// A change is O(pairs). It does nothing while a callback runs, and pairs stay without lists if there is no memory for
    /// these: a later call tries again.
    void setLinked(bool isLinked);
    bool isLinked() const noexcept { return m_isLinked; }

    /// Number of additions and removals through Bullet's interface, that is not by the functions below. It may be too
    /// high, since it also counts calls that changed nothing.
    std::uint64_t changesByCallers() const noexcept { return m_changesByCallers; }

    /// A number that changes when a pair is added, removed or moved.
    std::uint64_t version() const noexcept { return m_version; }

    /// Number of pairs not added for lack of memory; null from addOverlappingPair() may also be a refusal.
    std::uint64_t pairsWithoutMemory() const noexcept { return m_pairsWithoutMemory; }

    /// addOverlappingPair() that changesByCallers() does not count.
    btBroadphasePair* addPair(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1);

    /// addPair() for a pair that is not in the cache, which is searched only if the filter has changed the cache. @pre the ids differ
    btBroadphasePair* addAbsent(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1);

    /// removeOverlappingPairsContainingProxy() that changesByCallers() does not count.
    void removePairsOf(btBroadphaseProxy* proxy, btDispatcher* dispatcher);

    /// addOverlappingPair() without the filter; null too while the filter of this same pair runs, which then decides.
    btBroadphasePair* addPairUnfiltered(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1);

    /// Whether there are no pairs, and none is being added.
    bool isEmpty() const noexcept { return m_pairs.size() == 0 && m_additions == nullptr; }

    /// Whether another pair fits without growing.
    bool hasRoom() const noexcept
    {
        return m_hash.hasRoom() && (!m_isLinked || size() < m_links.capacity()) &&
               m_pairs.size() < m_pairs.capacity();
    }

    /// addPairUnfiltered() for a pair that is not in the cache, which is not searched. False if there is no memory.
    /// @pre isEmpty() before the first of a sequence of such additions; no callback is installed; the ids differ
    bool appendNew(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1);

    /// Prefetches what a search, or appendNew(), will read, for few bodies; as prefetchAddition().
    [[gnu::always_inline]] void prefetchSearch(const Pair* coming, std::size_t count) const
    {
        if (kPrefetchLate < count)
            m_hash.prefetch(hashOfPair(inBulletsOrder(coming[kPrefetchLate])));
    }

    /// Whether this many pairs, of this many bodies, are so few that they stay in the cache of the processor.
    static bool areFew(std::size_t pairs, std::size_t bodies) noexcept
    {
        return pairs <= kFewPairs && bodies <= kFewBodies;
    }
    static constexpr std::size_t kFewPairs = 16384;  ///< about 1 MB
    static constexpr std::size_t kFewBodies = 1024;

    /// Prefetches what additions will read, in three stages; to be called for each pair of a list before its addition. In
    /// a large cache nearly all the time of a change is spent on cache misses.
    ///
    /// @param coming [count] the pair and those after it
    // Inlined, as the other ones, because GCC removes calls of functions that do nothing but prefetch.
    [[gnu::always_inline]] void prefetchAddition(const Pair* coming, std::size_t count) const
    {
        if (kPrefetchEarly < count)
        {
            m_hash.prefetch(hashOfPair(inBulletsOrder(coming[kPrefetchEarly])));
            // Without lists, no id is found.
            m_links.prefetchId(coming[kPrefetchEarly].first);
            m_links.prefetchId(coming[kPrefetchEarly].second);
        }
        if (kPrefetchMiddle < count)
        {
            m_links.prefetchAnchor(coming[kPrefetchMiddle].first);
            m_links.prefetchAnchor(coming[kPrefetchMiddle].second);
        }
        if (kPrefetchLate < count)
        {
            m_links.prefetchFirst(coming[kPrefetchLate].first);
            m_links.prefetchFirst(coming[kPrefetchLate].second);
        }
    }

    /// removeOverlappingPair() by ids.
    void* removePair(Pair ids, btDispatcher* dispatcher);

    /// removePair() for each pair, in order, with prefetches; returns the number of removed pairs.
    ///
    /// Where at least half of all leave in ascending order and no callback has to run, they leave at once; that takes 4 bytes
    /// per pair for the call, or 12 where some stay. With callbacks they leave one by one without a search, until a callback
    /// changes the cache, for 12 bytes per pair. If all leave, they are not linked meanwhile: the lists of what callbacks add
    /// are made afterwards, in the order of the array.
    std::size_t removePairs(const Pair* ids, std::size_t count, btDispatcher* dispatcher);

    /// findPair() by ids.
    btBroadphasePair* findPair(Pair ids);

    /// Traverses the hash: O(pairs).
    PairCacheStats stats() const;

    /// Allocated memory. O(1).
    std::uint64_t bytes() const;

    /// Whether array, hash and lists are consistent; for tests and debugging. Not from within callbacks. O(pairs).
    bool isConsistent() const;

    /// Whether the ghost callback of a pair that leaves is running: the array still has the pair, maybe without bodies.
    bool hasDetachedPairs() const { return m_detachedCount != 0; }

private:
    /// Keeps the index of one pair of the array while callbacks may move or remove it.
    class Cursor;
    /// The addition of a pair while the filter or ghost callback runs for it.
    class Addition;
    class CallerChange;
    class Places;
    class WithoutLinks;
    /// How the pairs of a batch are removed.
    enum class Leaving
    {
        OneByOne,       ///< each is searched
        Silently,       ///< at once
        WithCallbacks,  ///< one by one, without a search while no callback changes the cache
    };

    static constexpr std::uint32_t kNone = PairHash::kNone;

    // Prefetch distances in pairs; each stage reads what the stage before it prefetched.
    static constexpr std::size_t kPrefetchEarly = 32, kPrefetchMiddle = 20, kPrefetchLate = 10;

    std::uint32_t size() const { return static_cast<std::uint32_t>(m_pairs.size()); }
    btBroadphasePair* pairAt(std::uint32_t index);
    bool isDetached(std::uint32_t index) const { return m_detachedCount != 0 && isBeingRemoved(index); }
    bool isBeingRemoved(std::uint32_t index) const;
    bool isPairOf(std::uint32_t index, const btBroadphaseProxy* proxy) const;
    std::uint32_t indexOf(const ProxyPair& sorted) const;
    std::uint32_t indexOf(Pair ids) const;
    std::uint32_t searchedIndexOf(Pair ids);
    Leaving findMost(const Pair* ids, std::size_t count, const btDispatcher* dispatcher,
                     HugeVector<std::uint32_t>& leaving, HugeVector<std::uint32_t>& places);
    std::size_t removeInTurn(const HugeVector<std::uint32_t>& leaving, HugeVector<std::uint32_t>& places,
                             btDispatcher* dispatcher);
    std::size_t removeAtOnce(const HugeVector<std::uint32_t>& leaving, HugeVector<std::uint32_t>& places);
    void removeAll();
    void removeMost(const HugeVector<std::uint32_t>& leaving, HugeVector<std::uint32_t>& places);
    void makeRoom();
    void growTo(std::size_t pairCount);
    bool isBeingAdded(const ProxyPair& sorted) const;
    btBroadphasePair* addFiltered(btBroadphaseProxy* proxy0, btBroadphaseProxy* proxy1, bool isAbsent);
    btBroadphasePair* addAccepted(const ProxyPair& sorted, bool isAbsent);
    btBroadphasePair* addReported(const ProxyPair& sorted, Addition& addition);
    template <class IsAffected>
    void cancelAdditions(IsAffected isAffected, btDispatcher* dispatcher);
    void* cancelAddition(Pair ids, btDispatcher* dispatcher);
    void report(const Addition& addition);
    bool hasMemory(const ProxyPair& sorted);
    bool isAnchorNeeded(std::uint32_t id) const noexcept;
    void dropAnchors(Pair ids) noexcept;
    btBroadphasePair* append(const ProxyPair& sorted);
    [[gnu::always_inline]] void prefetchRemoval(const Pair* coming, std::size_t count);
    [[gnu::always_inline]] void prefetchMoves();
    [[gnu::always_inline]] void prefetchEntry(std::uint32_t index);
    [[gnu::always_inline]] void prefetchPair(std::uint32_t index);
    [[gnu::always_inline]] void prefetchNeighbours(std::uint32_t index);
    void* removeAt(std::uint32_t index, btDispatcher* dispatcher);
    void* removeWithCallbacks(std::uint32_t index, btDispatcher* dispatcher);
    void removeForCallback(const Cursor& cursor, btDispatcher* dispatcher);
    void* removeTracked(Cursor& cursor, btDispatcher* dispatcher);
    void cleanByScan(const btBroadphaseProxy* proxy, btDispatcher* dispatcher);
    void removeByScan(const btBroadphaseProxy* proxy, btDispatcher* dispatcher);
    void makeLinks();
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
    std::uint64_t m_version = 0;
    std::uint64_t m_changesByCallers = 0;
    std::uint64_t m_pairsWithoutMemory = 0;
    std::uint32_t m_detachedCount = 0;  ///< entries whose ghost callback is running
    std::uint64_t m_visited = 0;
    std::uint64_t m_searched = 0;
    std::uint64_t m_moved = 0;
    bool m_isLinked = true;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
