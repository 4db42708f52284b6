// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/grid/columns/column_soa.h"
#include "cullet/broad/pairs/pair_sort.h"
#include "cullet/broad/small/moving_rows.h"
#include "cullet/broad/small/overlap_kernels.h"
#include "cullet/broad/small/small_world_skins.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// All boxes in six arrays and the held pairs as a bit matrix: the fastest method for a few hundred boxes.
///
/// Each changed box is tested against all others, 4 to 16 at a time, and the bits found are compared with the bits
/// held. No further structure has to be updated, so a few moving boxes cost nothing else. Where most boxes move but
/// stay close to where they are, boxes inside their skins (SmallWorldSkins) are not tested. Where few move, by small steps, each
/// is tested against its neighbours only (MovingRows).
///
/// Cost: changed rows * rows / 16 steps, half of it when all changed. Memory: 54 bytes a row, and rows^2 / 8.
class SmallWorldBackend final : public Backend
{
public:
    /// Up to so many rows, boxes are tested one by one. At most 64.
    static constexpr std::uint32_t kFewRows = 16;

    /// @param baseline use no instructions beyond the x86-64 baseline
    explicit SmallWorldBackend(bool baseline)
        : m_kernels(chooseOverlapKernels(baseline)), m_pairKernels(chooseColumnKernels(baseline))
    {
    }

    Status update(const ProxyView& proxies, PairDelta& delta) override;
    void restart(const Pairs& known) override;
    const char* name() const noexcept override { return "flat"; }
    BackendStats stats() const override;

    /// Rows up to which this backend beats a grid on this processor.
    std::uint32_t worthwhileRows() const noexcept { return m_kernels.worthwhileRows; }

    /// The pairs held, or those given to restart() if there was no update since; sorted. O(rows^2 / 64 + pairs).
    Pairs heldPairs() const;

private:
    void updateOrThrow(const ProxyView& view);
    void makeRoom(std::uint32_t rows);
    void restoreKnown(const ProxyView& view);
    void updateChanged(const ProxyView& view);
    void updateAll(const ProxyView& view);
    void updateMoving(const ProxyView& view, MovingRows::Row& moving);
    bool makeList(const ProxyView& view, MovingRows::Row& moving);
    void updatePair(const ProxyView& view, std::uint32_t row, std::uint32_t other);
    void updateFew(const ProxyView& view);
    bool updateInsideSkins(const ProxyView& view);
    void makeSkins(const ProxyView& view);
    void loadChanged(const ProxyView& view);
    void load(const ProxyView& view, std::uint32_t row);
    void updateRow(const ProxyView& view, std::uint32_t row, std::uint32_t firstWord);
    void examineAll(const ProxyView& view, std::uint32_t row, std::uint32_t word, std::uint64_t bits);
    void examine(const ProxyView& view, std::uint32_t row, std::uint32_t other);
    std::uint64_t* heldOf(std::uint32_t row) { return m_held.data() + std::size_t{row} * (m_stride / 64); }
    bool isHeld(std::uint32_t row, std::uint32_t other)
    {
        return (heldOf(row)[other / 64] >> other % 64 & 1) != 0;
    }
    void change(const ProxyView& view, RowPair pair);
    void flip(std::uint32_t row, std::uint32_t other);

    const OverlapKernels& m_kernels;
    const ColumnKernels& m_pairKernels;
    std::uint32_t m_stride = 0;          ///< rows that the arrays have memory for, a multiple of 64
    std::vector<float> m_limits;         ///< [6 * stride], see BoxArrays
    std::vector<std::uint64_t> m_held;   ///< [stride * stride / 64] both halves of the symmetric matrix
    std::vector<std::uint64_t> m_found;  ///< [stride / 64] overlaps of the row that is being tested
    std::vector<std::uint32_t> m_ids;    ///< [rows] as of the last update
    Pairs m_known;                       ///< given to restart()
    bool m_isRestarted = true;
    bool m_hadFilter = false;  ///< whether the last update had filters
    float m_margin = 0;
    bool m_isStale = false;  ///< boxes that moved inside their skins were not loaded
    SmallWorldSkins m_skins;
    MovingRows m_moving;
    std::vector<std::uint64_t> m_added;    ///< keys
    std::vector<std::uint64_t> m_removed;  ///< keys
    PairSort m_keySort;
    BackendStats m_stats;
};
}  // namespace cullet
