// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Settled mode: boxes that left their shells, among themselves and with those that rest.
#include "broad/row_grid_backend.h"
#include "broad/row_grid_sinks.h"

#include <algorithm>

namespace cullet
{
namespace
{
constexpr std::size_t kQueryGrain = 1024;
constexpr unsigned kPartsPerThread = 4;
// Boxes that are on their way from memory.
constexpr std::uint32_t kPrefetch = 32;
// Pairs that are looked at to find out which one of two lists lacks.
constexpr std::size_t kLookAhead = 4;
// Updates until active boxes are ordered anew.
constexpr std::uint32_t kOrderedUpdates = 64;
}  // namespace

/// Collects the pairs of an active box and a settled one: the grid knows the settled ones by their shells.
class RowGridBackend::SettledSink final : public PairSink
{
public:
    SettledSink(const RowGridBackend& backend, const ProxyView& view, std::vector<IdPair>& pairs)
        : m_backend(backend), m_view(view), m_pairs(pairs)
    {
    }

    void take(unsigned /*worker*/, const PairBuffer& found) override
    {
        for (std::uint32_t i = 0; i < found.count; ++i)
        {
            prefetchBox(m_view.boxes + found.pair(std::min(i + kPrefetch, found.count - 1)).b);
            const IdPair pair = found.pair(i);
            if (m_backend.m_states[pair.b] == RowState::Settled &&
                overlaps(m_view.boxes[pair.a], m_view.boxes[pair.b]))
                m_pairs.push_back(pair);
        }
    }

private:
    const RowGridBackend& m_backend;
    const ProxyView& m_view;
    std::vector<IdPair>& m_pairs;
};

/// Part `part` of `parts` equal ones of the active boxes.
void RowGridBackend::findPairsWithSettled(const ProxyView& view, unsigned part, unsigned parts,
                                          unsigned worker)
{
    const TaskRange range(m_active.size(), part, parts);
    m_partPairs[part].clear();
    SettledSink sink(*this, view, m_partPairs[part]);
    m_grid.query(view.boxes, m_active.data() + range.begin, range.end - range.begin, worker, sink);
}

void RowGridBackend::findPairsWithUnbounded(const ProxyView& view, std::vector<IdPair>& found) const
{
    for (const std::uint32_t large : m_grid.unbounded())
    {
        if (m_states[large] != RowState::Settled)
            continue;
        for (const std::uint32_t row : m_active)
        {
            if (isValid(view.boxes[row]) && overlaps(view.boxes[row], view.boxes[large]))
                found.push_back({row, large});
        }
    }
}

/// Pairs with settled boxes come first and by parts of the active ones, not by thread, so that they come in the same order in
/// every update.
void RowGridBackend::findActivePairs(const ProxyView& view, std::vector<IdPair>& found)
{
    CollectingSink sink(m_workers.threads());
    GridInput input;
    input.boxes = view.boxes;
    input.ids = m_active.data();
    input.count = static_cast<std::uint32_t>(m_active.size());
    const bool isShared = m_workers.tasksFor(m_active.size(), kQueryGrain) > 1;
    const unsigned parts = isShared ? kPartsPerThread * m_workers.threads() : 1;
    m_partPairs.resize(parts);
    // Few boxes among themselves are work for one thread, beside the parts; many for all threads.
    const unsigned scans = m_activeGrid.isForOneThread(input.count) ? 1 : 0;
    if (scans == 0)
        m_activeGrid.scan(input, sink, RowUse::Once);
    m_workers.run(isShared ? parts + scans : 1,
                  [&](unsigned task, unsigned worker)
                  {
                      if (scans != 0 && task == 0)
                          m_activeGrid.scan(input, sink, RowUse::Once);
                      if (!isShared || task >= scans)
                          findPairsWithSettled(view, isShared ? task - scans : 0, parts, worker);
                  });
    for (const std::vector<IdPair>& pairs : m_partPairs)
        found.insert(found.end(), pairs.begin(), pairs.end());
    findPairsWithUnbounded(view, found);
    sink.forEach([&](IdPair pair) { found.push_back(pair); });
}

void RowGridBackend::updateActive(const ProxyView& view)
{
    // Other boxes than before, or boxes that came far since.
    if (m_active.size() > m_orderedCount + m_orderedCount / 8 || ++m_orderedAge > kOrderedUpdates)
    {
        m_grid.sortAlongRows(view.boxes, m_active);
        m_orderedCount = m_active.size();
        m_orderedAge = 0;
    }
    m_foundPairs.clear();
    findActivePairs(view, m_foundPairs);
    matchActivePairs();
    sortOldPairs(m_unmatched);
    takeUnmatchedFound(view);
    takeUnmatchedOld(view);
    m_activePairs.swap(m_foundPairs);
}

/// Goes along the pairs of before and of now, which hardly differ and are in the same order mostly, and collects those without
/// a partner. Some may be in both collections: m_oldPairs tells these.
void RowGridBackend::matchActivePairs()
{
    m_unmatched.clear();
    m_unmatchedFound.clear();
    std::size_t old = 0;
    std::size_t found = 0;
    const auto isEqual = [&](std::size_t a, std::size_t b)
    {
        return a < m_activePairs.size() && b < m_foundPairs.size() &&
               m_activePairs[a].a == m_foundPairs[b].a && m_activePairs[a].b == m_foundPairs[b].b;
    };
    while (old < m_activePairs.size() && found < m_foundPairs.size())
    {
        if (isEqual(old, found))
        {
            ++old;
            ++found;
            continue;
        }
        std::size_t skip = 0;
        while (skip < kLookAhead && !isEqual(old + skip, found) && !isEqual(old, found + skip))
            ++skip;
        // A pair or some are on one side only, or all that was looked at differs.
        const bool isLost = skip == kLookAhead;
        const std::size_t oldEnd =
            isLost || isEqual(old + skip, found) ? std::min(old + skip, m_activePairs.size()) : old;
        const std::size_t foundEnd =
            isLost || oldEnd == old ? std::min(found + skip, m_foundPairs.size()) : found;
        for (; old < oldEnd; ++old)
            m_unmatched.push_back(m_activePairs[old]);
        for (; found < foundEnd; ++found)
            m_unmatchedFound.push_back(static_cast<std::uint32_t>(found));
        old += isLost ? 0u : 1u;
        found += isLost ? 0u : 1u;
    }
    for (; old < m_activePairs.size(); ++old)
        m_unmatched.push_back(m_activePairs[old]);
    for (; found < m_foundPairs.size(); ++found)
        m_unmatchedFound.push_back(static_cast<std::uint32_t>(found));
}

/// Found pairs without a partner: new, unless they are among the old ones.
void RowGridBackend::takeUnmatchedFound(const ProxyView& view)
{
    constexpr IdPair kRejected = {~0u, ~0u};
    bool hasRejected = false;
    for (const std::uint32_t index : m_unmatchedFound)
    {
        const IdPair pair = m_foundPairs[index];
        if (m_oldPairs.erase(PairSet::keyOf(pair.a, pair.b)))
            continue;
        if (mayEnter(view, pair))
        {
            reportAdded(view, pair);
            continue;
        }
        m_foundPairs[index] = kRejected;
        hasRejected = true;
    }
    if (!hasRejected)
        return;
    const auto end = std::remove_if(m_foundPairs.begin(), m_foundPairs.end(),
                                    [&](IdPair pair) { return pair.a == kRejected.a; });
    m_foundPairs.erase(end, m_foundPairs.end());
}

/// Old pairs that do not overlap any more: they stay while the margin allows it.
void RowGridBackend::takeUnmatchedOld(const ProxyView& view)
{
    for (std::size_t i = 0; i < m_unmatched.size(); ++i)
    {
        const IdPair ahead = m_unmatched[std::min(i + kPrefetch, m_unmatched.size() - 1)];
        prefetchBox(view.boxes + ahead.a);
        prefetchBox(view.boxes + ahead.b);
        const IdPair pair = m_unmatched[i];
        if (!m_oldPairs.contains(PairSet::keyOf(pair.a, pair.b)))
            continue;
        const bool valid = isValid(view.boxes[pair.a]) && isValid(view.boxes[pair.b]);
        if (valid && overlapsWithMargin(view.boxes[pair.a], view.boxes[pair.b], view.margin))
            m_foundPairs.push_back(pair);
        else
            reportRemoved(view, pair);
    }
}
}  // namespace cullet
