// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Resting mode: pairs of awake boxes with each other, and with unbounded boxes, which are in no column.
#include "cullet/broad/grid/column_grid_backend.h"
#include "cullet/broad/grid/columns/pair_sinks.h"

#include <algorithm>

namespace cullet
{
namespace
{
constexpr std::size_t kQueryGrain = 1024;
constexpr unsigned kPartsPerThread = 4;
// Updates until awake boxes are ordered anew.
constexpr std::uint32_t kOrderedUpdates = 64;
// Updates that a list of awake pairs has to last to be worth its size, and updates without one after it did not.
constexpr std::uint32_t kWorthUpdates = 3;
constexpr std::uint32_t kWait = 16;
}  // namespace

/// Whether m_between holds all pairs that may change.
bool ColumnGridBackend::isBetweenValid() const
{
    return std::none_of(m_parts.begin(), m_parts.end(),
                        [](const NeighbourPart& part) { return part.hasStray || !part.strangers.empty(); });
}

void ColumnGridBackend::updateActive(const ProxyView& view)
{
    const auto count = static_cast<std::uint32_t>(m_active.size());
    const bool isShared = m_workers.tasksFor(count, kQueryGrain) > 1;
    // Many boxes have become awake, or boxes have moved far since the last ordering.
    const bool isReordered = count > m_orderedCount + m_orderedCount / 8 || ++m_orderedAge > kOrderedUpdates;
    if (isReordered)
        orderActive(view, isShared ? kPartsPerThread * m_workers.threads() : 1);
    const bool isNew = isReordered || !m_escaped.empty();
    if (isNew)
        chooseBetweenReach();
    CollectingSink sink(m_workers.threads());
    // Few awake boxes are scanned by one thread while others update the lists, many by all threads.
    const unsigned scans = isNew && isShared && m_activeGrid.isForOneThread(count) ? 1 : 0;
    m_workers.run(scans + static_cast<unsigned>(m_parts.size()),
                  [&](unsigned task, unsigned worker)
                  {
                      if (task < scans)
                          scanBetween(view, sink);
                      else
                          updateLists(view, task - scans, worker);
                  });
    for (const NeighbourPart& part : m_parts)
        m_stats.candidates += part.pairs.size() - part.goneCount;
    if (!isNew && isBetweenValid())
    {
        ++m_betweenAge;
        m_stats.candidates += m_between.size();
        updateAllWatched(view, m_between, 0);
        return;
    }
    if (!isNew)
        chooseBetweenReach();
    if (scans == 0)
        scanBetween(view, sink);
    rebuildBetween(view, sink);
}

/// Chooses the mean skin of the neighbour lists; none where the list would not last, since boxes become awake in
/// nearly every update or are fast.
void ColumnGridBackend::chooseBetweenReach()
{
    if (m_betweenReach > 0.0f)
        m_betweenWait = m_betweenAge < kWorthUpdates ? kWait : 0;
    else if (m_betweenWait != 0)
        --m_betweenWait;
    m_betweenReach = 0;
    if (m_betweenWait == 0)
    {
        double sum = 0;
        for (const NeighbourList& list : m_lists)
            sum += std::max(list.reach, 0.0f);
        m_betweenReach = static_cast<float>(sum / static_cast<double>(m_lists.size()));
    }
    m_betweenAge = 0;
}

/// Finds all pairs of awake boxes that can overlap while no awake box moves farther than m_betweenReach, and the
/// pairs with unbounded boxes.
void ColumnGridBackend::scanBetween(const ProxyView& view, CollectingSink& sink)
{
    GridInput input;
    input.boxes = view.boxes;
    input.ids = m_active.data();
    input.count = static_cast<std::uint32_t>(m_active.size());
    input.grow = kGrowFactor * m_betweenReach;
    m_activeGrid.scan(input, sink, RowUse::Once);
    findPairsWithUnbounded(view, sink);
}

void ColumnGridBackend::findPairsWithUnbounded(const ProxyView& view, CollectingSink& sink) const
{
    const float reach = kGrowFactor * std::max(m_betweenReach, m_slack);
    for (const std::uint32_t large : m_grid.unbounded())
    {
        if (m_states[large] != RowState::Settled)
            continue;
        for (const std::uint32_t row : m_active)
        {
            if (isValid(view.boxes[row]) && !areFarApart(view.boxes[row], view.boxes[large], reach))
                sink.add({row, large});
        }
    }
}

void ColumnGridBackend::rebuildBetween(const ProxyView& view, const CollectingSink& sink)
{
    m_betweenBoxes.resize(m_active.size());
    std::transform(m_active.begin(), m_active.end(), m_betweenBoxes.begin(),
                   [&](std::uint32_t row) { return view.boxes[row]; });
    std::vector<RowPair> held;
    m_between.forEachHeld([&](RowPair pair) { held.push_back(pair); });
    for (const NeighbourPart& part : m_parts)
        held.insert(held.end(), part.strangers.begin(), part.strangers.end());
    m_between.clear();
    watch(view, sink, held, m_between);
}
}  // namespace cullet
