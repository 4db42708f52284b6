// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/sweep/motion_bound.h"

#include "cullet/base/bytes_of.h"
#include "cullet/broad/grid/columns/grid_plan.h"

#include <algorithm>

namespace cullet
{
namespace
{
// Gaps and motions are rounded differences; the factors cover the roundings many times over. A pair that overlapped
// before its boxes moved by d each has a gap of at most 2 d, and shares a cell when both boxes are enlarged by d.
constexpr float kGapFactor = 2.0625f;
constexpr float kCellSkinFactor = 1.0625f;
// Mean motion as a share of the largest, below which each box has a motion bound of its own.
constexpr double kUneven = 0.375;
// Nanoseconds of a 2023 server core, of which only the ratio matters.
constexpr double kCostOfListed = 16;  // a pair that is listed and looked up
constexpr double kCostOfEntry = 45;   // an entry of the grid
// Updates with little motion until the motion bound shrinks.
constexpr std::uint32_t kPatience = 32;
}  // namespace

void MotionBound::compare(const ProxyView& view)
{
    m_comparedOctave = m_octave;
    m_core.grid.compare(view.boxes, m_core.reference.data(), view.dirty, view.dirtyCount,
                        motionBoundOf(m_octave), m_motion, prepareMotions(view));
    choose(view.size);
}

bool MotionBound::areTeleporting(const ProxyView& view, const std::vector<std::uint32_t>& sample,
                                 std::uint32_t most)
{
    const auto count = static_cast<std::uint32_t>(sample.size());
    m_core.grid.compare(view.boxes, m_core.reference.data(), sample.data(), count, motionBoundOf(m_octave),
                        m_motion);
    // Where a motion bound can cover the motions, comparing all boxes is worth its cost.
    if (isAllowed(octaveAbove(m_motion, count / kFewTeleportedShare)))
        return false;
    return teleportedCount() > most;
}

void MotionBound::choose(std::uint32_t rows)
{
    // The grid may have other cells than those that the bound was chosen for.
    while (m_octave > kLeastOctave && !isAllowed(m_octave))
        --m_octave;
    const std::uint32_t octave = std::max(kLeastOctave, bestOctave(rows));
    const bool isEnough = octave <= m_octave;
    m_calmUpdates = isEnough && octave + 2 < m_octave ? m_calmUpdates + 1 : 0;
    if (isEnough && m_calmUpdates < kPatience)
        return;
    if (isAllowed(octave))
        m_octave = octave;
    m_calmUpdates = 0;
}

/// The lowest octave that few motions reach; or that none reaches, where more entries cost less than a list of all
/// pairs.
std::uint32_t MotionBound::bestOctave(std::uint32_t rows) const
{
    const std::uint32_t few = octaveAbove(m_motion, rows / kFewTeleportedShare);
    const std::uint32_t all = octaveAbove(m_motion, 0);
    if (all == few || !isAllowed(all))
        return few;
    const double more =
        (motionBoundOf(all) - motionBoundOf(std::max(few, kLeastOctave))) / m_core.grid.narrowestWidth();
    const double listing = kCostOfListed * static_cast<double>(m_core.stats.pairs);
    return 4.0 * more * kCostOfEntry * static_cast<double>(m_core.grid.entryCount()) < listing ? all : few;
}

/// Whether cells are wide enough for the bound of an octave.
bool MotionBound::isAllowed(std::uint32_t octave) const
{
    return kSkinsPerCell * motionBoundOf(octave) < m_core.grid.narrowestWidth();
}

/// Room for the motions of all boxes; null where, by the last update, one bound for all boxes finds as few pairs.
float* MotionBound::prepareMotions(const ProxyView& view)
{
    if (!m_areUneven)
        return nullptr;
    m_motions.resize(view.size);
    if (view.dirtyCount != view.size)
        std::fill(m_motions.begin(), m_motions.end(), 0.0f);
    return m_motions.data();
}

void MotionBound::setCellSkin(GridInput& input) const
{
    input.cellSkin = kCellSkinFactor * motionBoundOf(m_octave);
}

void MotionBound::setGaps(GridInput& input) const
{
    // The boxes may have been compared with a smaller bound than the one chosen now.
    const bool isSame = m_comparedOctave == m_octave;
    input.maxGap = kGapFactor * (isSame ? m_motion.largest : motionBoundOf(m_octave));
    input.minGap = -input.maxGap;
    input.motions = m_areUneven ? m_motions.data() : nullptr;
    input.motionFactor = 0.5f * kGapFactor;
}

void MotionBound::finish(std::uint32_t rows, bool isListing)
{
    m_areUneven = !isListing && evenness(m_motion, rows) < kUneven;
}

void MotionBound::forget()
{
    m_areUneven = false;
    m_octave = kLeastOctave;
    m_calmUpdates = 0;
}

std::uint64_t MotionBound::bytes() const
{
    return bytesOf(m_motion.migrated, m_motions);
}
}  // namespace cullet
