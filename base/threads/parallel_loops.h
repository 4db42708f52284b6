// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/threads/fork_join.h"
#include "cullet/base/threads/thread_pool.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <thread>
#include <type_traits>

namespace cullet
{
/// Runs loops on at most a fixed number of threads: the calling one and ThreadPool. With one thread none is ever
/// started.
///
/// A number above that of the machine's cores divides the work into as many lists, on as many threads as cores. One
/// loop or runRegion() at a time.
class ParallelLoops
{
public:
    /// Nanoseconds of work per thread for which waking the thread pays. A thread joins 15 to 60 microseconds after it
    /// is requested, or much later on a shared machine, and its output is in the cache of another core. Tests of data
    /// races lower this number for the whole program, before any loop: only speed depends on it.
    static inline double workPerThread = 2e5;

    /// @param threads 0: as many as the machine has
    explicit ParallelLoops(int threads)
        : m_threads(threads > 0 ? static_cast<unsigned>(threads) : cores()), m_limit(m_threads)
    {
    }

    unsigned threads() const { return m_threads; }

    /// Number of tasks into which to divide `items`, so that each has at least `grain` of them; at most one per thread.
    unsigned tasksFor(std::size_t items, std::size_t grain) const
    {
        const std::size_t useful = items / grain;
        return useful < 2 ? 1u : static_cast<unsigned>(std::min<std::size_t>(useful, m_limit));
    }

    /// Calls body(task), or body(task, thread), for task in [0, tasks), each once, tasks in any order on any thread.
    /// Thread numbers are below threads(), and concurrent threads have different ones. A loop inside a task of another
    /// loop is run by the thread of that task, with the number 0.
    template <class Body>
    void run(unsigned tasks, const Body& body)
    {
        if (tasks == 1 || m_limit == 1 || (m_isInRegion && m_forkJoin->isRunning()))
        {
            for (unsigned task = 0; task < tasks; ++task)
                call(body, task, 0);
        }
        else if (m_isInRegion)
        {
            m_forkJoin->run(
                tasks, [&](unsigned task, unsigned thread) { call(body, task, thread); },
                [&] { wakeHelpers(tasks); });
        }
        else
        {
            runRegion([&] { run(tasks, body); });
        }
    }

    /// Calls body(); the loops that it runs share one fork and join (ForkJoin).
    template <class Body>
    void runRegion(const Body& body)
    {
        if (m_limit == 1)
        {
            body();
            return;
        }
        if (!m_registration)
        {
            m_forkJoin = std::make_unique<ForkJoin>(threads());
            m_threadPool = ThreadPool::shared();
            m_registration.emplace(*m_threadPool, *m_forkJoin);
        }
        const Region isOpen(*this);
        body();
    }

    /// Calls body(); the loops that it runs share one fork and join, on as many threads as their work pays for.
    ///
    /// @param work nanoseconds that one thread would need, estimated by counts of operations and never by a clock
    template <class Body>
    void runRegion(double work, const Body& body)
    {
        const Limit whileItRuns(*this, work);
        runRegion(body);
    }

    /// Inside runRegion() with an upper bound of the work: sets the work of the loops that follow.
    void limit(double work) { m_limit = threadsFor(work); }

    /// Inside runRegion(): requests the threads for loops of `tasks` tasks that follow soon, since threads join with a
    /// delay.
    void prewake(unsigned tasks)
    {
        if (m_isInRegion)
            wakeHelpers(tasks);
    }

private:
    /// Opens the ForkJoin, and closes it when the loops are over or one has failed.
    class Region
    {
    public:
        explicit Region(ParallelLoops& pool) : m_pool(pool)
        {
            m_pool.m_forkJoin->open();
            m_pool.m_isInRegion = true;
        }
        ~Region()
        {
            m_pool.m_isInRegion = false;
            m_pool.m_forkJoin->close();
            m_pool.m_registration->end();
        }
        Region(const Region&) = delete;
        Region& operator=(const Region&) = delete;

    private:
        ParallelLoops& m_pool;
    };

    /// Limits the threads of loops while it lives.
    class Limit
    {
    public:
        Limit(ParallelLoops& pool, double work) : m_pool(pool), m_before(pool.m_limit) { pool.limit(work); }
        ~Limit() { m_pool.m_limit = m_before; }
        Limit(const Limit&) = delete;
        Limit& operator=(const Limit&) = delete;

    private:
        ParallelLoops& m_pool;
        unsigned m_before;
    };

    static unsigned cores()
    {
        // Queried once: it takes a system call.
        static const unsigned known = std::max(1u, std::thread::hardware_concurrency());
        return known;
    }

    unsigned threadsFor(double work) const
    {
        return static_cast<unsigned>(std::clamp(work / workPerThread, 1.0, static_cast<double>(m_threads)));
    }

    template <class Body>
    static void call(const Body& body, unsigned task, unsigned thread)
    {
        if constexpr (std::is_invocable_v<Body, unsigned, unsigned>)
            body(task, thread);
        else
            body(task);
    }

    void wakeHelpers(unsigned tasks)
    {
        const unsigned wanted = std::min({tasks, m_limit, cores()});
        if (wanted > 1)
            m_registration->requestUpTo(wanted - 1);
    }

    unsigned m_threads;
    unsigned m_limit;  ///< threads of the loops that follow, at most
    bool m_isInRegion = false;
    std::unique_ptr<ForkJoin> m_forkJoin;
    std::shared_ptr<ThreadPool> m_threadPool;
    std::optional<ThreadPool::Registration> m_registration;
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
