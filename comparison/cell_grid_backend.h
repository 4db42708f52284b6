// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/cell_visitor.h"
#include "cullet/comparison/backends.h"
#include "cullet/comparison/candidate_pairs.h"
#include "cullet/comparison/cell_grid.h"
#include "cullet/comparison/comparison_stats.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// See makeCellGridBackend().
class CellGridBackend final : public Backend, public CellSource, public ComparisonSource
{
public:
    explicit CellGridBackend(const CellsOptions& options);

    Status update(const ProxyView& proxies, PairDelta& delta) override;
    void restart(const Pairs& known) override;
    const char* name() const noexcept override { return "cells"; }
    BackendStats stats() const override { return m_stats; }
    ComparisonStats comparisonStats() const override { return m_comparisonStats; }
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
    ComparisonStats m_comparisonStats;
};
}  // namespace cullet
