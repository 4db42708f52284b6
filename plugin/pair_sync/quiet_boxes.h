// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/proxy_table.h"
#include "cullet/plugin/core/precision.h"

#include <array>
#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// How far each box of a small world may move before any pair can enter or leave. While all stay within that room, an
/// update would change nothing, and costs a comparison for each box that moved.
///
/// ```
///        measure()                absorb() returns true
///   Off ───────────> On ─────────────────────────────────> On
///    ^                │ release(), before each other update
///    └────────────────┘
/// ```
class QuietBoxes
{
public:
    /// Rows up to which boxes are compared with all others.
    static constexpr std::uint32_t kMostRows = 64;

    /// [row] one bit for each row with which it has a pair
    using Held = std::array<std::uint64_t, kMostRows>;

    /// Takes the changes of the table since the last update, if no pair can notice them. O(rows).
    ///
    /// @return whether it did, so that there is nothing to update
    bool absorb(ProxyTable& table, float margin) noexcept;

    /// Gives the changes back to the table, for an update.
    ///
    /// @param backendRestarts it reads all boxes, and needs no changes
    void release(ProxyTable& table, bool backendRestarts) noexcept;

    /// Whether to measure() after this update: not each time in worlds whose boxes soon leave their room.
    bool isWorthMeasuring(std::uint32_t rows) noexcept;

    /// Finds the room of each box after an update. O(rows^2).
    ///
    /// @param held the pairs of the cache; no other pair of overlapping boxes passes the filter words
    void measure(const ProxyTable& table, const Held& held, float margin) noexcept;

    /// Whether the last update was absorbed.
    bool isQuiet() const noexcept { return m_absorbedUpdates != 0; }

private:
    static constexpr std::uint32_t kLongestPause = 64;

    float roomBetween(const ProxyTable& table, std::uint32_t a, std::uint32_t b, bool isHeld) const noexcept;

    std::uint32_t m_rows = 0;  ///< 0: off
    float m_margin = 0;
    std::array<Aabb, kMostRows> m_boxes;   ///< [m_rows] when they were measured
    std::array<float, kMostRows> m_rooms;  ///< [m_rows] negative: none
    std::uint64_t m_moved = 0;             ///< rows whose changes were absorbed
    std::uint32_t m_absorbedUpdates = 0;
    std::uint32_t m_pause = 0;  ///< updates until the next measurement, after one that did not pay
    std::uint32_t m_wait = 0;   ///< those left
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
