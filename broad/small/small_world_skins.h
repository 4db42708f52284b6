// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/boxes/aabb_simd.h"
#include "cullet/broad/row_pair.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// Verlet list with skins for a SmallWorldBackend: finds the rows that need no test because their boxes stay close to
/// where they were, as in a resting pile.
///
/// Each box gets a skin of half the margin around its reference position. While two boxes are inside their skins, their
/// pair can change only if it is a *candidate*: nearly touching, or held and nearly separated. A box that leaves its
/// skin is *awake* and tested against all others. Unlike in molecular dynamics, the result is exact.
///
/// Counts decide whether skins pay: they are made when nine of ten boxes stayed inside one for some updates, and
/// dropped or renewed when awake boxes cost more than that.
class SmallWorldSkins
{
public:
    bool isOn() const noexcept { return m_isOn; }
    const std::vector<std::uint32_t>& awake() const noexcept { return m_awake; }
    const std::vector<RowPair>& candidatePairs() const noexcept { return m_candidatePairs; }

    /// Drops the skins; new ones are not made before some updates.
    void turnOff() noexcept;

    /// Called in an update without skins: whether to make them now. O(rows) in one of eight updates or fewer.
    bool isCalm(const ProxyView& view);

    /// Makes skins around all boxes; addCandidate() then adds the candidates.
    void begin(const ProxyView& view);

    /// How far apart two reference boxes may be while their boxes can touch inside their skins.
    float pairSkin() const noexcept { return pairSkinOf(m_skin); }

    /// Adds a candidate: a pair that is held or within pairSkin(), unless it is held and cannot separate.
    void addCandidate(const ProxyView& view, RowPair pair, bool isHeld);

    /// Finds the boxes that left their skins; returns false when skins do not pay any more. O(changed rows).
    /// @pre the margin is that of begin()
    bool update(const ProxyView& view);

    /// After update() returned false: whether new skins are better than none.
    bool areWorthRenewing(const ProxyView& view) const noexcept
    {
        return view.margin > 0.0f && 8 * m_awake.size() <= view.size;
    }

    std::uint64_t bytes() const noexcept;

private:
    void wakeBox(std::uint32_t row)
    {
        m_isAwake[row] = 1;
        m_awake.push_back(row);
    }

    static constexpr std::uint32_t kShortestPeriod = 8;
    static constexpr std::uint32_t kLongestPeriod = 128;

    bool m_isOn = false;
    float m_margin = 0;
    float m_skin = 0;
    std::vector<Aabb> m_reference;  ///< [rows] reference boxes of the skins, or boxes of some updates ago
    std::vector<std::uint8_t> m_isAwake;  ///< [rows]
    std::vector<std::uint32_t> m_awake;
    std::vector<RowPair> m_candidatePairs;
    std::uint32_t m_age = 0;  ///< updates since skins were made, or since m_reference was copied
    std::uint32_t m_period = kShortestPeriod;
    std::uint64_t m_awakeTests = 0;  ///< tests of awake rows since skins were made
};
}  // namespace cullet
