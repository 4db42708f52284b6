// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace cullet
{
/// PartnerLists whose entries are of an unsigned type, which limits the rows.
template <class Entry>
class PartnerListsOf
{
public:
    /// Rows are below this number.
    static constexpr std::uint32_t kMostRows = std::numeric_limits<Entry>::max() / 2 + 1;

    void growTo(std::uint32_t rows) noexcept { m_rows = rows; }
    std::size_t size() const noexcept { return m_size; }

    void insert(std::uint32_t rowA, std::uint32_t rowB, bool flag);
    void erase(std::uint32_t rowA, std::uint32_t rowB) noexcept;

    template <class IsErased>
    void eraseIf(std::uint32_t row, IsErased& isErased)
    {
        if (!hasList(row))
            return;
        List& list = m_lists[row];
        std::size_t kept = 0;
        for (const Entry entry : list)
        {
            if (isErased(rowOf(entry), hasFlag(entry)))
                eraseFrom(m_lists[rowOf(entry)], row);
            else
                list[kept++] = entry;
        }
        m_size -= list.size() - kept;
        list.resize(kept);
    }

    /// @param onlyAbove whether to visit only pairs of which the row is the lower one
    template <class Visit>
    void updateFlags(std::uint32_t row, bool onlyAbove, Visit& visit)
    {
        if (!hasList(row))
            return;
        List& list = m_lists[row];
        for (std::size_t place = onlyAbove ? placeOf(list, row) : 0; place < list.size(); ++place)
        {
            const std::uint32_t partner = rowOf(list[place]);
            const bool flag = visit(partner, hasFlag(list[place]));
            if (flag == hasFlag(list[place]))
                continue;
            list[place] = entryOf(partner, flag);
            List& other = m_lists[partner];
            other[placeOf(other, row)] = entryOf(row, flag);
        }
    }

    void removePartners(std::uint32_t row, std::vector<std::uint32_t>& rows) const noexcept;
    std::uint64_t bytes() const noexcept;

private:
    using List = std::vector<Entry>;

    bool hasList(std::uint32_t row) const noexcept { return row < m_lists.size(); }
    static std::uint32_t rowOf(Entry entry) noexcept { return entry / 2u; }
    static bool hasFlag(Entry entry) noexcept { return entry % 2u != 0; }
    static Entry entryOf(std::uint32_t row, bool flag) noexcept
    {
        return static_cast<Entry>(row * 2u + (flag ? 1u : 0u));
    }

    static std::size_t placeOf(const List& list, std::uint32_t row) noexcept;
    static void makeRoom(List& list);
    static void insertInto(List& list, std::size_t place, Entry entry) noexcept;
    static void eraseFrom(List& list, std::uint32_t row) noexcept;

    std::vector<List> m_lists;  // by row; empty before the first pair
    std::uint32_t m_rows = 0;
    std::size_t m_size = 0;
};

extern template class PartnerListsOf<std::uint16_t>;
extern template class PartnerListsOf<std::uint32_t>;

/// Pairs of rows, each with a flag, as a sorted list of partners for each row.
///
/// Each pair is in the lists of both its rows. An entry is a row and the flag, of two bytes while rows are below 2^15, else
/// of four: 4 or 8 bytes per pair, with the room to grow an eighth more, and 24 per row from the first pair on. Cost
/// for lists of n partners: a search O(log n), a change moves O(n) entries, at the end of both lists none.
class PartnerLists
{
public:
    /// Allows rows below the number, which is at most 2^31. May throw std::bad_alloc and then changes nothing. O(pairs) where
    /// entries become larger.
    void growTo(std::uint32_t rows);

    /// Number of pairs.
    std::size_t size() const noexcept { return m_small.size() + m_large.size(); }

    /// Adds the pair, or changes its flag. May throw std::bad_alloc and then changes nothing.
    ///
    /// @pre rowA != rowB, both below the number of growTo()
    void insert(std::uint32_t rowA, std::uint32_t rowB, bool flag)
    {
        change([&](auto& lists) { lists.insert(rowA, rowB, flag); });
    }
    void erase(std::uint32_t rowA, std::uint32_t rowB) noexcept
    {
        change([&](auto& lists) { lists.erase(rowA, rowB); });
    }
    void eraseAllOf(std::uint32_t row) noexcept
    {
        eraseIf(row, [](std::uint32_t, bool) { return true; });
    }

    /// Erases the pairs of the row for which isErased(partner, flag).
    template <class IsErased>
    void eraseIf(std::uint32_t row, IsErased isErased)
    {
        change([&](auto& lists) { lists.eraseIf(row, isErased); });
    }

    /// For each pair of the row: sets the flag to visit(partner, flag).
    template <class Visit>
    void updateFlagsOf(std::uint32_t row, Visit visit)
    {
        change([&](auto& lists) { lists.updateFlags(row, false, visit); });
    }
    /// The same for the pairs of which the row is the lower one.
    template <class Visit>
    void updateFlagsAbove(std::uint32_t row, Visit visit)
    {
        change([&](auto& lists) { lists.updateFlags(row, true, visit); });
    }

    /// Removes the partners of the row from an ascending list of rows.
    void removePartners(std::uint32_t row, std::vector<std::uint32_t>& rows) const noexcept
    {
        isSmall() ? m_small.removePartners(row, rows) : m_large.removePartners(row, rows);
    }

    /// O(rows)
    std::uint64_t bytes() const noexcept { return m_small.bytes() + m_large.bytes(); }

private:
    using Small = PartnerListsOf<std::uint16_t>;
    using Large = PartnerListsOf<std::uint32_t>;

    bool isSmall() const noexcept { return m_rows <= Small::kMostRows; }
    template <class Change>
    void change(Change change)
    {
        isSmall() ? change(m_small) : change(m_large);
    }

    // One of both is empty.
    Small m_small;
    Large m_large;
    std::uint32_t m_rows = 0;
};
}  // namespace cullet
