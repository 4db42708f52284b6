// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Additions of pairs in batches, without callbacks where none is installed.
#include "cullet/plugin/pair_sync/pair_sync.h"

#include <algorithm>
#include <functional>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Prefetches for the addition of a pair and those after it; tryAdd() reads the boxes of the table, too.
inline void PairSync::prefetchAddition(const Pair* coming, std::size_t count, bool readsTable) const
{
    constexpr std::size_t kIds = 44, kProxies = 24;  // in pairs ahead
    if (kIds < count)
    {
        m_store.prefetchId(coming[kIds].first);
        m_store.prefetchId(coming[kIds].second);
    }
    if (kProxies < count)
    {
        __builtin_prefetch(m_store.find(coming[kProxies].first));
        __builtin_prefetch(m_store.find(coming[kProxies].second));
    }
    if (readsTable && kProxies < count)
    {
        m_store.prefetchTableBox(coming[kProxies].first);
        m_store.prefetchTableBox(coming[kProxies].second);
    }
    m_adapter.prefetchAddition(coming, count);
}

void PairSync::applyAdded(float margin)
{
    if (m_toReevaluate.empty() && m_delta.added.empty())
        return;
    if (m_deferredPairs.size() != 0)
    {
        for (const Pair pair : m_delta.added)
            m_deferredPairs.confirmHeld(pair);
    }
    if (m_toReevaluate.empty())
        return addInOrder(m_delta.added, margin);
    // Both lists are sorted.
    m_scratch.resize(m_toReevaluate.size() + m_delta.added.size());
    const auto end = std::set_union(m_toReevaluate.begin(), m_toReevaluate.end(), m_delta.added.begin(),
                                    m_delta.added.end(), m_scratch.begin());
    m_scratch.erase(end, m_scratch.end());
    addInOrder(m_scratch, margin);
}

/// Adds the pair without any callback, or defers it.
inline void PairSync::addUnfiltered(Pair pair, float margin, bool isNew)
{
    Proxy* first = m_store.find(pair.first);
    Proxy* second = m_store.find(pair.second);
    if (first == nullptr || second == nullptr || m_speculativePairs.erase(pair))
        return;
    const bool exactBoxesOverlap = overlapsExactly(*first, *second);
    if (!exactBoxesOverlap || !passesFilter(first->filter(), second->filter()))
        return defer(pair, *first, *second, exactBoxesOverlap, margin);
    m_deferredPairs.erase(pair);
    // If memory runs out, the next update restarts the backend and adds the remaining pairs.
    if (!(isNew ? m_adapter.addNew(*first, *second) : m_adapter.addUnfiltered(*first, *second)))
        m_state.restart();
}

/// Adds or defers each pair of a list.
void PairSync::addInOrder(const Pairs& pairs, float margin)
{
    const bool canAddUnfiltered = m_adapter.canAddUnfiltered();
    // A callback may refuse most of them, but for those that it has just allowed.
    if (canAddUnfiltered || m_allowedPairs != nullptr)
        m_adapter.reserveMore(pairs.size());
    const bool areAbsent =
        m_adapter.isEmpty() &&
        std::adjacent_find(pairs.begin(), pairs.end(), std::not_fn(std::less<Pair>())) == pairs.end();
    if (!canAddUnfiltered)
        return addWithCallbacks(pairs, areAbsent, margin);
    if (areAbsent)
        return addNew(pairs, margin);
    const bool areFew = areFewWith(pairs.size());
    for (std::size_t i = 0; i < pairs.size(); ++i)
    {
        if (!areFew)
            prefetchAddition(pairs.data() + i, pairs.size() - i, false);
        addUnfiltered(pairs[i], margin, false);
    }
}

/// Whether the pairs of the cache and as many more stay in the cache of the processor.
bool PairSync::areFewWith(std::size_t more) const
{
    return PairCache::areFew(static_cast<std::size_t>(m_adapter.count()) + more, m_store.table().size());
}

/// Adds or defers each pair of a list; callbacks of the application run for each.
///
/// @param areAbsent whether the cache is known to lack all of them; a callback may add some
void PairSync::addWithCallbacks(const Pairs& pairs, bool areAbsent, float margin)
{
    const bool areFew = areFewWith(pairs.size());
    const bool areFewBodies = PairCache::areFew(0, m_store.table().size());
    const int countBefore = m_adapter.count();
    std::uint64_t version = m_adapter.version();
    for (std::size_t i = 0; i < pairs.size(); ++i)
    {
        if (areFewBodies && !areFew)
            m_adapter.prefetchSearch(pairs.data() + i, pairs.size() - i);
        else if (!areFew)
            prefetchAddition(pairs.data() + i, pairs.size() - i, true);
        if (!m_adapter.hasRoom())
            reserveExpected(static_cast<std::size_t>(std::max(m_adapter.count() - countBefore, 0)), i,
                            pairs.size() - i);
        areAbsent = areAbsent && m_adapter.version() == version;
        version += tryAdd(pairs[i], areAbsent, margin) ? 1u : 0u;
    }
}

/// Reserves memory for the pairs of a list that are expected to pass the callbacks, if most have passed so far: as large a
/// share of the remaining ones as of those before. At most eight times as many pairs as there are then have memory, since
/// callbacks may refuse all others. Where they refuse many, memory grows by small steps, of which less stays unused.
void PairSync::reserveExpected(std::size_t passed, std::size_t asked, std::size_t remaining)
{
    if (asked == 0 || 4 * passed < 3 * asked)
        return;
    const std::size_t most = 7 * static_cast<std::size_t>(m_adapter.count());
    m_adapter.reserveMore(std::min(most, remaining * passed / asked + 1));
}

/// Adds or defers each pair of a list to an empty cache. @pre ascending, unique
void PairSync::addNew(const Pairs& pairs, float margin)
{
    const bool areFewBodies = PairCache::areFew(0, m_store.table().size());
    for (std::size_t i = 0; i < pairs.size(); ++i)
    {
        if (areFewBodies)
            m_adapter.prefetchSearch(pairs.data() + i, pairs.size() - i);
        else
            prefetchAddition(pairs.data() + i, pairs.size() - i, false);
        addUnfiltered(pairs[i], margin, true);
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
