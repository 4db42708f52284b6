// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/broad/boxes/prefetch_box.h"
#include "cullet/broad/row_pair.h"

#include <algorithm>
#include <cstdint>

namespace cullet
{
inline void prefetchPair(const Aabb* boxes, RowPair pair)
{
    prefetchBox(boxes + pair.a);
    prefetchBox(boxes + pair.b);
}

/// Calls visit(pair, worker) for pairs whose boxes it reads, on several threads.
///
/// @param pairAt RowPair(index)
template <class PairAt, class Visit>
void forEachPair(ParallelLoops& workers, const Aabb* boxes, std::size_t count, PairAt pairAt, Visit visit)
{
    // The boxes of pairs are prefetched so many iterations early.
    constexpr std::uint32_t kPrefetch = 32;
    constexpr std::size_t kGrain = 2048;
    const unsigned tasks = workers.tasksFor(count, kGrain);
    workers.run(tasks,
                [&](unsigned task)
                {
                    const TaskRange range(count, task, tasks);
                    for (std::uint32_t i = range.begin; i < range.end; ++i)
                    {
                        prefetchPair(boxes, pairAt(std::min(i + kPrefetch, range.end - 1)));
                        visit(pairAt(i), task);
                    }
                });
}
}  // namespace cullet
