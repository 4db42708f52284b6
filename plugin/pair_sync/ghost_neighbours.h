// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// The rows near each ghost that walks, so that few of its moves need a search.
///
/// A listed ghost has a reach, a box larger than its own, and a list of rows. The owner keeps in the list every row
/// whose box overlaps the reach, and every listed ghost whose reach does. As long as the box of the ghost stays inside
/// its reach, only listed rows can overlap it. Rows that have moved away stay in the list until it is made anew.
///
/// A listed row is *paired* if the pair cache has the pair: nothing is to be added then, however the ghost moves. The owner
/// says which pairs leave the cache.
///
/// 192 bytes for each ghost that ever had a list, and 4 per row.
class GhostNeighbours
{
public:
    bool isAnyListed() const noexcept { return m_listedCount != 0; }
    bool isListed(std::uint32_t row) const noexcept
    {
        return row < m_slots.size() && m_slots[row] != kNone && m_lists[m_slots[row]].isListed;
    }
    /// Whether the ghost is listed and the box inside its reach.
    bool isInReach(std::uint32_t row, const Aabb& box) const noexcept;

    /// Begins an empty list of the ghost; any former one is dropped.
    ///
    /// @return false if the ghost must do without: memory is short, or its last list was too long and few moves ago
    bool begin(std::uint32_t row, const Aabb& reach) noexcept;

    /// Adds a row to the list of a listed ghost, not paired; one that is there is not paired any more. A full list is
    /// dropped.
    void add(std::uint32_t ghost, std::uint32_t row) noexcept;

    /// Lets begin() fail for some moves: the ghost has more neighbours than a list takes.
    void postpone(std::uint32_t row) noexcept { m_lists[m_slots[row]].wait = kLongWait; }

    /// Drops the list of the ghost, if it has one.
    void drop(std::uint32_t row) noexcept;
    void clear() noexcept;

    /// Makes two rows paired or not, in the lists in which either has the other.
    void setPaired(std::uint32_t a, std::uint32_t b, bool isPaired) noexcept
    {
        setPairedIn(a, b, isPaired);
        setPairedIn(b, a, isPaired);
    }
    /// Makes no rows paired. O(lists)
    void forgetPaired() noexcept;

    /// Calls visit(row) for each row that is not paired. @pre the ghost is listed
    template <class Visit>
    void forEachUnpaired(std::uint32_t ghost, Visit visit) const
    {
        const List& list = m_lists[m_slots[ghost]];
        for (std::uint32_t i = list.pairedCount; i < list.count; ++i)
            visit(list.rows[i]);
    }

    std::uint64_t bytes() const noexcept;

private:
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};
    static constexpr std::uint32_t kMost = 40;      // rows of a list
    static constexpr std::uint16_t kLongWait = 16;  // calls of begin() that fail after postpone()

    struct List
    {
        Aabb reach;
        std::uint32_t count = 0;
        std::uint16_t wait = 0;
        bool isListed = false;
        std::uint8_t pairedCount = 0;
        std::uint32_t rows[kMost];  ///< paired ones first
    };

    List* listFor(std::uint32_t row) noexcept;
    static std::uint32_t* find(List& list, std::uint32_t row) noexcept;
    static void setPairedAt(List& list, std::uint32_t* entry, bool isPaired) noexcept;
    void setPairedIn(std::uint32_t ghost, std::uint32_t row, bool isPaired) noexcept;

    std::vector<std::uint32_t> m_slots;  // by row: index of its list, or kNone
    std::vector<List> m_lists;
    std::uint32_t m_listedCount = 0;
};
}  // namespace cullet
