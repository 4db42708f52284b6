// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/pairs/candidate_pairs.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// The uniform grid of Le Grand 2007, "Broad-Phase Collision Detection with CUDA" (GPU Gems 3, chapter 32), on the CPU.
///
/// Cells are as large as the largest box, so that a box lies in at most eight: an array of 8 N cell ids, unused ones
/// 0xFFFFFFFF, is sorted, and its transitions begin the cells. Control bits beside the id of a box say on which axes it
/// begins in the cell; a pair is tested in the one cell in which, on each axis, one of the two begins. That takes the
/// place of the article's passes over cells that are no neighbours, which keep a pair from being handled twice.
///
/// For boxes of one size: the largest one decides for all, and a cell is one piece of work (BackendStats::mostTests).
/// Boxes without bounds are tested against all. One thread; every update starts afresh.
///
/// Cost: O(n log n + pairs of boxes that share a cell)
class LeGrandBackend final : public Backend
{
public:
    Status update(const ProxyView& proxies, PairDelta& delta) override;
    void restart(const Pairs& known) override;
    const char* name() const noexcept override { return "legrand"; }
    BackendStats stats() const override;

private:
    int chooseLevel(const ProxyView& proxies);
    void fillCells(const ProxyView& proxies, int level);
    void testCells(const ProxyView& proxies);
    void testCell(const ProxyView& proxies, std::size_t begin, std::size_t end);
    void testSideList(const ProxyView& proxies);

    CandidatePairs m_pairs;
    std::vector<std::uint32_t> m_rows;   ///< bounded boxes
    std::vector<std::uint32_t> m_side;   ///< unbounded ones
    std::vector<std::uint64_t> m_cells;  ///< [8 * rows] cell id << 32 | index in m_rows << 3 | control bits
    bool m_isFresh = true;
    float m_margin = 0.0f;  ///< of the last update
    BackendStats m_stats;
};
}  // namespace cullet
