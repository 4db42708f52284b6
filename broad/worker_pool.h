// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <memory>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace cullet
{
/// Runs loops on at most a fixed number of oneTBB threads; with one thread no scheduler is ever started.
class WorkerPool
{
public:
    /// @param threads 0: as many as the machine has
    explicit WorkerPool(int threads)
        : m_threads(threads > 0 ? threads : tbb::this_task_arena::max_concurrency())
    {
    }

    unsigned threads() const { return static_cast<unsigned>(m_threads); }

    /// How many tasks to cut `items` into so that each has at least `grain` of them; at most threads().
    unsigned tasksFor(std::size_t items, std::size_t grain) const
    {
        const std::size_t useful = items / grain;
        return useful < 2 ? 1u : static_cast<unsigned>(useful < threads() ? useful : threads());
    }

    /// Calls body(task) for task in [0, tasks), each once, tasks in any order on any thread.
    template <class Body>
    void run(unsigned tasks, const Body& body)
    {
        if (tasks == 1)
        {
            body(0u);
            return;
        }
        if (!m_arena)
            m_arena = std::make_unique<tbb::task_arena>(m_threads);
        m_arena->execute([&] { tbb::parallel_for(0u, tasks, body, tbb::simple_partitioner()); });
    }

private:
    int m_threads;
    std::unique_ptr<tbb::task_arena> m_arena;
};

/// Part `task` of `tasks` equal parts of [0, items).
struct TaskRange
{
    TaskRange(std::size_t items, unsigned task, unsigned tasks)
        : begin(static_cast<std::uint32_t>(items * task / tasks)),
          end(static_cast<std::uint32_t>(items * (task + 1) / tasks))
    {
    }
    std::uint32_t begin;
    std::uint32_t end;
};
}  // namespace cullet
