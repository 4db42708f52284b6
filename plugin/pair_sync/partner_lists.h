// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace cullet
{
/// Pairs of rows, each with a flag, as a sorted list of partners for each row.
///
/// Each pair is in the lists of both its rows. An entry is a row below 2^31 and the flag: 8 bytes per pair, with the room
/// to grow about 10, and 24 per row from the first pair on. Cost for lists of n partners: a search O(log n), a change moves
/// O(n) entries, at the end of both lists none.
class PartnerLists
{
public:
    /// Allows rows below the number.
    void growTo(std::uint32_t rows) noexcept { m_rows = std::max(m_rows, rows); }

    /// Number of pairs.
    std::size_t size() const noexcept { return m_size; }

    /// Adds the pair, or changes its flag. May throw std::bad_alloc and then changes nothing.
    ///
    /// @pre rowA != rowB, both below the number of growTo()
    void insert(std::uint32_t rowA, std::uint32_t rowB, bool flag);
    void erase(std::uint32_t rowA, std::uint32_t rowB) noexcept;
    void eraseAllOf(std::uint32_t row) noexcept
    {
        eraseIf(row, [](std::uint32_t, bool) { return true; });
    }

    /// Erases the pairs of the row for which isErased(partner, flag).
    template <class IsErased>
    void eraseIf(std::uint32_t row, IsErased isErased)
    {
        if (!hasList(row))
            return;
        List& list = m_lists[row];
        std::size_t kept = 0;
        for (const std::uint32_t entry : list)
        {
            if (isErased(rowOf(entry), hasFlag(entry)))
                eraseFrom(m_lists[rowOf(entry)], row);
            else
                list[kept++] = entry;
        }
        m_size -= list.size() - kept;
        list.resize(kept);
    }

    /// For each pair of the row: sets the flag to visit(partner, flag).
    template <class Visit>
    void updateFlagsOf(std::uint32_t row, Visit visit)
    {
        updateFlags(row, 0, visit);
    }
    /// The same for the pairs of which the row is the lower one.
    template <class Visit>
    void updateFlagsAbove(std::uint32_t row, Visit visit)
    {
        updateFlags(row, hasList(row) ? placeOf(m_lists[row], row) : 0, visit);
    }

    /// Removes the partners of the row from an ascending list of rows.
    void removePartners(std::uint32_t row, std::vector<std::uint32_t>& rows) const noexcept;

    /// O(rows)
    std::uint64_t bytes() const noexcept;

private:
    using List = std::vector<std::uint32_t>;

    static constexpr std::uint32_t kFlag = 1;

    bool hasList(std::uint32_t row) const noexcept { return row < m_lists.size(); }
    static std::uint32_t rowOf(std::uint32_t entry) noexcept { return entry >> 1; }
    static bool hasFlag(std::uint32_t entry) noexcept { return (entry & kFlag) != 0; }
    static std::uint32_t entryOf(std::uint32_t row, bool flag) noexcept
    {
        return row << 1 | (flag ? kFlag : 0);
    }

    template <class Visit>
    void updateFlags(std::uint32_t row, std::size_t first, Visit& visit)
    {
        if (!hasList(row))
            return;
        List& list = m_lists[row];
        for (std::size_t place = first; place < list.size(); ++place)
        {
            const std::uint32_t partner = rowOf(list[place]);
            const bool flag = visit(partner, hasFlag(list[place]));
            if (flag == hasFlag(list[place]))
                continue;
            list[place] ^= kFlag;
            List& other = m_lists[partner];
            other[placeOf(other, row)] ^= kFlag;
        }
    }

    static std::size_t placeOf(const List& list, std::uint32_t row) noexcept;
    static void makeRoom(List& list);
    static void insertInto(List& list, std::size_t place, std::uint32_t entry) noexcept;
    static void eraseFrom(List& list, std::uint32_t row) noexcept;

    std::vector<List> m_lists;  // by row; empty before the first pair
    std::uint32_t m_rows = 0;
    std::size_t m_size = 0;
};
}  // namespace cullet
