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
std::uint32_t spareRoom(std::uint32_t count, RowUse use)
{
    if (count == 0 || use == RowUse::Once)
        return 0;
    return use == RowUse::Follow ? count / 8 + 4 : kRowPadding;
}
}  // namespace

/// Turns per-task counts into lists and groups the entries by column; returns the number of entries.
std::uint32_t ColumnGrid::scatterKind(EntryList Task::*entries, std::vector<std::uint32_t> Task::*counts,
                                      std::vector<RowList>& lists, std::vector<FlaggedId>& ids, RowUse use)
{
    const std::uint32_t rows = m_rows.capacity();
    lists.resize(rows);
    std::uint32_t begin = 0;
    std::uint32_t sum = 0;
    for (std::uint32_t row = 0; row < rows; ++row)
    {
        std::uint32_t next = begin;
        for (unsigned t = 0; t < m_taskCount; ++t)
        {
            std::uint32_t& slot = (m_tasks[t].*counts)[row];
            const std::uint32_t size = slot;
            slot = next;
            next += size;
        }
        const std::uint32_t count = next - begin;
        const std::uint32_t room = (count + spareRoom(count, use) + 3) & ~3u;
        lists[row] = {begin, count, room, 0};
        begin += room;
        sum += count;
    }
    m_idsUsed = begin;
    if (ids.size() < begin + kRowPadding)
        ids.resize(begin + begin / 4 + kRowPadding);
    m_workers.run(m_taskCount,
                  [&](unsigned t)
                  {
                      std::vector<std::uint32_t>& next = m_tasks[t].*counts;
                      for (const Entry& entry : m_tasks[t].*entries)
                      {
                          FlaggedId* const to = ids.data() + next[entry.row]++;
                          __builtin_prefetch(to + 16, 1);
                          *to = entry.id;
                      }
                  });
    return sum;
}

void ColumnGrid::mergeTasks(RowUse use)
{
    m_regular.clear();
    m_entryCount = 0;
    if (m_plan.levelCount > 1)
        m_entryCount =
            scatterKind(&Task::regular, &Task::regularCount, m_regular, m_regularIds, RowUse::Once);
    m_entryCount += scatterKind(&Task::bold, &Task::boldCount, m_bold, m_boldIds, use);
    m_unbounded.clear();
    for (unsigned t = 0; t < m_taskCount; ++t)
        m_unbounded.insert(m_unbounded.end(), m_tasks[t].unbounded.begin(), m_tasks[t].unbounded.end());
    std::sort(m_unbounded.begin(), m_unbounded.end());
}
}  // namespace cullet
