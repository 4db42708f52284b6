// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Changes of the pair cache in batches. The memory of the next pairs of a batch is prefetched while the current pair is
// processed: in a large cache nearly all the time is spent on cache misses.
#include "cullet/plugin/pair_cache/pair_cache_parts.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
// Prefetch distances in pairs; each stage reads what the stage before it prefetched.
constexpr std::size_t kStage1 = 32;
constexpr std::size_t kStage2 = 20;
constexpr std::size_t kStage3 = 10;

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

std::size_t PairCache::addPairsUnfiltered(const ProxyPair* pairs, std::size_t count)
{
    const std::uint32_t before = size();
    reserve(before + count);
    for (std::size_t i = 0; i < count; ++i)
    {
        if (i + kStage1 < count)
            __builtin_prefetch(pairs[i + kStage1].second);
        if (i + kStage2 < count)
            m_hash.prefetch(hashOf(pairs[i + kStage2].first, pairs[i + kStage2].second));
        if (i + kStage3 < count)
            m_links.prefetchFirst(uniqueIdOf(pairs[i + kStage3].second));
        addPairUnfiltered(pairs[i].first, pairs[i].second);
    }
    return size() - before;
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

/// Prefetches for the removal of the next pairs, and for the move of the last pairs of the array into their entries.
void PairCache::prefetchRemoval(const Pair* coming, std::size_t count)
{
    if (kStage1 < count)
        m_hash.prefetch(hashOf(coming[kStage1]));
    if (kStage2 < count)
        prefetchPair(m_hash.guess(hashOf(coming[kStage2])));
    if (kStage3 < count)
        prefetchNeighbours(m_hash.guess(hashOf(coming[kStage3])));
    if (size() <= kStage1)
        return;
    prefetchPair(size() - kStage1);
    prefetchNeighbours(size() - kStage2);
    const btBroadphasePair& moving = *pairAt(size() - kStage3);
    m_hash.prefetch(hashOf(moving.m_pProxy0, moving.m_pProxy1));
}

void PairCache::prefetchPair(std::uint32_t index)
{
    if (index >= size())
        return;
    __builtin_prefetch(pairAt(index));
    m_links.prefetch(index);
}

void PairCache::prefetchNeighbours(std::uint32_t index)
{
    if (index >= size())
        return;
    __builtin_prefetch(pairAt(index)->m_pProxy0);
    __builtin_prefetch(pairAt(index)->m_pProxy1);
    m_links.prefetchNeighbours(index);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
