// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/update/grid_delta.h"

#include "cullet/base/bytes_of.h"

namespace cullet
{
namespace
{
constexpr std::size_t kFewChanges = 65536;  // added and removed pairs
constexpr std::size_t kVeryFewChanges = 1024;
}  // namespace

GridDelta::GridDelta(ParallelLoops& workers)
    : m_workers(workers), m_serialLoops(1), m_added(workers.threads()), m_removed(workers.threads())
{
}

void GridDelta::clear()
{
    for (unsigned worker = 0; worker < m_workers.threads(); ++worker)
    {
        m_added[worker].clear();
        m_removed[worker].clear();
    }
}

void GridDelta::write(PairDelta& delta)
{
    std::size_t count = 0;
    for (unsigned worker = 0; worker < m_workers.threads(); ++worker)
        count += m_added[worker].size() + m_removed[worker].size();
    const bool isShared = m_workers.threads() > 2 && count > kFewChanges;
    ParallelLoops& pool = isShared ? m_workers : m_serialLoops;
    const unsigned tasks = isShared || m_workers.threads() == 1 || count < kVeryFewChanges ? 1u : 2u;
    m_workers.run(tasks,
                  [&](unsigned task)
                  {
                      if (task == 0)
                          m_sorts[0].write(pool, m_added, delta.added);
                      if (task == tasks - 1)
                          m_sorts[1].write(pool, m_removed, delta.removed);
                  });
    for (unsigned worker = 0; worker < m_workers.threads(); ++worker)
    {
        m_added[worker].trim();
        m_removed[worker].trim();
    }
}

std::uint64_t GridDelta::bytes() const
{
    std::uint64_t sum = m_sorts[0].bytes() + m_sorts[1].bytes() + bytesOf(m_added, m_removed);
    for (const std::vector<KeyList>* lists : {&m_added, &m_removed})
    {
        for (const KeyList& list : *lists)
            sum += list.bytes();
    }
    return sum;
}
}  // namespace cullet
