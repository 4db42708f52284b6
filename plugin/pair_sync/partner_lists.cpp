// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_sync/partner_lists.h"

#include <algorithm>
#include <utility>

namespace cullet
{
/// Where the row is in the list, or would be.
template <class Entry>
std::size_t PartnerListsOf<Entry>::placeOf(const List& list, std::uint32_t row) noexcept
{
    // Lists that are made in the order of rows grow at their end.
    if (list.empty() || rowOf(list.back()) < row)
        return list.size();
    return static_cast<std::size_t>(std::lower_bound(list.begin(), list.end(), entryOf(row, false)) -
                                    list.begin());
}

/// Room for one more entry. An eighth more instead of twice as much: what is allowed of a crowd may be many pairs.
template <class Entry>
void PartnerListsOf<Entry>::makeRoom(List& list)
{
    if (list.size() == list.capacity())
        list.reserve(list.size() + list.size() / 8 + 4);
}

/// @pre makeRoom()
template <class Entry>
void PartnerListsOf<Entry>::insertInto(List& list, std::size_t place, Entry entry) noexcept
{
    list.insert(list.begin() + static_cast<std::ptrdiff_t>(place), entry);
}

/// @pre the row is in the list
template <class Entry>
void PartnerListsOf<Entry>::eraseFrom(List& list, std::uint32_t row) noexcept
{
    list.erase(list.begin() + static_cast<std::ptrdiff_t>(placeOf(list, row)));
}

template <class Entry>
void PartnerListsOf<Entry>::insert(std::uint32_t rowA, std::uint32_t rowB, bool flag)
{
    if (m_lists.size() < m_rows)
        m_lists.resize(m_rows);
    List& listA = m_lists[rowA];
    List& listB = m_lists[rowB];
    const std::size_t placeA = placeOf(listA, rowB);
    const std::size_t placeB = placeOf(listB, rowA);
    if (placeA < listA.size() && rowOf(listA[placeA]) == rowB)
    {
        listA[placeA] = entryOf(rowB, flag);
        listB[placeB] = entryOf(rowA, flag);
        return;
    }
    makeRoom(listA);
    makeRoom(listB);
    insertInto(listA, placeA, entryOf(rowB, flag));
    insertInto(listB, placeB, entryOf(rowA, flag));
    ++m_size;
}

template <class Entry>
void PartnerListsOf<Entry>::erase(std::uint32_t rowA, std::uint32_t rowB) noexcept
{
    if (!hasList(rowA))
        return;
    const List& list = m_lists[rowA];
    const std::size_t place = placeOf(list, rowB);
    if (place == list.size() || rowOf(list[place]) != rowB)
        return;
    eraseFrom(m_lists[rowA], rowB);
    eraseFrom(m_lists[rowB], rowA);
    --m_size;
}

template <class Entry>
void PartnerListsOf<Entry>::removePartners(std::uint32_t row, std::vector<std::uint32_t>& rows) const noexcept
{
    if (!hasList(row))
        return;
    auto entry = m_lists[row].begin();
    const auto end = m_lists[row].end();
    const auto isPartner = [&](std::uint32_t other)
    {
        while (entry != end && rowOf(*entry) < other)
            ++entry;
        return entry != end && rowOf(*entry) == other;
    };
    // Not std::remove_if(), which may copy a predicate that remembers its place.
    auto kept = rows.begin();
    for (const std::uint32_t other : rows)
    {
        if (!isPartner(other))
            *kept++ = other;
    }
    rows.erase(kept, rows.end());
}

template <class Entry>
std::uint64_t PartnerListsOf<Entry>::bytes() const noexcept
{
    std::uint64_t bytes = m_lists.capacity() * sizeof(List);
    for (const List& list : m_lists)
        bytes += list.capacity() * sizeof(Entry);
    return bytes;
}

template class PartnerListsOf<std::uint16_t>;
template class PartnerListsOf<std::uint32_t>;

void PartnerLists::growTo(std::uint32_t rows)
{
    if (rows <= m_rows)
        return;
    if (isSmall() && rows > Small::kMostRows)
    {
        Large large;
        large.growTo(rows);
        for (std::uint32_t row = 0; row < m_rows; ++row)
        {
            const auto copy = [&](std::uint32_t partner, bool flag)
            {
                large.insert(row, partner, flag);
                return flag;
            };
            m_small.updateFlags(row, true, copy);
        }
        m_large = std::move(large);
        m_small = Small();
    }
    m_rows = rows;
    change([rows](auto& lists) { lists.growTo(rows); });
}
}  // namespace cullet
