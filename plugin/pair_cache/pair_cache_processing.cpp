// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Passes over all pairs, in the order of the array or of the ids.

#include "cullet/plugin/pair_cache/pair_cache_parts.h"

#include <new>
#include <utility>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
void PairCache::processAllOverlappingPairs(btOverlapCallback* callback, btDispatcher* dispatcher)
{
    Cursor cursor(*this, kNone);
    for (std::uint32_t index = 0; index < size();)
    {
        if (isDetached(index))
        {
            ++index;
            continue;
        }
        cursor.index = index;
        ++m_visited;
        const bool isDone = callback->processOverlap(*pairAt(index));
        if (isDone)
            removeForCallback(cursor, dispatcher);
        // If the pair was removed or moved, its entry holds another pair, which is visited next.
        if (cursor.index == index)
            ++index;
    }
}

/// Removes the pair for which a callback returned true, unless the callback has removed it itself.
void PairCache::removeForCallback(const Cursor& cursor, btDispatcher* dispatcher)
{
    if (cursor.index == kNone)
        return;
    const CallerChange change(*this);
    removeAt(cursor.index, dispatcher);
}

void PairCache::processAllOverlappingPairs(btOverlapCallback* callback, btDispatcher* dispatcher,
                                           const btDispatcherInfo& dispatchInfo)
{
    if (dispatchInfo.m_deterministicOverlappingPairs && order())
    {
        processOrdered(callback, dispatcher);
    }
    else
    {
        processAllOverlappingPairs(callback, dispatcher);
    }
}

/// Updates m_order; false if there is no memory for it.
bool PairCache::order()
{
    if (m_order.isOf(m_version))
        return true;
    try
    {
        m_order.reserve(static_cast<std::size_t>(m_pairs.capacity()));  // grows as rarely as the array
    }
    catch (const std::bad_alloc&)
    {
        return false;
    }
    for (std::uint32_t index = 0; index < size(); ++index)
    {
        if (!isDetached(index))
            m_order.add({idsOf(*pairAt(index)), index});
    }
    m_order.sort(m_version);
    return true;
}

void PairCache::processOrdered(btOverlapCallback* callback, btDispatcher* dispatcher)
{
    // Moved out of the member, so that a nested call sorts its own order.
    PairOrder sorted = std::exchange(m_order, PairOrder());
    Cursor cursor(*this, kNone);
    for (const PairOrder::Entry& entry : sorted.entries())
    {
        const bool isUnchanged = sorted.isOf(m_version) && m_detachedCount == 0;
        cursor.index = isUnchanged ? entry.index : indexOf(entry.ids);
        if (cursor.index == kNone)
            continue;
        ++m_visited;
        const bool isDone = callback->processOverlap(*pairAt(cursor.index));
        if (isDone)
            removeForCallback(cursor, dispatcher);
    }
    m_order = std::move(sorted);
}

void PairCache::sortOverlappingPairs(btDispatcher* /*dispatcher*/)
{
    if (m_cursors != nullptr || !order())
        return;
    std::vector<btBroadphasePair> sorted;
    try
    {
        sorted.reserve(size());
    }
    catch (const std::bad_alloc&)
    {
        return;
    }
    for (const PairOrder::Entry& entry : m_order.entries())
        sorted.push_back(*pairAt(entry.index));
    m_hash.clear();
    if (m_isLinked)
        m_links.clear();
    for (std::uint32_t index = 0; index < size(); ++index)
    {
        const Pair ids = idsOf(sorted[index]);
        *pairAt(index) = sorted[index];
        m_hash.insert(hashOfPair(ids), index);
        if (m_isLinked)
            m_links.append(m_links.anchorsOf(ids));  // both anchors exist
    }
    ++m_version;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
