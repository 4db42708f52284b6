// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Pairs that the filter refused and that are not listed: see DeferredPairs and AllowedPairs.
#include "cullet/broad/row_pair.h"
#include "cullet/plugin/core/proxy_ids.h"
#include "cullet/plugin/pair_sync/grown_box.h"
#include "cullet/plugin/pair_sync/pair_sync.h"

#include <algorithm>
#include <new>
#include <utility>

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

bool PairSync::areNearInTable(const Proxy& first, const Proxy& second, float margin) const
{
    const ProxyTable& table = m_store.table();
    return haveValidBoxes(first, second) && overlapsWithMargin(table.box(ProxyStore::rowOf(&first)),
                                                               table.box(ProxyStore::rowOf(&second)), margin);
}

/// Asks the filter about a pair, unless the cache has it, or it is listed and asked about elsewhere in this update.
///
/// The backend may hold a pair of boxes within the margin, since they may have overlapped: it does not report them when
/// they overlap again.
void PairSync::askAgainAbout(Pair pair, Proxy& first, Proxy& second, float margin)
{
    const bool exactBoxesOverlap = overlapNow(first, second);
    if (!(exactBoxesOverlap || areNearInTable(first, second, margin)) || m_deferredPairs.contains(pair) ||
        (m_adapter.count() != 0 && m_adapter.contains(first, second)))
        return;
    const bool isAllowed = passesFilterNow(first, second);
    if (m_store.find(pair.first) != &first || m_store.find(pair.second) != &second)
        return;
    if (isAllowed && exactBoxesOverlap)
        m_toReevaluate.push_back(pair);
    else if (isAllowed)
        deferNear(pair, first, second, margin);
    else if (exactBoxesOverlap)
        defer(pair, first, second, true, margin);
    else
        m_deferredPairs.mark(pair, ProxyStore::rowOf(&first), ProxyStore::rowOf(&second),
                             m_store.table().boxes(), margin);
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

/// Asks the filter about the pairs of a proxy that are near it and not in the cache, in the order of the other ids.
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
    const Aabb nearBox = grownToNear(m_store.table().box(row), margin);
    if (areMany)
        index.scanOverlap(nearBox, collect);
    else
        index.forEachOverlap(nearBox, collect);
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
        askAgainAbout(pair, first, second, margin);
    }
}

/// Re-evaluates the refused pairs that are not listed; those that may enter now join the listed ones.
void PairSync::askAgain(const QueryIndex& index, float margin)
{
    if (m_due.empty())
        return;
    for (const std::uint32_t id : m_due)
    {
        Proxy* const proxy = m_store.find(id);
        if (proxy == nullptr)
            continue;
        if (m_allowedPairs != nullptr)
            askAllowedOf(*proxy, false);
        else
            askAgainOf(*proxy, index, margin);
    }
    std::sort(m_toReevaluate.begin(), m_toReevaluate.end());
    // A pair whose box a callback has moved away, and may move back, was not asked about.
    if (m_store.table().hasChanges() && m_allowedPairs == nullptr)
        m_state.restart();
}

bool PairSync::updateAllowedPairs(const ProxyView& view)
{
    try
    {
        m_allowedPairs->update(view, m_delta, m_due);
        return true;
    }
    catch (const std::bad_alloc&)
    {
        m_due.clear();
        return false;
    }
}

bool PairSync::mayBeginAllowedPairs() const
{
    const auto allowed = static_cast<std::uint64_t>(m_adapter.count());
    return m_deferredPairs.hasMarkedRows() &&
           AllowedPairs::isCrowd(m_refusedNow, allowed, m_store.table().size()) && m_filter != nullptr &&
           m_adapter.filterCallback() == m_filter && !m_state.isInterrupted() &&
           !m_store.table().hasChanges();
}

/// Lets AllowedPairs take the backend's place, with the pairs that the backend holds. The boxes are those of the update.
void PairSync::beginAllowedPairs(float margin)
{
    const ProxyTable& table = m_store.table();
    ProxyView view;
    view.size = table.size();
    view.boxes = table.boxes();
    view.margin = margin;
    auto allowed = std::make_unique<AllowedPairs>(view, m_options.grid.baselineSimd);
    const btBroadphasePairArray& cached = m_adapter.cache()->getOverlappingPairArray();
    for (int i = 0; i < cached.size(); ++i)
    {
        if (m_store.owns(cached[i].m_pProxy0) && m_store.owns(cached[i].m_pProxy1))
            allowed->addHeld(ProxyStore::rowOf(static_cast<const Proxy*>(cached[i].m_pProxy0)),
                             ProxyStore::rowOf(static_cast<const Proxy*>(cached[i].m_pProxy1)));
    }
    // The listed pairs are those of separated boxes. Where the rounded ones overlap, they go on to be tested by their
    // exact boxes; the filter is asked about the others, below.
    m_scratch = m_deferredPairs.pairs();
    for (const Pair pair : m_scratch)
    {
        const Proxy& first = *m_store.find(pair.first);
        const Proxy& second = *m_store.find(pair.second);
        if (overlapInTable(first, second))
            allowed->addHeld(ProxyStore::rowOf(&first), ProxyStore::rowOf(&second));
        else
            m_deferredPairs.erase(pair);
    }
    m_backend->restart({});
    m_allowedPairs = std::move(allowed);
    m_deferredPairs.followRestart();
    m_speculativePairs.clear();
    m_due.clear();
    m_store.forEach([this](const Proxy* proxy, std::uint32_t) { m_due.push_back(uniqueIdOf(proxy)); });
    for (const std::uint32_t id : m_due)
    {
        if (Proxy* const proxy = m_store.find(id))
            askAllowedOf(*proxy, true);
    }
}

bool PairSync::overlapInTable(const Proxy& first, const Proxy& second) const
{
    const ProxyTable& table = m_store.table();
    return haveValidBoxes(first, second) &&
           overlaps(table.box(ProxyStore::rowOf(&first)), table.box(ProxyStore::rowOf(&second)));
}

/// Asks the filter about the pairs of a proxy that is due and that are not listed, in the order of the other ids.
///
/// @param isFirst the backend has just reported the pairs of boxes that overlap: those that are not listed are refused
void PairSync::askAllowedOf(Proxy& proxy, bool isFirst)
{
    const std::uint32_t uniqueId = uniqueIdOf(&proxy);
    const std::uint32_t row = ProxyStore::rowOf(&proxy);
    m_allowedPairs->takePartners(row, m_partners);
    for (std::uint32_t& partner : m_partners)
        partner = m_store.table().uniqueId(partner);
    if (!std::is_sorted(m_partners.begin(), m_partners.end()))
        std::sort(m_partners.begin(), m_partners.end());
    std::uint32_t refused = 0;
    for (const std::uint32_t id : m_partners)
    {
        // The filter is code of the application, and may have destroyed one of the proxies.
        Proxy* const other = m_store.find(id);
        if (other == nullptr || m_store.find(uniqueId) != &proxy)
            continue;
        Proxy& first = id < uniqueId ? *other : proxy;
        Proxy& second = id < uniqueId ? proxy : *other;
        if ((isFirst && overlapInTable(first, second)) || !passesFilterNow(first, second))
        {
            ++refused;
            continue;
        }
        if (m_store.find(id) != other || m_store.find(uniqueId) != &proxy)
            continue;
        // A box that the filter has moved just now is one of the next update.
        const bool isHeld = !isFirst && overlapInTable(first, second);
        m_allowedPairs->insert(row, ProxyStore::rowOf(other), isHeld);
        if (isHeld)
            m_toReevaluate.push_back(makePair(uniqueId, id));
    }
    if (m_store.find(uniqueId) == &proxy)
        m_allowedPairs->setRefused(row, refused);
}

}  // namespace CULLET_PRECISION
}  // namespace cullet
