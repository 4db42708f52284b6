// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/boxes/aabb_simd.h"
#include "cullet/broad/grid/columns/column_soa.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// Tells a SmallWorldBackend which rows need no test, because they stay near where they were, as in a resting pile.
///
/// Each box gets a shell of half the margin around its reference position. While two boxes are inside theirs, their
/// pair can change only if it is *watched*: near touching, or held and near parting. A box that leaves its shell is
/// *active* and tested against everything. (A Verlet list with a slack, as in molecular dynamics, made exact.)
///
/// Whether shells pay is told by counts: they are made when nine of ten boxes stayed inside one for some updates, and
/// dropped or made anew when active boxes cost more than that.
class SmallWorldSkins
{
public:
    bool isOn() const noexcept { return m_isOn; }
    const std::vector<std::uint32_t>& active() const noexcept { return m_active; }
    const std::vector<RowPair>& watched() const noexcept { return m_watched; }

    /// No shells, and not before some updates.
    void turnOff() noexcept;

    /// For an update without shells: whether it is time to make them. O(rows) in one of eight updates or fewer.
    bool isCalm(const ProxyView& view);

    /// Makes shells around all boxes; the watched pairs come from watch().
    void begin(const ProxyView& view);

    /// How far apart two boxes may be and still touch inside their shells.
    float reach() const noexcept { return reachOfShells(m_slack); }

    /// Watches a pair that is held or within reach(), unless it is held and can not part.
    void watch(const ProxyView& view, RowPair pair, bool isHeld);

    /// Finds the boxes that left their shells; false when shells do not pay any more. O(changed rows).
    /// @pre the margin is that of begin()
    bool update(const ProxyView& view);

    /// After update() gave false: whether new shells are better than none.
    bool areWorthRenewing(const ProxyView& view) const noexcept
    {
        return view.margin > 0.0f && 8 * m_active.size() <= view.size;
    }

    std::uint64_t bytes() const noexcept;

private:
    void activate(std::uint32_t row)
    {
        m_isActive[row] = 1;
        m_active.push_back(row);
    }

    static constexpr std::uint32_t kShortestPeriod = 8;
    static constexpr std::uint32_t kLongestPeriod = 128;

    bool m_isOn = false;
    float m_margin = 0;
    float m_slack = 0;
    std::vector<Aabb> m_reference;         ///< [rows] centres of the shells, or boxes of some updates ago
    std::vector<std::uint8_t> m_isActive;  ///< [rows]
    std::vector<std::uint32_t> m_active;
    std::vector<RowPair> m_watched;
    std::uint32_t m_age = 0;  ///< updates since shells were made, or since m_reference was taken
    std::uint32_t m_period = kShortestPeriod;
    std::uint64_t m_spent = 0;  ///< tests of active rows since then
};
}  // namespace cullet
