// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Groups the entries of the filling tasks by column.
#include "cullet/broad/grid/columns/column_grid.h"

#include <algorithm>

namespace cullet
{
namespace
{
/// Spare room of a column of `count` entries: for boxes that migrate into it, or for whole vectors that are read
/// behind its end while another thread writes the next column.
std::uint32_t spareRoom(std::uint32_t count, ColumnUse use)
{
    if (count == 0 || use == ColumnUse::Once)
        return 0;
    return use == ColumnUse::Follow ? count / 8 + 4 : kColumnPadding;
}
}  // namespace

/// Turns per-task counts into lists and groups the entries by column; returns the number of entries.
std::uint32_t ColumnGrid::scatterKind(EntryList Task::*entries, std::vector<std::uint32_t> Task::*counts,
                                      std::vector<ColumnList>& lists, std::vector<TaggedRow>& proxyRows,
                                      ColumnUse use)
{
    const std::uint32_t columns = m_columns.capacity();
    lists.resize(columns);
    std::uint32_t begin = 0;
    std::uint32_t sum = 0;
    for (std::uint32_t column = 0; column < columns; ++column)
    {
        std::uint32_t next = begin;
        for (unsigned t = 0; t < m_taskCount; ++t)
        {
            std::uint32_t& slot = (m_tasks[t].*counts)[column];
            const std::uint32_t size = slot;
            slot = next;
            next += size;
        }
        const std::uint32_t count = next - begin;
        const std::uint32_t room = (count + spareRoom(count, use) + 3) & ~3u;
        lists[column] = {begin, count, room, 0};
        begin += room;
        sum += count;
    }
    m_boldRowsUsed = begin;
    if (proxyRows.size() < begin + kColumnPadding)
        proxyRows.resize(begin + begin / 4 + kColumnPadding);
    m_workers.run(m_taskCount,
                  [&](unsigned t)
                  {
                      std::vector<std::uint32_t>& next = m_tasks[t].*counts;
                      for (const Entry& entry : m_tasks[t].*entries)
                      {
                          TaggedRow* const to = proxyRows.data() + next[entry.column]++;
                          __builtin_prefetch(to + 16, 1);
                          *to = entry.proxyRow;
                      }
                  });
    return sum;
}

void ColumnGrid::mergeTasks(ColumnUse use)
{
    m_regular.clear();
    m_entryCount = 0;
    if (plan().levelCount > 1)
        m_entryCount =
            scatterKind(&Task::regular, &Task::regularCount, m_regular, m_regularRows, ColumnUse::Once);
    m_entryCount += scatterKind(&Task::bold, &Task::boldCount, m_bold, m_boldRows, use);
    m_unbounded.clear();
    for (unsigned t = 0; t < m_taskCount; ++t)
        m_unbounded.insert(m_unbounded.end(), m_tasks[t].unbounded.begin(), m_tasks[t].unbounded.end());
    std::sort(m_unbounded.begin(), m_unbounded.end());
}
}  // namespace cullet
