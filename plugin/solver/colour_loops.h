// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/plugin/solver/block_plan.h"

#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Blocks for which a task pays.
constexpr std::size_t kBlocksOfTask = 4;

/// Calls body(block, thread) for all blocks, colour by colour, those of a colour on several threads.
template <class Body>
void forEachBlock(const BlockPlan& plan, ParallelLoops& loops, const Body& body)
{
    for (const BlockPlan::Colour& colour : plan.colours())
    {
        const std::size_t count = colour.end - colour.begin;
        const unsigned tasks = colour.isSerial ? 1 : loops.tasksFor(count, kBlocksOfTask);
        loops.run(tasks,
                  [&](unsigned task, unsigned thread)
                  {
                      const TaskRange range(count, task, tasks);
                      for (std::uint32_t i = range.begin; i < range.end; ++i)
                          body(colour.begin + i, thread);
                  });
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
