// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_sync/pair_cache_adapter.h"

#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/core/proxy_ids.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseProxy.h>

#include <algorithm>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Accesses the protected ghost callback of one of Bullet's caches, which have a setter for it but no getter.
template <class Cache>
struct GhostAccess : Cache
{
    static btOverlappingPairCallback* const* slotOf(Cache& cache)
    {
        return &(cache.*(&GhostAccess::m_ghostPairCallback));
    }
};

template <class IsRemoved>
class RemoveIf final : public btOverlapCallback
{
public:
    RemoveIf(IsRemoved isRemoved, btOverlappingPairCache& cache, btOverlappingPairCallback* ghosts,
             btDispatcher* dispatcher)
        : m_isRemoved(isRemoved), m_cache(cache), m_ghosts(ghosts), m_dispatcher(dispatcher)
    {
    }

    bool processOverlap(btBroadphasePair& pair) override
    {
        if (!m_isRemoved(pair))
            return false;
        // Without a dispatcher the algorithm leaks, as in Bullet's hashed cache; the sorted one would crash.
        if (m_dispatcher == nullptr)
            pair.m_algorithm = nullptr;
        m_cache.cleanOverlappingPair(pair, m_dispatcher);
        if (m_ghosts != nullptr)
            m_ghosts->removeOverlappingPair(pair.m_pProxy0, pair.m_pProxy1, m_dispatcher);
        return true;
    }

private:
    IsRemoved m_isRemoved;
    btOverlappingPairCache& m_cache;
    btOverlappingPairCallback* m_ghosts;
    btDispatcher* m_dispatcher;
};

}  // namespace

PairCacheAdapter::PairCacheAdapter(btOverlappingPairCache* external)
    : m_own(external == nullptr ? std::make_unique<PairCache>() : nullptr),
      m_cache(external == nullptr ? m_own.get() : external),
      m_culletCache(dynamicCast<PairCache>(m_cache))
{
    if (auto* hashed = dynamicCast<btHashedOverlappingPairCache>(m_cache))
        m_ghostSlot = GhostAccess<btHashedOverlappingPairCache>::slotOf(*hashed);
    if (auto* sorted = dynamicCast<btSortedOverlappingPairCache>(m_cache))
    {
        m_ghostSlot = GhostAccess<btSortedOverlappingPairCache>::slotOf(*sorted);
        m_isSorted = true;
    }
    // hasDeferredRemoval() works without RTTI; only the sorted cache and the null cache return true.
    m_isSorted = m_isSorted || (dynamicType(*m_cache) == nullptr && m_cache->hasDeferredRemoval());
    m_storesPairs = dynamicCast<btNullPairCache>(m_cache) == nullptr;
    if (m_culletCache != nullptr)
        m_ghosts = &m_culletCache->ghostPairCallbackSlot();
    else if (m_ghostSlot != nullptr)
        m_ghosts = m_ghostSlot;
}

bool PairCacheAdapter::contains(btBroadphaseProxy& a, btBroadphaseProxy& b) const
{
    if (m_isSorted)
    {
        const btBroadphasePairArray& pairs = m_cache->getOverlappingPairArray();
        return pairs.findLinearSearch(btBroadphasePair(a, b)) < pairs.size();
    }
    return m_cache->findPair(&a, &b) != nullptr;
}

bool PairCacheAdapter::add(btBroadphaseProxy& a, btBroadphaseProxy& b, bool isAbsent)
{
    // As btDbvtBroadphase does, so that a filter gets both proxies in the order of the pair.
    btBroadphaseProxy* const first = isLowerId(a, b) ? &a : &b;
    btBroadphaseProxy* const second = isLowerId(a, b) ? &b : &a;
    if (m_culletCache == nullptr)
        return m_cache->addOverlappingPair(first, second) != nullptr;
    return (isAbsent ? m_culletCache->addAbsent(first, second) : m_culletCache->addPair(first, second)) !=
           nullptr;
}

void PairCacheAdapter::reserveMore(std::size_t pairCount)
{
    if (m_culletCache != nullptr)
        m_culletCache->reserve(static_cast<std::size_t>(count()) + pairCount);
}

template <class IsRemoved>
void PairCacheAdapter::removeLinearly(IsRemoved isRemoved, btDispatcher* dispatcher)
{
    RemoveIf<IsRemoved> callback(isRemoved, *m_cache, m_ghostSlot != nullptr ? *m_ghostSlot : nullptr,
                                 dispatcher);
    m_cache->processAllOverlappingPairs(&callback, dispatcher);
}

void PairCacheAdapter::remove(const Pairs& pairs, const ProxyStore& store, btDispatcher* dispatcher)
{
    if (pairs.empty())
        return;
    if (m_culletCache != nullptr)
    {
        m_culletCache->removePairs(pairs.data(), pairs.size(), dispatcher);
        return;
    }
    if (m_isSorted)
    {
        removeLinearly([&](const btBroadphasePair& pair)
                       { return std::binary_search(pairs.begin(), pairs.end(), pairOf(pair)); },
                       dispatcher);
        return;
    }
    for (const Pair pair : pairs)
    {
        Proxy* first = store.find(pair.first);
        Proxy* second = store.find(pair.second);
        if (first != nullptr && second != nullptr)
            m_cache->removeOverlappingPair(first, second, dispatcher);
    }
}

void PairCacheAdapter::removePairsOf(btBroadphaseProxy& proxy, btDispatcher* dispatcher)
{
    if (m_culletCache != nullptr)
        return m_culletCache->removePairsOf(&proxy, dispatcher);
    if (!m_isSorted)
    {
        m_cache->removeOverlappingPairsContainingProxy(&proxy, dispatcher);
        return;
    }
    removeLinearly([&](const btBroadphasePair& pair)
                   { return pair.m_pProxy0 == &proxy || pair.m_pProxy1 == &proxy; },
                   dispatcher);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
