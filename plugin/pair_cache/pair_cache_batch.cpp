// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Removal of pairs in batches: at once where most leave; otherwise the memory of the next pairs is prefetched while the
// current pair is removed.
#include "cullet/broad/huge_vector.h"
#include "cullet/plugin/pair_cache/pair_cache_parts.h"

#include <algorithm>
#include <new>
#include <numeric>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr std::size_t kFewestAtOnce = 32;  // fewer removals take less than the lists for them

/// The hash value of the ids in the order of the hash.
std::uint64_t hashOf(Pair ids)
{
    return hashOfPair(inBulletsOrder(ids));
}
std::uint64_t hashOf(const btBroadphaseProxy* proxy0, const btBroadphaseProxy* proxy1)
{
    return hashOf({uniqueIdOf(proxy0), uniqueIdOf(proxy1)});
}

/// Reserves memory for a number of entries; false if there is none.
bool hasReserved(HugeVector<std::uint32_t>& entries, std::size_t count)
{
    try
    {
        entries.reserve(count);
        return true;
    }
    catch (const std::bad_alloc&)
    {
        return false;
    }
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
    if (count >= kFewestAtOnce && count >= size() / 2)
    {
        HugeVector<std::uint32_t> leaving, places;
        if (findMost(ids, count, dispatcher, leaving, places))
        {
            if (leaving.size() == size())
                removeAll();
            else
                removeMost(leaving, places);
            return leaving.size();
        }
    }
    // What a small cache has is in the cache of the processor.
    const bool isLarge = size() > kFewPairs || m_links.listCount() > kFewBodies || !m_isLinked;
    std::size_t found = 0;
    for (std::size_t i = 0; i < count; ++i)
    {
        if (isLarge)
            prefetchRemoval(ids + i, count - i);
        const std::uint32_t index = searchedIndexOf(ids[i]);
        if (index == kNone)
            continue;
        removeAt(index, dispatcher);
        ++found;
    }
    return found;
}

/// Lists the entries of the pairs to remove, and reserves memory for removeMost(). False unless they are at least half of
/// all, in ascending order, and leave without any callback.
///
/// A pair is expected in the entry after that of the pair before it, where pairs have entered in order; only others are
/// searched.
bool PairCache::findMost(const Pair* ids, std::size_t count, const btDispatcher* dispatcher,
                         HugeVector<std::uint32_t>& leaving, HugeVector<std::uint32_t>& places)
{
    if (m_ghosts != nullptr || m_cursors != nullptr || m_additions != nullptr)
        return false;
    if (!hasReserved(leaving, std::min<std::size_t>(count, size())))
        return false;
    std::uint32_t expected = 0;
    for (std::size_t i = 0; i < count; ++i)
    {
        if (i != 0 && !(ids[i - 1] < ids[i]))
            return false;
        const Pair sorted = inBulletsOrder(ids[i]);
        const bool isExpected = expected < size() && idsOf(*pairAt(expected)) == sorted;
        const std::uint32_t index = isExpected ? expected : searchedIndexOf(sorted);
        if (index == kNone)
            continue;
        if (dispatcher != nullptr && pairAt(index)->m_algorithm != nullptr)
            return false;
        leaving.push_back(index);
        expected = index + 1;
    }
    return leaving.size() == size() ||
           (leaving.size() >= size() / 2 && hasReserved(places, 2 * std::size_t{size()}));
}

/// Removes all pairs, which no callback notices.
void PairCache::removeAll()
{
    m_version += size();
    m_hash.clear();
    if (m_isLinked)
        m_links.removeAll();
    m_pairs.resizeNoInitialize(0);
}

/// Removes pairs at once, which no callback notices. Those that stay get the places and the order in the lists that
/// removals one by one would give them.
///
/// @param leaving entries before the first removal, in the order of the removals
/// @param places  [out] overwritten; with memory for the numbers of two entries for each pair
void PairCache::removeMost(const HugeVector<std::uint32_t>& leaving, HugeVector<std::uint32_t>& places)
{
    std::uint32_t count = size();
    places.resizeForOverwrite(2 * std::size_t{count});
    std::uint32_t* const placeOf = places.data();          // by entry before the first removal
    std::uint32_t* const entryAt = places.data() + count;  // which entry is at a place now
    std::iota(placeOf, placeOf + count, 0u);
    std::iota(entryAt, entryAt + count, 0u);
    for (const std::uint32_t entry : leaving)
    {
        const std::uint32_t hole = placeOf[entry];
        const std::uint32_t last = entryAt[--count];
        entryAt[hole] = last;
        placeOf[last] = hole;
        if (m_isLinked)
            m_links.detach(entry, idsOf(*pairAt(entry)));
    }
    // Those that move come from beyond the new end.
    m_hash.clear();
    for (std::uint32_t place = 0; place < count; ++place)
    {
        const std::uint32_t entry = entryAt[place];
        if (entry != place)
        {
            ++m_moved;
            *pairAt(place) = *pairAt(entry);
            if (m_isLinked)
                m_links.move(entry, place);
        }
        m_hash.insert(hashOfPair(idsOf(*pairAt(place))), place);
    }
    if (m_isLinked)
        m_links.truncate(count);
    m_pairs.resizeNoInitialize(static_cast<int>(count));
    m_version += leaving.size();
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
