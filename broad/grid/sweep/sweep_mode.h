// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/grid/sweep/motion_bound.h"
#include "cullet/broad/grid/sweep/overlap_list.h"
#include "cullet/broad/grid/sweep/unswept_pairs.h"
#include "cullet/broad/grid/update/grid_core.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// Sweep mode of the grid: every update in which boxes change sweeps all columns. They are cleared and refilled ("clear
/// and rehash when many move", thesis 5.1.1) only when too many boxes migrated to other cells.
///
/// The grid reports the pairs whose gap or depth is within the motion since the last update, since no other pair can
/// have changed; their previous and current boxes are compared. There is no list and no hash of all pairs; only while
/// some boxes teleport, the pairs of the last update are listed.
class SweepMode
{
public:
    explicit SweepMode(GridCore& core)
        : m_core(core), m_bound(core), m_unswept(core), m_overlapping(core, m_unswept)
    {
    }

    /// Refills the columns, from any state, and reports the differences to the pairs held so far.
    void begin(const ProxyView& view, const std::vector<RowPair>& held);

    void update(const ProxyView& view);

    /// Appends the held pairs.
    void collectHeld(std::vector<RowPair>& held);

    /// Ends the mode: forgets the pairs.
    void clear();

    /// To be called in each update, of either mode. @param all whether all words may have changed
    void rememberFilterWords(const ProxyView& view, bool all);

    /// To be called after restart(), when the rows may be others.
    void forgetRows();

    std::uint64_t bytes() const;

private:
    class SweepSink;
    class TeleportSink;

    /// What the last update found, which decides how the next one compares boxes.
    ///
    ///           most boxes teleported,            as before, by a sample
    ///           the columns were refilled                 ____
    ///  Coherent ------------------------> Teleported -> Teleporting <-'
    ///      ^------------------------------------'-----------'
    ///                     else
    enum class Motion : std::uint8_t
    {
        Coherent,
        Teleported,
        Teleporting  ///< as Teleported, and GridCore::reference has the boxes of a sample only
    };

    bool areStillTeleporting(const ProxyView& view);
    void listOverlapping();
    void updateTeleported(const ProxyView& view, bool isCompared);
    bool scan(const ProxyView& view, bool isListing, bool mayFollow, PairSink& sink);
    bool follow(const ProxyView& view, const GridInput& input);
    void rememberBoxes(const ProxyView& view, bool areAll);
    void rememberSample(const ProxyView& view);

    GridCore& m_core;
    MotionBound m_bound;
    UnsweptPairs m_unswept;
    OverlapList m_overlapping;
    Motion m_motion = Motion::Coherent;
    std::vector<Filter> m_filterWords;  ///< [rows] filter words as of the last update; empty without filter
    std::uint32_t m_scannedRows = 0;    ///< rows of the table in the last scan
};
}  // namespace cullet
