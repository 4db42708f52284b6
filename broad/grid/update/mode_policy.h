// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace cullet
{
/// Decides from counted work whether the resting mode of the grid pays: the cost of each phase of it is compared with
/// that of as many updates in sweep mode.
///
/// A phase that did not pay keeps the grid in sweep mode for 32 updates, and for twice as many after each further
/// failure, at most 256. Counts and no clocks, so that every thread count and machine decides alike.
class ModePolicy
{
public:
    /// Whether a phase may begin.
    bool mayBegin() const noexcept { return m_wait == 0; }

    /// Counts an update in sweep mode.
    void countMoving() noexcept { m_wait -= m_wait != 0 ? 1u : 0u; }

    /// A phase begins with `rows` boxes.
    void begin(std::size_t rows) noexcept
    {
        m_moving = kCostOfMoving * static_cast<double>(rows);
        m_spent = kCostOfRestingRefill * static_cast<double>(rows);
        m_saved = 0;
        m_isOpen = true;
    }

    /// Counts an update of the phase in which something changed.
    ///
    /// @param awake boxes outside their skins
    /// @param insideSkin  boxes that moved inside their skins
    void count(std::size_t awake, std::size_t insideSkin) noexcept
    {
        m_spent += costOfPhase(awake, insideSkin);
        m_saved += m_moving;
    }

    /// Whether the phase has cost less so far than sweep mode would have.
    bool hasPaid() const noexcept { return m_spent <= m_saved; }

    /// Ends the phase.
    void end() noexcept
    {
        if (!m_isOpen)
            return;
        m_isOpen = false;
        m_wait = hasPaid() ? 0u : m_nextWait;
        m_nextWait = hasPaid() ? kShortestWait : std::min(2 * m_nextWait, kLongestWait);
    }

    /// Cost of one update of a phase; see count().
    static double costOfPhase(std::size_t awake, std::size_t insideSkin) noexcept
    {
        return kCostOfAwakeMoving * static_cast<double>(awake) +
               kCostOfInsideSkin * static_cast<double>(insideSkin);
    }

    /// Costs per box in nanoseconds of a 2023 server core. Only the ratios matter here; ParallelLoops uses the
    /// values.
    static constexpr double kCostOfMoving = 60;     ///< in kept columns
    static constexpr double kCostOfMigrated = 200;  ///< in addition, for a box that migrated to other cells
    static constexpr double kCostOfRefill = 110;    ///< in columns that are cleared first
    static constexpr double kCostOfRestingRefill = 290;
    static constexpr double kCostOfAwakeMoving = 140;  ///< outside its skin and moving
    static constexpr double kCostOfAwakeAtRest = 45;   ///< outside its skin and at rest
    static constexpr double kCostOfInsideSkin = 15;

private:
    static constexpr std::uint32_t kShortestWait = 32;
    static constexpr std::uint32_t kLongestWait = 256;

    double m_moving = 0;
    double m_spent = 0;
    double m_saved = 0;
    bool m_isOpen = false;
    std::uint32_t m_wait = 0;
    std::uint32_t m_nextWait = kShortestWait;
};
}  // namespace cullet
