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
/// Runs loops on at most a fixed number of threads: the calling one and ThreadPool. With one thread none is ever started.
///
/// More threads than the machine has cores share the work out among as many lists, and are no more than there are cores.
/// One loop or together() at a time.
class ParallelLoops
{
public:
    /// Nanoseconds of work for which one more thread is worth its call. It comes 15 to 60 microseconds after it is called, or
    /// much later on a machine that is shared, and leaves what it wrote in the cache of another core. Tests of what threads do to
    /// each other lower it for the whole program, before any loop: only speed depends on it.
    static inline double worth = 2e5;

    /// @param threads 0: as many as the machine has
    explicit ParallelLoops(int threads)
        : m_threads(threads > 0 ? static_cast<unsigned>(threads) : cores()), m_limit(m_threads)
    {
    }

    unsigned threads() const { return m_threads; }

    /// How many tasks to cut `items` into so that each has at least `grain` of them; at most as many as there may be threads.
    unsigned tasksFor(std::size_t items, std::size_t grain) const
    {
        const std::size_t useful = items / grain;
        return useful < 2 ? 1u : static_cast<unsigned>(std::min<std::size_t>(useful, m_limit));
    }

    /// Calls body(task), or body(task, thread), for task in [0, tasks), each once, tasks in any order on any thread. Numbers of
    /// threads are below threads(), and those that run at the same time differ. A loop inside of a task of another one is done
    /// by the thread of that, as 0.
    template <class Body>
    void run(unsigned tasks, const Body& body)
    {
        if (tasks == 1 || m_limit == 1 || (m_isTogether && m_crew->isRunning()))
        {
            for (unsigned task = 0; task < tasks; ++task)
                call(body, task, 0);
        }
        else if (m_isTogether)
        {
            m_crew->run(
                tasks, [&](unsigned task, unsigned thread) { call(body, task, thread); },
                [&] { callHelpers(tasks); });
        }
        else
        {
            together([&] { run(tasks, body); });
        }
    }

    /// Calls body(); the loops that it runs share one fork and join (ForkJoin).
    template <class Body>
    void together(const Body& body)
    {
        if (m_limit == 1)
        {
            body();
            return;
        }
        if (!m_call)
        {
            m_crew = std::make_unique<ForkJoin>(threads());
            m_helpers = ThreadPool::shared();
            m_call.emplace(*m_helpers, *m_crew);
        }
        const Together isOpen(*this);
        body();
    }

    /// The same for loops that take one thread so many nanoseconds, by counts of what they do and never by a clock: they have
    /// the threads that are worth it.
    template <class Body>
    void together(double work, const Body& body)
    {
        const Limit whileItRuns(*this, work);
        together(body);
    }

    /// Inside of together() with an upper bound of the work: what the loops from here on take.
    void limit(double work) { m_limit = threadsFor(work); }

    /// Inside of together(): calls the threads for loops of so many tasks that will come soon, since they take a while.
    void expect(unsigned tasks)
    {
        if (m_isTogether)
            callHelpers(tasks);
    }

private:
    /// Opens the crew, and closes it when the loops are over or one has failed.
    class Together
    {
    public:
        explicit Together(ParallelLoops& pool) : m_pool(pool)
        {
            m_pool.m_crew->open();
            m_pool.m_isTogether = true;
        }
        ~Together()
        {
            m_pool.m_isTogether = false;
            m_pool.m_crew->close();
            m_pool.m_call->end();
        }
        Together(const Together&) = delete;
        Together& operator=(const Together&) = delete;

    private:
        ParallelLoops& m_pool;
    };

    /// Lets loops have fewer threads while it lives.
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
        // Asked once: it takes a system call.
        static const unsigned known = std::max(1u, std::thread::hardware_concurrency());
        return known;
    }

    unsigned threadsFor(double work) const
    {
        return static_cast<unsigned>(std::clamp(work / worth, 1.0, static_cast<double>(m_threads)));
    }

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
        const unsigned wanted = std::min({tasks, m_limit, cores()});
        if (wanted > 1)
            m_call->ask(wanted - 1);
    }

    unsigned m_threads;
    unsigned m_limit;  ///< of the threads for the loops that come
    bool m_isTogether = false;
    std::unique_ptr<ForkJoin> m_crew;
    std::shared_ptr<ThreadPool> m_helpers;
    std::optional<ThreadPool::Call> m_call;
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
