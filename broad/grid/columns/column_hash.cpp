// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/columns/column_hash.h"

namespace cullet
{
void ColumnHash::reset(std::uint32_t capacity, std::uint32_t bucketCount, const CellWindow& window)
{
    m_window = window;
    m_windowCount = window.count();
    if (capacity > m_room)
    {
        m_cells = std::make_unique<std::atomic<std::uint64_t>[]>(capacity);
        m_room = capacity;
    }
    m_capacity = capacity;
    m_mask = capacity - 1;
    m_shift = 32;
    for (std::uint32_t power = 1; power < capacity; power *= 2)
        --m_shift;
    m_bucketCount = bucketCount;
    m_count.store(0, std::memory_order_relaxed);
    for (std::uint32_t i = 0; i < capacity; ++i)
        m_cells[i].store(0, std::memory_order_relaxed);
}

std::uint32_t ColumnHash::findOrInsertFrom(std::uint32_t slot, std::uint64_t cell)
{
    for (;; slot = (slot + 1) & m_mask)
    {
        std::uint64_t seen = m_cells[slot].load(std::memory_order_relaxed);
        if (seen == cell)
            return m_windowCount + slot;
        if (seen != 0)
            continue;
        if (m_count.load(std::memory_order_relaxed) > m_capacity / 4 * 3)
            return kNone;
        if (m_cells[slot].compare_exchange_strong(seen, cell, std::memory_order_relaxed))
        {
            m_count.fetch_add(1, std::memory_order_relaxed);
            return m_windowCount + slot;
        }
        // Another thread took the slot, perhaps for the same cell.
        if (seen == cell)
            return m_windowCount + slot;
    }
}

std::uint32_t ColumnHash::find(std::uint64_t cell) const
{
    if (isInWindow(cell))
        return columnInWindow(cell);
    for (std::uint32_t slot = homeOf(cell);; slot = (slot + 1) & m_mask)
    {
        const std::uint64_t seen = m_cells[slot].load(std::memory_order_relaxed);
        if (seen == cell)
            return m_windowCount + slot;
        if (seen == 0)
            return kNone;
    }
}
}  // namespace cullet
