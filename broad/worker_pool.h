// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/helper_threads.h"
#include "broad/task_crew.h"

#include <algorithm>
#include <memory>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <type_traits>

namespace cullet
{
/// Runs loops on at most a fixed number of threads: those of oneTBB, or inside of together() the HelperThreads. With one thread none
/// is ever started.
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

    /// Calls body(task), or body(task, thread), for task in [0, tasks), each once, tasks in any order on any thread. Numbers of
    /// threads are below threads(), and those that run at the same time differ. A loop inside of a task of another one that
    /// runs together() is done by the thread of that, as 0.
    template <class Body>
    void run(unsigned tasks, const Body& body)
    {
        if (tasks == 1 || m_threads == 1 || (m_call != nullptr && m_crew->isRunning()))
        {
            for (unsigned task = 0; task < tasks; ++task)
                call(body, task, 0);
        }
        else if (m_call != nullptr)
        {
            m_crew->run(
                tasks, [&](unsigned task, unsigned thread) { call(body, task, thread); },
                [&] { callHelpers(tasks); });
        }
        else
        {
            const auto callFromArena = [&](unsigned task)
            { call(body, task, static_cast<unsigned>(tbb::this_task_arena::current_thread_index())); };
            arena().execute([&] { tbb::parallel_for(0u, tasks, callFromArena, tbb::simple_partitioner()); });
        }
    }

    /// Calls body(); the loops that it runs share one fork and join (TaskCrew). Not from two threads at once.
    template <class Body>
    void together(const Body& body)
    {
        if (m_threads == 1)
        {
            body();
            return;
        }
        if (!m_crew)
        {
            m_helpers = HelperThreads::shared();
            m_crew = std::make_unique<TaskCrew>(threads());
        }
        const Together isOpen(*this);
        body();
    }

    /// run() inside of a together() of its own: for a short loop that waits for nothing, since its threads are woken at once.
    template <class Body>
    void runPromptly(unsigned tasks, const Body& body)
    {
        together([&] { run(tasks, body); });
    }

    /// Inside of together(): calls the threads for loops of so many tasks that will come soon, since they take a while.
    void expect(unsigned tasks)
    {
        if (m_call != nullptr)
            callHelpers(tasks);
    }

private:
    /// Opens the crew, and closes it when the loops are over or one has failed.
    class Together
    {
    public:
        explicit Together(WorkerPool& pool) : m_pool(pool), m_call(*pool.m_helpers, *pool.m_crew)
        {
            m_pool.m_crew->open();
            m_pool.m_call = &m_call;
        }
        ~Together()
        {
            m_pool.m_call = nullptr;
            m_pool.m_crew->close();
        }
        Together(const Together&) = delete;
        Together& operator=(const Together&) = delete;

    private:
        WorkerPool& m_pool;
        HelperThreads::Call m_call;
    };

    template <class Body>
    static void call(const Body& body, unsigned task, unsigned thread)
    {
        if constexpr (std::is_invocable_v<Body, unsigned, unsigned>)
            body(task, thread);
        else
            body(task);
    }

    void callHelpers(unsigned tasks)
    {
        const unsigned wanted = std::min(tasks, threads());
        if (wanted > 1)
            m_call->ask(wanted - 1);
    }

    tbb::task_arena& arena()
    {
        if (!m_arena)
            m_arena = std::make_unique<tbb::task_arena>(m_threads);
        return *m_arena;
    }

    int m_threads;
    std::unique_ptr<tbb::task_arena> m_arena;
    std::unique_ptr<TaskCrew> m_crew;
    std::shared_ptr<HelperThreads> m_helpers;
    HelperThreads::Call* m_call = nullptr;  // while together() runs
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
