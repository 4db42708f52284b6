// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/row_pair.h"
#include "cullet/broad/verlet/skin.h"
#include "cullet/broad/verlet/verlet_pairs.h"

#include <cmath>
#include <cstdint>
#include <vector>

namespace cullet
{
/// Resting mode of a SmallWorldBackend: finds the rows that need no test because their boxes stay close to where they
/// were, as in a resting pile.
///
/// Each box gets a skin of half the margin. While two boxes are inside their skins, their pair can change only if it is
/// *changeable* (VerletPairs). A box that leaves its skin is *awake*: it is tested against all others, and its pairs
/// expire.
///
/// Counts decide whether skins pay: they are made when nine of ten boxes stayed inside one for some updates, and
/// dropped or renewed when awake boxes cost more than that.
class SmallWorldSkins
{
public:
    bool isOn() const noexcept { return m_isOn; }
    const std::vector<std::uint32_t>& awake() const noexcept { return m_awake; }
    /// The changeable pairs of the boxes inside their skins.
    VerletPairs& pairs() noexcept { return m_pairs; }
    const Aabb* references() const noexcept { return m_skins.references.data(); }

    /// Drops the skins; new ones are not made before some updates.
    void turnOff() noexcept;

    /// Called in an update without skins: whether to make them now. O(rows) in one of eight updates or fewer.
    bool isCalm(const ProxyView& view);

    /// Makes skins around all boxes; addPair() then adds the pairs that are held or within pairGap().
    void begin(const ProxyView& view);

    float pairGap() const noexcept { return m_skins.skin.pairGap(); }
    /// Lists the pair if it is changeable.
    void addPair(const ProxyView& view, RowPair pair, bool isHeld)
    {
        if (!isHeld)
            m_pairs.add(pair, VerletPairs::State::Candidate);
        else if (!m_pairs.isPersistent(view.boxes[pair.a], view.boxes[pair.b]))
            m_pairs.add(pair, VerletPairs::State::Overlapping);
    }

    /// Finds the boxes that left their skins; returns false when skins do not pay any more. O(changed rows).
    /// @pre the margin is that of begin()
    bool update(const ProxyView& view);

    /// After update() returned false: whether new skins are better than none.
    bool areWorthRenewing(const ProxyView& view) const noexcept
    {
        return canBeMade(view.margin) && 8 * m_awake.size() <= view.size;
    }

    std::uint64_t bytes() const noexcept;

private:
    /// In an infinite skin everything would be inside, empty boxes too.
    static bool canBeMade(float margin) noexcept { return margin > 0.0f && std::isfinite(margin); }
    void wakeBox(std::uint32_t row)
    {
        m_isAwake[row] = 1;
        m_awake.push_back(row);
    }

    static constexpr std::uint32_t kShortestPeriod = 8;
    static constexpr std::uint32_t kLongestPeriod = 128;

    bool m_isOn = false;
    Skins m_skins;                        ///< [rows]; while off, the boxes of some updates ago
    std::vector<std::uint8_t> m_isAwake;  ///< [rows]
    std::vector<std::uint32_t> m_awake;
    VerletPairs m_pairs;
    std::uint32_t m_age = 0;  ///< updates since skins were made, or since m_skins was copied
    std::uint32_t m_period = kShortestPeriod;
    std::uint64_t m_awakeTests = 0;  ///< tests of awake rows since skins were made
};
}  // namespace cullet
