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

/// Whether m_awakePairs holds all pairs that may change.
bool ColumnGridBackend::areAwakePairsValid() const
{
    return std::none_of(m_parts.begin(), m_parts.end(),
                        [](const NeighbourPart& part)
                        { return part.hasLeftSkin || !part.unlistedPairs.empty(); });
}

void ColumnGridBackend::updateAwake(const ProxyView& view)
{
    const auto count = static_cast<std::uint32_t>(m_awake.size());
    const bool isShared = m_workers.tasksFor(count, kQueryGrain) > 1;
    // Many boxes have become awake, or boxes have moved far since the last ordering.
    const bool isReordered = count > m_orderedCount + m_orderedCount / 8 || ++m_orderedAge > kOrderedUpdates;
    if (isReordered)
        orderAwake(view, isShared ? kPartsPerThread * m_workers.threads() : 1);
    const bool isNew = isReordered || !m_outsideSkin.empty();
    if (isNew)
        chooseAwakePairsSkin();
    CollectingSink sink(m_workers.threads());
    // Few awake boxes are scanned by one thread while others update the lists, many by all threads.
    const unsigned scans = isNew && isShared && m_awakeGrid.isForOneThread(count) ? 1 : 0;
    m_workers.run(scans + static_cast<unsigned>(m_parts.size()),
                  [&](unsigned task, unsigned worker)
                  {
                      if (task < scans)
                          scanAwake(view, sink);
                      else
                          updateLists(view, task - scans, worker);
                  });
    for (const NeighbourPart& part : m_parts)
        m_stats.candidates += part.pairs.size() - part.expiredCount;
    if (!isNew && areAwakePairsValid())
    {
        ++m_awakePairsAge;
        m_stats.candidates += m_awakePairs.size();
        updateChangeablePairs(view, m_awakePairs, 0);
        return;
    }
    if (!isNew)
        chooseAwakePairsSkin();
    if (scans == 0)
        scanAwake(view, sink);
    rebuildAwakePairs(view, sink);
}

/// Chooses the mean skin of the neighbour lists; none where the list would not last, since boxes become awake in
/// nearly every update or are fast.
void ColumnGridBackend::chooseAwakePairsSkin()
{
    if (m_awakePairsSkin > 0.0f)
        m_awakePairsWait = m_awakePairsAge < kWorthUpdates ? kWait : 0;
    else if (m_awakePairsWait != 0)
        --m_awakePairsWait;
    m_awakePairsSkin = 0;
    if (m_awakePairsWait == 0)
    {
        double sum = 0;
        for (const NeighbourList& list : m_lists)
            sum += std::max(list.skin, 0.0f);
        m_awakePairsSkin = static_cast<float>(sum / static_cast<double>(m_lists.size()));
    }
    m_awakePairsAge = 0;
}

/// Finds all pairs of awake boxes that can overlap while no awake box moves farther than m_awakePairsSkin, and the
/// pairs with unbounded boxes.
void ColumnGridBackend::scanAwake(const ProxyView& view, CollectingSink& sink)
{
    GridInput input;
    input.boxes = view.boxes;
    input.proxyRows = m_awake.data();
    input.count = static_cast<std::uint32_t>(m_awake.size());
    input.grow = kGrowFactor * m_awakePairsSkin;
    m_awakeGrid.scan(input, sink, ColumnUse::Once);
    findPairsWithUnbounded(view, sink);
}

void ColumnGridBackend::findPairsWithUnbounded(const ProxyView& view, CollectingSink& sink) const
{
    const float skin = kGrowFactor * std::max(m_awakePairsSkin, m_skin);
    for (const std::uint32_t large : m_grid.unbounded())
    {
        if (m_states[large] != RowState::Resting)
            continue;
        for (const std::uint32_t row : m_awake)
        {
            if (isValid(view.boxes[row]) && !areFarApart(view.boxes[row], view.boxes[large], skin))
                sink.add({row, large});
        }
    }
}

void ColumnGridBackend::rebuildAwakePairs(const ProxyView& view, const CollectingSink& sink)
{
    m_awakePairsBoxes.resize(m_awake.size());
    std::transform(m_awake.begin(), m_awake.end(), m_awakePairsBoxes.begin(),
                   [&](std::uint32_t row) { return view.boxes[row]; });
    std::vector<RowPair> held;
    m_awakePairs.forEachHeld([&](RowPair pair) { held.push_back(pair); });
    for (const NeighbourPart& part : m_parts)
        held.insert(held.end(), part.unlistedPairs.begin(), part.unlistedPairs.end());
    m_awakePairs.clear();
    classifyPairs(view, sink, held, m_awakePairs);
}
}  // namespace cullet
