// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <algorithm>
#include <cstdint>

namespace cullet
{
/// Decides whether a world that is too large for a SmallWorldBackend while many of its boxes move is left to one,
/// because few do: a planner moves ten links of a robot among a thousand boxes. Testing these ten against all boxes in
/// order costs less than a grid for them.
///
/// A change of the backend costs a restart, so that some updates must agree first. After each return to the grid it
/// takes twice as many. Counts and no clocks, so that every run decides alike.
class FewChangesPolicy
{
public:
    /// Up to this many times the rows for which a SmallWorldBackend is best in any case. Its matrix of pairs takes
    /// rows^2 / 8 bytes.
    static constexpr std::uint32_t kMostRowsFactor = 4;

    bool areFew() const noexcept { return m_areFew; }

    /// Counts an update.
    void count(std::uint32_t changedRows, std::uint32_t rows) noexcept
    {
        if (changedRows == 0)
            return;
        const bool isContrary = m_areFew ? changedRows > rows / kManyShare : changedRows <= rows / kFewShare;
        m_contraryUpdates = isContrary ? m_contraryUpdates + 1 : 0;
        if (m_contraryUpdates < (m_areFew ? kManyUpdates : m_fewUpdates))
            return;
        if (m_areFew)
            m_fewUpdates = std::min(2 * m_fewUpdates, kMostFewUpdates);
        m_areFew = !m_areFew;
        m_contraryUpdates = 0;
    }

private:
    static constexpr std::uint32_t kFewShare = 32;
    static constexpr std::uint32_t kManyShare = 8;
    static constexpr std::uint32_t kManyUpdates = 4;
    static constexpr std::uint32_t kMostFewUpdates = 256;

    bool m_areFew = false;
    std::uint32_t m_contraryUpdates = 0;  ///< in a row
    std::uint32_t m_fewUpdates = 8;       ///< contrary updates that end a phase with many changes
};
}  // namespace cullet
