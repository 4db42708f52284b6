// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/threads/parallel_loops.h"

#include <cstddef>
#include <cstdint>

namespace cullet
{
/// Calls body(item) for each item in [0, items), on several threads if each gets at least `grain` of them.
template <class Body>
void parallelForEach(ParallelLoops& loops, std::size_t items, std::size_t grain, const Body& body)
{
    const unsigned tasks = loops.tasksFor(items, grain);
    loops.run(tasks,
              [&](unsigned task)
              {
                  const TaskRange range(items, task, tasks);
                  for (std::uint32_t i = range.begin; i < range.end; ++i)
                      body(i);
              });
}
}  // namespace cullet
