// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/grid/columns/motion_histogram.h"
#include "cullet/broad/grid/update/grid_core.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// Measures how far boxes move from update to update, and chooses the motion bound: a power of two that nearly all
/// motions are below. Boxes are enlarged by it for the choice of their cells, so that no pair that separates is missed.
/// The pairs of boxes that move farther, the *teleported* ones, are found by a list.
class MotionBound
{
public:
    explicit MotionBound(GridCore& core) : m_core(core) {}

    /// Measures how far the changed boxes moved, and chooses the next bound.
    void compare(const ProxyView& view);

    /// Measures some changed rows. Whether so many boxes in such a sample moved beyond the bound, and no bound that
    /// cells allow covers them.
    ///
    /// @param most teleported rows that are not too many
    bool areTeleporting(const ProxyView& view, const std::vector<std::uint32_t>& sample, std::uint32_t most);

    /// Boxes of the last comparison that moved beyond the bound.
    std::uint32_t teleportedCount() const { return countFrom(m_motion, m_octave); }
    /// Rows of the last comparison that are in other cells than before, ascending; and teleported ones.
    const std::vector<std::uint32_t>& migrated() const { return m_motion.migrated; }

    /// Enlarges boxes for the choice of their cells.
    void setCellSkin(GridInput& input) const;
    /// Limits the pairs of a scan to those that may have changed.
    void setGaps(GridInput& input) const;

    /// Ends an update. @param isListing whether all pairs were listed, since boxes teleported
    void finish(std::uint32_t rows, bool isListing);

    /// To be called after restart(), when the rows may be others.
    void forget();

    std::uint64_t bytes() const;

private:
    /// Octave of the smallest bound: 2^-63, so that its multiples are no denormals, which are slow.
    static constexpr std::uint32_t kLeastOctave = 64;

    void choose(std::uint32_t rows);
    std::uint32_t bestOctave(std::uint32_t rows) const;
    bool isAllowed(std::uint32_t octave) const;
    float* prepareMotions(const ProxyView& view);

    GridCore& m_core;
    GridMotion m_motion;
    std::vector<float>
        m_motions;             ///< [rows] while motions differ much: how far each box moved in this update
    bool m_areUneven = false;  ///< motions differed much in the last update: each box has a bound of its own
    std::uint32_t m_octave = kLeastOctave;
    std::uint32_t m_comparedOctave = kLeastOctave;  ///< m_octave that m_motion was measured with
    std::uint32_t m_calmUpdates = 0;                ///< in which a much smaller bound would have done
};
}  // namespace cullet
