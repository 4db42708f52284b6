// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/comparison/candidate_pairs.h"
#include "cullet/comparison/comparison_stats.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// The uniform grid of Le Grand 2007, "Broad-Phase Collision Detection with CUDA" (GPU Gems 3, chapter 32), on the CPU.
///
/// Cells are as large as the largest box, so that a box lies in at most eight: an array of 8 N cell ids, unused ones
/// 0xFFFFFFFF, is sorted, and its transitions begin the cells. Control bits beside the id of a box store the axes on
/// which it begins in the cell; a pair is tested in the one cell in which, on each axis, one of the two boxes begins.
/// This replaces the article's passes over cells that are not neighbours, which prevent that a pair is handled twice.
///
/// For boxes of one size: the largest box sets the size of all cells, and a cell is one piece of work
/// (ComparisonStats::mostTests). Unbounded boxes are tested against all others. One thread; every update rebuilds the
/// cells.
///
/// Cost: O(n log n + pairs of boxes that share a cell)
class LeGrandBackend final : public Backend, public ComparisonSource
{
public:
    Status update(const ProxyView& proxies, PairDelta& delta) override;
    void restart(const Pairs& known) override;
    const char* name() const noexcept override { return "legrand"; }
    BackendStats stats() const override;
    ComparisonStats comparisonStats() const override { return m_comparisonStats; }

private:
    int chooseLevel(const ProxyView& proxies);
    void fillCells(const ProxyView& proxies, int level);
    void testCells(const ProxyView& proxies);
    void testCell(const ProxyView& proxies, std::size_t begin, std::size_t end);
    void testUnbounded(const ProxyView& proxies);

    CandidatePairs m_pairs;
    std::vector<std::uint32_t> m_rows;       ///< rows of bounded boxes
    std::vector<std::uint32_t> m_unbounded;  ///< rows of unbounded boxes
    std::vector<std::uint64_t> m_cells;  ///< [8 * rows] cell id << 32 | index in m_rows << 3 | control bits
    bool m_needsRebuild = true;
    float m_margin = 0.0f;  ///< of the last update
    BackendStats m_stats;
    ComparisonStats m_comparisonStats;
};
}  // namespace cullet
