// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Statistics and self-check of the cache.

#include "cullet/plugin/pair_cache/pair_cache_parts.h"

#include <algorithm>

namespace cullet
{
inline namespace CULLET_PRECISION
{
std::uint64_t PairCache::bytes() const
{
    return static_cast<std::uint64_t>(m_pairs.capacity()) * sizeof(btBroadphasePair) + m_hash.bytes() +
           m_links.bytes() + m_order.bytes();
}

PairCacheStats PairCache::stats() const
{
    PairCacheStats stats;
    stats.pairs = size();
    stats.slots = m_hash.slotCount();
    stats.load = static_cast<double>(stats.pairs) / static_cast<double>(stats.slots);
    std::uint64_t probes = 0;
    for (std::uint32_t index = 0; index < size(); ++index)
    {
        const Pair ids = idsOf(m_pairs[static_cast<int>(index)]);
        const std::uint64_t probesOfPair = m_hash.probesOf(hashOfPair(ids), index);
        probes += probesOfPair;
        stats.longestProbe = std::max(stats.longestProbe, probesOfPair);
    }
    if (size() > 0)
        stats.meanProbe = static_cast<double>(probes) / size();
    stats.rehashes = m_hash.rehashes();
    stats.proxies = m_links.listCount();
    stats.visited = m_visited;
    stats.searched = m_searched;
    stats.moved = m_moved;
    stats.bytes = bytes();
    return stats;
}

bool PairCache::isConsistent() const
{
    if (m_hash.size() != size())
        return false;
    std::uint64_t overflowCount = 0;
    for (std::uint32_t index = 0; index < size(); ++index)
    {
        const btBroadphasePair& pair = m_pairs[static_cast<int>(index)];
        if (!isLowerId(*pair.m_pProxy0, *pair.m_pProxy1))
            return false;
        if (indexOf(idsOf(pair)) != index)
            return false;
        overflowCount += m_hash.probesOf(hashOfPair(idsOf(pair)), index) - 1;
    }
    if (m_hash.totalOverflowCount() != overflowCount)
        return false;
    return !m_isLinked || m_links.isConsistent(size(), [&](std::uint32_t pair)
                                               { return idsOf(m_pairs[static_cast<int>(pair)]); });
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
