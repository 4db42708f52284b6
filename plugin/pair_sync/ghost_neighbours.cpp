// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_sync/ghost_neighbours.h"

#include "cullet/base/bytes_of.h"
#include "cullet/plugin/pair_sync/grown_box.h"

#include <algorithm>
#include <new>
#include <utility>

namespace cullet
{
bool GhostNeighbours::isInReach(std::uint32_t row, const Aabb& box) const noexcept
{
    return isListed(row) && encloses(m_lists[m_slots[row]].reach, box);
}

/// The list of the row, a new one if it has none; null without memory.
GhostNeighbours::List* GhostNeighbours::listFor(std::uint32_t row) noexcept
{
    try
    {
        if (m_slots.size() <= row)
            m_slots.resize(row + 1, kNone);
        if (m_slots[row] == kNone)
        {
            m_lists.emplace_back();
            m_slots[row] = static_cast<std::uint32_t>(m_lists.size() - 1);
        }
    }
    catch (const std::bad_alloc&)
    {
        return nullptr;
    }
    return &m_lists[m_slots[row]];
}

bool GhostNeighbours::begin(std::uint32_t row, const Aabb& reach) noexcept
{
    drop(row);
    List* list = listFor(row);
    if (list == nullptr)
        return false;
    if (list->wait != 0)
    {
        --list->wait;
        return false;
    }
    list->reach = reach;
    list->count = 0;
    list->pairedCount = 0;
    list->isListed = true;
    ++m_listedCount;
    return true;
}

/// The entry of the row; null if there is none.
std::uint32_t* GhostNeighbours::find(List& list, std::uint32_t row) noexcept
{
    std::uint32_t* const end = list.rows + list.count;
    std::uint32_t* const found = std::find(static_cast<std::uint32_t*>(list.rows), end, row);
    return found == end ? nullptr : found;
}

/// Moves an entry among the paired ones, or out of them.
void GhostNeighbours::setPairedAt(List& list, std::uint32_t* entry, bool isPaired) noexcept
{
    if ((entry < list.rows + list.pairedCount) == isPaired)
        return;
    if (!isPaired)
        --list.pairedCount;
    std::swap(*entry, list.rows[list.pairedCount]);
    if (isPaired)
        ++list.pairedCount;
}

void GhostNeighbours::add(std::uint32_t ghost, std::uint32_t row) noexcept
{
    List& list = m_lists[m_slots[ghost]];
    if (std::uint32_t* const entry = find(list, row))
        return setPairedAt(list, entry, false);
    if (list.count < kMost)
    {
        list.rows[list.count++] = row;
        return;
    }
    drop(ghost);
}

void GhostNeighbours::setPairedIn(std::uint32_t ghost, std::uint32_t row, bool isPaired) noexcept
{
    if (!isListed(ghost))
        return;
    List& list = m_lists[m_slots[ghost]];
    if (std::uint32_t* const entry = find(list, row))
        setPairedAt(list, entry, isPaired);
}

void GhostNeighbours::forgetPaired() noexcept
{
    for (List& list : m_lists)
        list.pairedCount = 0;
}

void GhostNeighbours::drop(std::uint32_t row) noexcept
{
    if (!isListed(row))
        return;
    m_lists[m_slots[row]].isListed = false;
    --m_listedCount;
}

void GhostNeighbours::clear() noexcept
{
    *this = GhostNeighbours();
}

std::uint64_t GhostNeighbours::bytes() const noexcept
{
    return bytesOf(m_slots, m_lists);
}
}  // namespace cullet
