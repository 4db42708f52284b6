// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Pairs that the filter refused and that are not listed: see DeferredPairs.
#include "cullet/broad/row_pair.h"
#include "cullet/plugin/core/proxy_ids.h"
#include "cullet/plugin/pair_sync/pair_sync.h"

#include <algorithm>

namespace cullet
{
inline namespace CULLET_PRECISION
{
void PairSync::markRefused()
{
    m_deferredPairs.markRows(
        [this](std::uint32_t id)
        {
            const Proxy* const proxy = m_store.find(id);
            return proxy != nullptr ? ProxyStore::rowOf(proxy) : kNoRow;
        });
}

/// Whether the cache lacks a pair of boxes that overlap, and nothing else will ask the filter in this update.
bool PairSync::isRefused(Pair pair, Proxy& first, Proxy& second) const
{
    return overlapsExactly(first, second) && !m_deferredPairs.contains(pair) &&
           !(m_adapter.count() != 0 && m_adapter.contains(first, second));
}

bool PairSync::passesFilterNow(Proxy& first, Proxy& second) const
{
    const btOverlapFilterCallback* const filter = m_adapter.filterCallback();
    if (filter == nullptr)
        return passesFilter(first.filter(), second.filter());
    // As PairCacheAdapter::add() does.
    return isLowerId(first, second) ? filter->needBroadphaseCollision(&first, &second)
                                    : filter->needBroadphaseCollision(&second, &first);
}

/// Asks the filter about the pairs of a proxy that are not in the cache, in the order of the other ids.
void PairSync::askAgainOf(Proxy& proxy, const QueryIndex& index, float margin)
{
    const std::uint32_t uniqueId = uniqueIdOf(&proxy);
    const std::uint32_t row = ProxyStore::rowOf(&proxy);
    m_deferredPairs.takeDue(row);
    // Among many partners of the last proxy a scan finds them in order, and is not much slower.
    const bool areMany = kManyPartnersShare * m_partners.size() > m_store.table().size();
    m_partners.clear();
    const auto collect = [&](std::uint32_t other)
    {
        // A partner that is due too asks for the pair in its turn.
        if (other != row && !m_deferredPairs.isDue(other))
            m_partners.push_back(m_store.table().uniqueId(other));
    };
    if (areMany)
        index.scanOverlap(m_store.table().box(row), collect);
    else
        index.forEachOverlap(m_store.table().box(row), collect);
    if (!std::is_sorted(m_partners.begin(), m_partners.end()))
        std::sort(m_partners.begin(), m_partners.end());
    for (const std::uint32_t id : m_partners)
    {
        Proxy* const other = m_store.find(id);
        // The filter is code of the application, and may have destroyed one of the proxies.
        if (other == nullptr || m_store.find(uniqueId) != &proxy)
            continue;
        const Pair pair = makePair(uniqueId, id);
        Proxy& first = pair.first == id ? *other : proxy;
        Proxy& second = pair.first == id ? proxy : *other;
        if (!isRefused(pair, first, second))
            continue;
        if (passesFilterNow(first, second))
            m_toReevaluate.push_back(pair);
        else if (m_store.find(pair.first) == &first && m_store.find(pair.second) == &second)
            defer(pair, first, second, true, margin);
    }
}

/// Re-evaluates the refused pairs that are not listed; those that may enter now join the listed ones.
void PairSync::askAgain(const QueryIndex& index, float margin)
{
    if (m_due.empty())
        return;
    for (const std::uint32_t id : m_due)
    {
        if (Proxy* const proxy = m_store.find(id))
            askAgainOf(*proxy, index, margin);
    }
    std::sort(m_toReevaluate.begin(), m_toReevaluate.end());
    // A pair whose box a callback has moved away, and may move back, was not asked about.
    if (m_store.table().hasChanges())
        m_wasInterrupted = true;
}

}  // namespace CULLET_PRECISION
}  // namespace cullet
