// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/comparison/cell_grid_backend.h"

#include <algorithm>
#include <new>

namespace cullet
{
namespace
{
// The fraction at which rebuild and update cost the same depends on the sizes: near 1 for equal boxes, near 0.35 for
// sizes over three decades.
constexpr double kAutomaticRebuildFraction = 0.5;
constexpr float kSmallestCellScale = 0.125f;  // cells of an eighth of the box: up to 9^3 of them for a box

CellGridOptions cellGridOptions(const CellsOptions& options)
{
    CellGridOptions result;
    result.bucketCount = options.bucketCount;
    result.storage = options.storage;
    result.placement = options.placement;
    result.updatesByRemoveAndAdd = options.updatesByRemoveAndAdd;
    result.countsPairs = options.countsPairs && options.placement == GridPlacement::AllCoarser;
    // Boxes of up to half a cell, stored in one: partners lie in at most 2 x 2 x 2 cells of their own level. In one
    // grid for all sizes many boxes are larger than the mean.
    const bool isWide =
        options.placement == GridPlacement::OnePoint || options.placement == GridPlacement::OneGrid;
    const float automatic = isWide ? 2.0f : 1.0f;
    const float scale = options.cellScale > 0 ? std::max(options.cellScale, kSmallestCellScale) : automatic;
    result.b = 1.0 / static_cast<double>(scale);
    result.a = result.b / 2;
    return result;
}
}  // namespace

CellGridBackend::CellGridBackend(const CellsOptions& options)
    : m_grid(cellGridOptions(options)),
      m_b(cellGridOptions(options).b),
      m_countsPairs(cellGridOptions(options).countsPairs),
      m_hasOneGrid(options.placement == GridPlacement::OneGrid),
      m_searchesUpwards(options.placement == GridPlacement::OwnLevel ||
                        options.placement == GridPlacement::OnePoint),
      m_rebuildFraction(options.rebuildFraction < 0 ? kAutomaticRebuildFraction : options.rebuildFraction)
{
}

void CellGridBackend::restart(const Pairs& known)
{
    m_pairs.restart(known);
    m_needsRebuild = true;
}

bool CellGridBackend::wantsRebuild(const ProxyView& proxies) const
{
    return m_needsRebuild || m_rebuildFraction == 0.0 ||
           proxies.dirtyCount > m_rebuildFraction * proxies.size;
}

/// Calls visit(other) for the partners of a row that are not among the counted pairs.
template <class Visit>
void CellGridBackend::forEachPartner(std::uint32_t row, Visit visit) const
{
    if (m_countsPairs)
        m_grid.forEachUnboundedPartner(row, visit);
    else
        m_grid.forEachNeighbour(row, visit);
}

/// Pairs each box with the boxes of its own level and of coarser levels: where boxes are stored at one level only, a
/// large box would have to search very many small cells.
void CellGridBackend::searchUpwards(const ProxyView& proxies)
{
    for (std::uint32_t row = 0; row < proxies.size; ++row)
    {
        const int level = m_grid.level(row);
        if (level == CellGrid::kAbsent)
            continue;
        m_grid.forEachNeighbourAbove(row,
                                     [&](std::uint32_t other)
                                     {
                                         const int otherLevel = m_grid.level(other);
                                         if (otherLevel > level || (otherLevel == level && other < row))
                                             m_pairs.test(proxies, row, other);
                                     });
    }
}

void CellGridBackend::rebuild(const ProxyView& proxies)
{
    m_grid.clear();
    if (m_hasOneGrid)
        m_grid.setCommonLevel(levelOfMeanBox(proxies.boxes, proxies.size, m_b));
    for (std::uint32_t row = 0; row < proxies.size; ++row)
    {
        if (!isValid(proxies.boxes[row]))
            continue;
        m_grid.addBox(row, proxies.boxes[row]);
        // Each box is paired with the boxes that were added before it.
        if (!m_searchesUpwards)
            forEachPartner(row, [&](std::uint32_t other) { m_pairs.test(proxies, row, other); });
    }
    if (m_searchesUpwards)
        searchUpwards(proxies);
    if (m_countsPairs)
        m_grid.forEachCounted([&](std::uint32_t a, std::uint32_t b) { m_pairs.test(proxies, a, b); });
    m_needsRebuild = false;
    ++m_stats.rebuildsTotal;
}

void CellGridBackend::updateChangedRows(const ProxyView& proxies)
{
    for (std::uint32_t i = 0; i < proxies.dirtyCount; ++i)
    {
        const std::uint32_t row = proxies.dirty[i];
        const bool isStored = m_grid.level(row) != CellGrid::kAbsent;
        if (!isValid(proxies.boxes[row]))
        {
            if (isStored)
                m_grid.removeBox(row);
        }
        else if (isStored)
        {
            m_grid.updateBox(row, proxies.boxes[row]);
        }
        else
        {
            m_grid.addBox(row, proxies.boxes[row]);
        }
    }
    for (std::uint32_t i = 0; i < proxies.dirtyCount; ++i)
    {
        const std::uint32_t row = proxies.dirty[i];
        if (m_grid.level(row) == CellGrid::kAbsent)
            continue;
        // A pair of two changed rows is found twice: the search from the lower row tests it.
        forEachPartner(row,
                       [&](std::uint32_t other)
                       {
                           if (row < other || proxies.changes[other] == kRowUnchanged)
                               m_pairs.test(proxies, row, other);
                       });
    }
    if (m_countsPairs)
        m_grid.forEachCounted(
            [&](std::uint32_t a, std::uint32_t b)
            {
                if ((proxies.changes[a] | proxies.changes[b]) != kRowUnchanged)
                    m_pairs.test(proxies, a, b);
            });
}

void CellGridBackend::fillStats()
{
    const CellGrid::Counters counters = m_grid.counters();
    m_stats.pairs = m_pairs.size();
    m_stats.candidates = m_pairs.testCount();
    m_stats.entries = counters.ids;
    m_stats.levels = counters.levels;
    m_stats.unbounded = counters.unbounded;
    m_comparisonStats.cellsTouched = counters.touchedTotal - m_touchedBefore;
    m_stats.cellsVisited = counters.visitedTotal - m_visitedBefore;
    m_touchedBefore = counters.touchedTotal;
    m_visitedBefore = counters.visitedTotal;
    m_stats.bytes = m_grid.bytes() + m_pairs.bytes();
}

Status CellGridBackend::update(const ProxyView& proxies, PairDelta& delta)
try
{
    m_stats.candidates = m_stats.cellsVisited = 0;
    m_comparisonStats.cellsTouched = 0;
    m_pairs.begin(proxies);
    delta.clear();
    const bool isMarginNew = proxies.margin != m_margin;
    m_margin = proxies.margin;
    if (wantsRebuild(proxies))
    {
        m_stats.path = "rebuild";
        rebuild(proxies);
    }
    else if (proxies.dirtyCount == 0 && !isMarginNew)
    {
        m_stats.path = "idle";
        return Status::Ok;
    }
    else
    {
        m_stats.path = "incremental";
        updateChangedRows(proxies);
    }
    m_grid.dropUnusedLevels();
    m_pairs.finish(proxies, delta);
    fillStats();
    return Status::Ok;
}
catch (const std::bad_alloc&)
{
    delta.clear();
    return Status::OutOfMemory;
}

std::unique_ptr<Backend> makeCellGridBackend(const CellsOptions& options)
{
    return std::make_unique<CellGridBackend>(options);
}
}  // namespace cullet
