// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Moving mode: chooses the motion bound, by which boxes are enlarged for the choice of their cells, and whether the
// motions of single boxes are stored.
#include "cullet/broad/grid/column_grid_backend.h"
#include "cullet/broad/grid/columns/motion_histogram.h"

#include <algorithm>

namespace cullet
{
namespace
{
// Nanoseconds of a 2023 server core, of which only the ratio matters.
constexpr double kCostOfListed = 16;  // a pair that is listed and looked up
constexpr double kCostOfEntry = 45;   // an entry of the grid
// Updates with little motion until the motion bound shrinks.
constexpr std::uint32_t kPatience = 32;
}  // namespace

/// Chooses the motion bound: a power of two that nearly all motions are below. Boxes are enlarged by it for the
/// choice of their cells, so that no pair that separates is missed. The pairs of boxes that move farther are found by
/// a list.
void ColumnGridBackend::chooseMotionBound(const GridMotion& motion, std::uint32_t rows)
{
    const std::uint32_t octave = std::max(kLeastBoundOctave, bestBoundOctave(motion, rows));
    const bool isEnough = octave <= m_boundOctave;
    m_calmUpdates = isEnough && octave + 2 < m_boundOctave ? m_calmUpdates + 1 : 0;
    if (isEnough && m_calmUpdates < kPatience)
        return;
    if (isBoundAllowed(octave))
        m_boundOctave = octave;
    m_calmUpdates = 0;
}

/// The lowest octave that few motions reach; or that none reaches, where more entries cost less than a list of all
/// pairs.
std::uint32_t ColumnGridBackend::bestBoundOctave(const GridMotion& motion, std::uint32_t rows) const
{
    const std::uint32_t few = octaveAbove(motion, rows / kFewTeleportedShare);
    const std::uint32_t all = octaveAbove(motion, 0);
    if (all == few || !isBoundAllowed(all))
        return few;
    const double more =
        (motionBoundOf(all) - motionBoundOf(std::max(few, kLeastBoundOctave))) / m_grid.finestWidth();
    const double listing = kCostOfListed * static_cast<double>(m_stats.pairs);
    return 4.0 * more * kCostOfEntry * static_cast<double>(m_grid.entryCount()) < listing ? all : few;
}

/// Room for the motions of all boxes; null where, by the last update, one bound for all boxes finds as few pairs.
float* ColumnGridBackend::prepareMotions(const ProxyView& view)
{
    if (!m_areMotionsUneven)
        return nullptr;
    m_motions.resize(view.size);
    if (view.dirtyCount != view.size)
        std::fill(m_motions.begin(), m_motions.end(), 0.0f);
    return m_motions.data();
}

/// Whether cells are wide enough for the motion bound of an octave.
bool ColumnGridBackend::isBoundAllowed(std::uint32_t octave) const
{
    return motionBoundOf(octave) < 0.125f * m_grid.finestWidth();
}
}  // namespace cullet
