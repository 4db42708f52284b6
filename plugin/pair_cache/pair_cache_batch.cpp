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
#include <optional>

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

/// Prefetches for the removal of the next pairs, which are searched, and for the moves into their entries.
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
    prefetchMoves();
}

/// Prefetches for the move of the last pairs of the array into the entries of removed ones.
inline void PairCache::prefetchMoves()
{
    // The proxies of a detached pair may be gone.
    if (size() <= kPrefetchEarly || m_detachedCount != 0)
        return;
    prefetchPair(size() - kPrefetchEarly);
    prefetchNeighbours(size() - kPrefetchMiddle);
    prefetchEntry(size() - kPrefetchLate);
}

/// Prefetches the entry of the hash for a pair.
inline void PairCache::prefetchEntry(std::uint32_t index)
{
    if (index < size())
        m_hash.prefetch(hashOfPair(idsOf(*pairAt(index))));
}

std::size_t PairCache::removePairs(const Pair* ids, std::size_t count, btDispatcher* dispatcher)
{
    std::size_t found = 0;
    if (count >= kFewestAtOnce && count >= size() / 2)
    {
        HugeVector<std::uint32_t> leaving, places;
        const Leaving which = findMost(ids, count, dispatcher, leaving, places);
        if (which == Leaving::Silently)
            return removeAtOnce(leaving, places);
        if (which == Leaving::WithCallbacks)
            found = removeInTurn(leaving, places, dispatcher);
    }
    // What a small cache has is in the cache of the processor.
    const bool isLarge = size() > kFewPairs || m_links.listCount() > kFewBodies || !m_isLinked;
    for (std::size_t i = found; i < count; ++i)
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

/// Lists the entries of the pairs to remove, and reserves memory for the places of all. The pairs are at least half of all, in
/// ascending order, and where callbacks run for them the cache has each; otherwise Leaving::OneByOne.
///
/// A pair is expected in the entry after that of the pair before it, where pairs have entered in order; only others are
/// searched.
PairCache::Leaving PairCache::findMost(const Pair* ids, std::size_t count, const btDispatcher* dispatcher,
                                       HugeVector<std::uint32_t>& leaving, HugeVector<std::uint32_t>& places)
{
    if (m_cursors != nullptr || m_additions != nullptr ||
        !hasReserved(leaving, std::min<std::size_t>(count, size())))
        return Leaving::OneByOne;
    bool hasCallbacks = m_ghosts != nullptr;
    std::uint32_t expected = 0;
    for (std::size_t i = 0; i < count; ++i)
    {
        if (i != 0 && !(ids[i - 1] < ids[i]))
            return Leaving::OneByOne;
        const Pair sorted = inBulletsOrder(ids[i]);
        const bool isExpected = expected < size() && idsOf(*pairAt(expected)) == sorted;
        const std::uint32_t index = isExpected ? expected : searchedIndexOf(sorted);
        if (index == kNone)
            continue;
        hasCallbacks |= dispatcher != nullptr && pairAt(index)->m_algorithm != nullptr;
        leaving.push_back(index);
        expected = index + 1;
    }
    if (leaving.size() < size() / 2 || (hasCallbacks && leaving.size() < count))
        return Leaving::OneByOne;
    const bool needsPlaces = hasCallbacks || leaving.size() < size();
    if (needsPlaces && !hasReserved(places, 2 * std::size_t{size()}))
        return Leaving::OneByOne;
    return hasCallbacks ? Leaving::WithCallbacks : Leaving::Silently;
}

/// Where pairs are while some are removed one by one and the last one of all moves into each hole.
class PairCache::Places
{
public:
    /// @param places memory for the numbers of two entries for each pair; overwritten
    Places(HugeVector<std::uint32_t>& places, std::uint32_t count)
        : m_placeOf(places.data()), m_entryAt(places.data() + count), m_count(count)
    {
        places.resizeForOverwrite(2 * std::size_t{count});
        std::iota(m_placeOf, m_placeOf + count, 0u);
        std::iota(m_entryAt, m_entryAt + count, 0u);
    }

    std::uint32_t count() const { return m_count; }
    /// The place of a pair by its entry before the first removal.
    std::uint32_t placeOf(std::uint32_t entry) const { return m_placeOf[entry]; }
    /// The pair at a place, by its entry before the first removal.
    std::uint32_t entryAt(std::uint32_t place) const { return m_entryAt[place]; }

    void remove(std::uint32_t entry)
    {
        const std::uint32_t hole = m_placeOf[entry];
        const std::uint32_t last = m_entryAt[--m_count];
        m_entryAt[hole] = last;
        m_placeOf[last] = hole;
    }

private:
    std::uint32_t* m_placeOf;
    std::uint32_t* m_entryAt;
    std::uint32_t m_count;
};

/// Leaves pairs without lists as long as it exists. Lists made at its end are in the order of the array.
class PairCache::WithoutLinks
{
public:
    explicit WithoutLinks(PairCache& cache) : m_cache(cache), m_wasLinked(cache.m_isLinked)
    {
        m_cache.m_isLinked = false;
        m_cache.m_links.removeAll();
    }
    ~WithoutLinks()
    {
        m_cache.m_isLinked = m_wasLinked;
        if (m_wasLinked && m_cache.size() != 0)
            m_cache.makeLinks();
    }
    WithoutLinks(const WithoutLinks&) = delete;
    WithoutLinks& operator=(const WithoutLinks&) = delete;

private:
    PairCache& m_cache;
    bool m_wasLinked;
};

/// Removes pairs one by one, with their callbacks, and searches none, until a callback has changed the cache.
///
/// @param leaving entries before the first removal, in the order of the removals
/// @param places  [out] overwritten; with memory for the numbers of two entries for each pair
/// @return number of removals
std::size_t PairCache::removeInTurn(const HugeVector<std::uint32_t>& leaving,
                                    HugeVector<std::uint32_t>& places, btDispatcher* dispatcher)
{
    // Lists that will be empty are not kept up to date.
    std::optional<WithoutLinks> withoutLinks;
    if (leaving.size() == size())
        withoutLinks.emplace(*this);
    const bool isLarge = size() > kFewPairs;
    Places tracked(places, size());
    for (std::size_t i = 0; i < leaving.size(); ++i)
    {
        if (isLarge && i + kPrefetchEarly < leaving.size())
        {
            prefetchPair(tracked.placeOf(leaving[i + kPrefetchEarly]));
            prefetchNeighbours(tracked.placeOf(leaving[i + kPrefetchMiddle]));
            prefetchEntry(tracked.placeOf(leaving[i + kPrefetchLate]));
            prefetchMoves();
        }
        const std::uint64_t before = m_version;
        removeAt(tracked.placeOf(leaving[i]), dispatcher);
        if (m_version != before + 1)
            return i + 1;
        tracked.remove(leaving[i]);
    }
    return leaving.size();
}

/// Removes pairs of which no callback notices; returns their number. Parameters as of removeInTurn().
std::size_t PairCache::removeAtOnce(const HugeVector<std::uint32_t>& leaving,
                                    HugeVector<std::uint32_t>& places)
{
    if (leaving.size() == size())
        removeAll();
    else
        removeMost(leaving, places);
    return leaving.size();
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
    Places tracked(places, size());
    for (const std::uint32_t entry : leaving)
    {
        tracked.remove(entry);
        if (m_isLinked)
            m_links.detach(entry, idsOf(*pairAt(entry)));
    }
    const std::uint32_t count = tracked.count();
    // Those that move come from beyond the new end.
    m_hash.clear();
    for (std::uint32_t place = 0; place < count; ++place)
    {
        const std::uint32_t entry = tracked.entryAt(place);
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
