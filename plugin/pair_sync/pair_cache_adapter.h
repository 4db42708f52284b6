// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/pair.h"
#include "cullet/plugin/pair_cache/pair_cache.h"
#include "cullet/plugin/proxies/proxy_store.h"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>

#include <memory>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The pair cache as the broad phase uses it: one interface for cullet's own cache, Bullet's three, and any other.
///
/// Peculiarities of Bullet's caches: the hashed one evaluates the filter in each addOverlappingPair(). The sorted one
/// cannot remove single pairs, does not report removals to ghosts, and evaluates the filter even in a search; so this
/// class searches and removes its pairs itself. The null cache stores nothing, so the broad phase skips it.
class PairCacheAdapter
{
public:
    /// @param external cache of the caller, or null for an own PairCache
    explicit PairCacheAdapter(btOverlappingPairCache* external);
    PairCacheAdapter(const PairCacheAdapter&) = delete;
    PairCacheAdapter& operator=(const PairCacheAdapter&) = delete;

    btOverlappingPairCache* cache() const noexcept { return m_cache; }

    /// False for btNullPairCache.
    bool storesPairs() const noexcept { return m_storesPairs; }
    int count() const { return m_cache->getNumOverlappingPairs(); }
    /// Changes of pairs by other callers, if the cache counts them; 0 for caches that are not cullet's.
    std::uint64_t externalChanges() const
    {
        return m_culletCache != nullptr ? m_culletCache->changesByCallers() : 0;
    }
    bool countsExternalChanges() const noexcept { return m_culletCache != nullptr; }
    /// Pairs that add() did not add because of lack of memory, if the cache counts them.
    std::uint64_t pairsWithoutMemory() const
    {
        return m_culletCache != nullptr ? m_culletCache->pairsWithoutMemory() : 0;
    }
    btOverlapFilterCallback* filterCallback() const { return m_cache->getOverlapFilterCallback(); }

    /// Whether a ghost pair callback is installed, or the value of setGhosts(). The callback of caches that are neither
    /// cullet's nor Bullet's, or of a class without RTTI, cannot be read. Every setAabb() calls this: one load.
    bool hasGhostCallback() const noexcept { return *m_ghosts != nullptr; }
    void setGhosts(bool areInstalled) noexcept
    {
        // Any non-null address: this pointer is never dereferenced.
        m_ghostOverride = areInstalled ? reinterpret_cast<btOverlappingPairCallback*>(this) : nullptr;
        m_ghosts = &m_ghostOverride;
    }

    bool contains(btBroadphaseProxy& a, btBroadphaseProxy& b) const;

    /// Adds a pair if the filter agrees; returns whether the pair is in the cache now.
    ///
    /// @param isAbsent whether the pair is known not to be in the cache: a cache of cullet's then does not search it
    bool add(btBroadphaseProxy& a, btBroadphaseProxy& b, bool isAbsent);

    /// PairCache::version(); 0 for caches that are not cullet's.
    std::uint64_t version() const { return m_culletCache != nullptr ? m_culletCache->version() : 0; }

    /// Whether the cache is one of cullet's that lacks every pair, and that no callback is adding a pair to.
    bool isEmpty() const { return m_culletCache != nullptr && m_culletCache->isEmpty(); }

    /// Whether another pair fits into the memory of the cache, or the cache is not one of cullet's.
    bool hasRoom() const { return m_culletCache == nullptr || m_culletCache->hasRoom(); }

    /// Whether pairs can be added without any callback: addUnfiltered().
    bool canAddUnfiltered() const
    {
        return m_culletCache != nullptr && m_culletCache->ghostPairCallback() == nullptr &&
               filterCallback() == nullptr;
    }

    /// Adds a pair that the filter words let pass; false if memory ran out. @pre canAddUnfiltered()
    bool addUnfiltered(btBroadphaseProxy& first, btBroadphaseProxy& second)
    {
        return m_culletCache->addPairUnfiltered(&first, &second) != nullptr;
    }

    /// addUnfiltered() without a search, for pairs that are not in the cache. @pre isEmpty() before the first one
    bool addNew(btBroadphaseProxy& first, btBroadphaseProxy& second)
    {
        return m_culletCache->appendNew(&first, &second);
    }

    /// Prefetches the searches of the next pairs, if the cache can: PairCache::prefetchSearch().
    [[gnu::always_inline]] void prefetchSearch(const Pair* coming, std::size_t count) const
    {
        if (m_culletCache != nullptr)
            m_culletCache->prefetchSearch(coming, count);
    }

    /// Prefetches for the additions of the next pairs, if the cache can: PairCache::prefetchAddition().
    [[gnu::always_inline]] void prefetchAddition(const Pair* coming, std::size_t count) const
    {
        if (m_culletCache != nullptr)
            m_culletCache->prefetchAddition(coming, count);
    }

    /// Reserves memory for more pairs, if the cache can.
    void reserveMore(std::size_t pairCount);

    /// PairCache::setLinked(), if the cache is the broad phase's own.
    void setLinked(bool isLinked)
    {
        if (m_own != nullptr)
            m_own->setLinked(isLinked);
    }

    /// Removes those pairs that are in the cache, in order; ids without a live proxy are skipped. @pre sorted
    void remove(const Pairs& pairs, const ProxyStore& store, btDispatcher* dispatcher);

    /// Removes every pair of a proxy that has not been destroyed yet.
    void removePairsOf(btBroadphaseProxy& proxy, btDispatcher* dispatcher);

private:
    template <class IsRemoved>
    void removeLinearly(IsRemoved isRemoved, btDispatcher* dispatcher);

    std::unique_ptr<PairCache> m_own;
    btOverlappingPairCache* m_cache;
    PairCache* m_culletCache;  // the cache, if it is cullet's; else null
    // Address of the callback in the cache, if the cache is Bullet's; else null.
    btOverlappingPairCallback* const* m_ghostSlot = nullptr;
    bool m_storesPairs = true;
    bool m_isSorted = false;
    btOverlappingPairCallback* m_ghostOverride = nullptr;  // set by setGhosts(); not null: there are ghosts
    // Address of the callback that decides whether there are ghosts: the cache's, or m_ghostOverride.
    btOverlappingPairCallback* const* m_ghosts = &m_ghostOverride;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
