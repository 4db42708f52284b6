// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/comparison/cell_grid.h"
#include "cullet/broad/pairs/candidate_pairs.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace cullet
{
/// The hierarchical grid of Lesson 04 (docs/references.md) as a backend, written for clarity more than for speed.
/// makeGridBackend() returns it for GridLayout::Cells.
///
/// Uses the options of its layout and bucketCount, cellScale (cells of cellScale times the largest box of the level, at
/// least 1/8; 0: 1, or 2 for GridPlacement::OnePoint; for GridPlacement::OneGrid cellScale, or 2, times the mean box,
/// chosen in each rebuild) and rebuildFraction; runs on one thread.
///
/// Cost: O(rows that changed and their neighbours, plus pairs held) or, when more than rebuildFraction of the rows
/// changed, O(rows and their neighbours).
std::unique_ptr<Backend> makeCellGridBackend(const GridOptions& options = {});

class CellGridBackend final : public Backend, public CellSource
{
public:
    explicit CellGridBackend(const GridOptions& options);

    Status update(const ProxyView& proxies, PairDelta& delta) override;
    void restart(const Pairs& known) override;
    const char* name() const noexcept override { return "cells"; }
    BackendStats stats() const override { return m_stats; }
    void forEachCell(const CellVisitor& visit) const override { m_grid.forEachCell(visit); }

private:
    bool wantsRebuild(const ProxyView& proxies) const;
    template <class Visit>
    void forEachPartner(std::uint32_t row, Visit visit) const;
    void searchUpwards(const ProxyView& proxies);
    void rebuild(const ProxyView& proxies);
    void updateChangedRows(const ProxyView& proxies);
    void fillStats();

    CellGrid m_grid;
    double m_b;  ///< of CellGridOptions
    bool m_countsPairs;
    bool m_hasOneGrid;
    bool m_searchesUpwards;  ///< in a rebuild
    double m_rebuildFraction;
    bool m_needsRebuild = true;  ///< the grid is invalid until the next rebuild
    float m_margin = 0.0f;       ///< of the last update
    CandidatePairs m_pairs;
    std::uint64_t m_touchedBefore = 0;  ///< counters of the grid at the end of the last update
    std::uint64_t m_visitedBefore = 0;
    BackendStats m_stats;
};
}  // namespace cullet
