// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Removal of pairs in batches. The memory of the next pairs of a batch is prefetched while the current pair is removed.
#include "cullet/plugin/pair_cache/pair_cache_parts.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// The hash value of the ids in the order of the hash.
std::uint64_t hashOf(Pair ids)
{
    return hashOfPair(inBulletsOrder(ids));
}
std::uint64_t hashOf(const btBroadphaseProxy* proxy0, const btBroadphaseProxy* proxy1)
{
    return hashOf({uniqueIdOf(proxy0), uniqueIdOf(proxy1)});
}
}  // namespace

inline void PairCache::prefetchPair(std::uint32_t index)
{
    if (index >= size())
        return;
    __builtin_prefetch(pairAt(index));
    if (m_isLinked)
        m_links.prefetch(index);
}

inline void PairCache::prefetchNeighbours(std::uint32_t index)
{
    if (index >= size())
        return;
    __builtin_prefetch(pairAt(index)->m_pProxy0);
    __builtin_prefetch(pairAt(index)->m_pProxy1);
    if (m_isLinked)
        m_links.prefetchNeighbours(index);
}

/// Prefetches for the removal of the next pairs, and for the move of the last pairs of the array into their entries.
inline void PairCache::prefetchRemoval(const Pair* coming, std::size_t count)
{
    if (kPrefetchEarly < count)
    {
        m_hash.prefetch(hashOf(coming[kPrefetchEarly]));
        m_links.prefetchId(coming[kPrefetchEarly].first);
        m_links.prefetchId(coming[kPrefetchEarly].second);
    }
    if (kPrefetchMiddle < count)
        prefetchPair(m_hash.guess(hashOf(coming[kPrefetchMiddle])));
    if (kPrefetchLate < count)
        prefetchNeighbours(m_hash.guess(hashOf(coming[kPrefetchLate])));
    // The proxies of a detached pair may be gone.
    if (size() <= kPrefetchEarly || m_detachedCount != 0)
        return;
    prefetchPair(size() - kPrefetchEarly);
    prefetchNeighbours(size() - kPrefetchMiddle);
    const btBroadphasePair& moving = *pairAt(size() - kPrefetchLate);
    m_hash.prefetch(hashOf(moving.m_pProxy0, moving.m_pProxy1));
}

std::size_t PairCache::removePairs(const Pair* ids, std::size_t count, btDispatcher* dispatcher)
{
    std::size_t found = 0;
    for (std::size_t i = 0; i < count; ++i)
    {
        prefetchRemoval(ids + i, count - i);
        const std::uint32_t index = indexOf(ids[i]);
        if (index == kNone)
            continue;
        removeAt(index, dispatcher);
        ++found;
    }
    return found;
}

}  // namespace CULLET_PRECISION
}  // namespace cullet
