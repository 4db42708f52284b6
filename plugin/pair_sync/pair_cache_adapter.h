// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/pair.h"
#include "cullet/plugin/pair_cache/pair_cache.h"
#include "cullet/plugin/proxies/proxy_store.h"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>

#include <memory>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The pair cache as the broad phase uses it: one interface over cullet's own, Bullet's three, and any other.
///
/// What Bullet's caches need: the hashed one looks the filter up in each addOverlappingPair(); the sorted one neither
/// removes single pairs nor tells ghosts of removals, and asks the filter when it only searches, so that its pairs are
/// searched and removed here; the null cache holds nothing, so that there is nothing to do for it.
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
    /// Changes of pairs that were not made here, as far as the cache counts them: 0 for other caches than cullet's.
    std::uint64_t foreignChanges() const { return m_fast != nullptr ? m_fast->changesByCallers() : 0; }
    /// Pairs that add() has left out for lack of memory, as far as the cache counts them.
    std::uint64_t pairsWithoutMemory() const { return m_fast != nullptr ? m_fast->pairsWithoutMemory() : 0; }
    btOverlapFilterCallback* filterCallback() const { return m_cache->getOverlapFilterCallback(); }

    /// Whether a ghost pair callback is installed, unless setGhosts() has said it. Other caches than cullet's and Bullet's, and
    /// those of a class without RTTI, cannot be asked. For every setAabb(): one look.
    bool hasGhostCallback() const noexcept { return *m_ghosts != nullptr; }
    void setGhosts(bool areInstalled) noexcept
    {
        // The address of no callback, which is not followed.
        m_told = areInstalled ? reinterpret_cast<btOverlappingPairCallback*>(this) : nullptr;
        m_ghosts = &m_told;
    }

    bool contains(btBroadphaseProxy& a, btBroadphaseProxy& b) const;

    /// Adds a pair that is not in the cache, if the filter agrees; tells whether the pair is in the cache now.
    bool add(btBroadphaseProxy& a, btBroadphaseProxy& b);

    /// Whether pairs can be added without any callback, all at one go: addAtOneGo().
    bool canAddAtOneGo() const
    {
        return m_fast != nullptr && m_fast->ghostPairCallback() == nullptr && filterCallback() == nullptr;
    }

    /// Adds pairs that are not in the cache and that the filter words let pass; false when memory ran out.
    /// @pre canAddAtOneGo()
    bool addAtOneGo(const std::vector<ProxyPair>& pairs);

    /// Makes room for so many more pairs, where the cache can.
    void reserveMore(std::size_t pairCount);

    /// Removes the pairs that are there, in order; ids that no longer live are skipped. @pre sorted
    void remove(const Pairs& pairs, const ProxyStore& store, btDispatcher* dispatcher);

    /// Removes every pair of a proxy, which is still intact.
    void removePairsOf(btBroadphaseProxy& proxy, btDispatcher* dispatcher);

private:
    template <class IsRemoved>
    void removeLinearly(IsRemoved isRemoved, btDispatcher* dispatcher);

    std::unique_ptr<PairCache> m_own;
    btOverlappingPairCache* m_cache;
    PairCache* m_fast;  // the cache, if it is cullet's
    btOverlappingPairCallback* const* m_ghostSlot =
        nullptr;  // where the cache keeps the callback, if it is Bullet's
    bool m_storesPairs = true;
    bool m_isSorted = false;
    btOverlappingPairCallback* m_told = nullptr;  // not null: there are ghosts, whatever the cache has
    btOverlappingPairCallback* const* m_ghosts = &m_told;  // where it says whether there are
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
