// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/threads/float_mode.h"

#include <atomic>
#include <cstdint>
#include <exception>
#include <memory>

namespace cullet
{
/// A parallel region of several loops with one fork and join.
///
/// The first thread runs loops one after the other. Threads in help() take tasks of the current loop; between loops
/// they spin for a fraction of a millisecond, and leave if no loop follows. No loop waits for a thread that has not
/// joined, nor for one that was descheduled outside of a task: the first thread alone would run all tasks.
class ForkJoin
{
public:
    /// @param threads their number, including the first one, which has the number 0
    explicit ForkJoin(unsigned threads) : m_threads(threads), m_isJoined(new std::atomic<bool>[threads])
    {
        for (unsigned thread = 0; thread < threads; ++thread)
            m_isJoined[thread].store(false, std::memory_order_relaxed);
    }

    /// Calls body(task, thread) for task in [0, tasks), each once, in the calling thread and in threads in help(), which
    /// compute in the floating-point mode of the calling thread, so that they get the same bits. Loops do not nest.
    ///
    /// @param wakeHelpers called once tasks can be taken
    template <class Body, class WakeHelpers>
    void run(unsigned tasks, const Body& body, const WakeHelpers& wakeHelpers)
    {
        begin(tasks, &body,
              [](const void* what, unsigned task, unsigned thread)
              { (*static_cast<const Body*>(what))(task, thread); });
        wakeHelpers();
        while (takeTask(0))
        {
        }
        finish();
    }
    template <class Body>
    void run(unsigned tasks, const Body& body)
    {
        run(tasks, body, [] {});
    }

    /// Whether a loop is running; for the threads that run it.
    bool isRunning() const { return m_isRunning; }

    /// To be called before the loops.
    void open() { m_isOpen.store(true, std::memory_order_relaxed); }

    /// Ends the region: no loop follows before the next open().
    void close() { m_isOpen.store(false, std::memory_order_release); }

    /// Runs tasks until close(), or until no loop began for a while. For other threads than the first one; returns at
    /// once if all thread numbers are taken.
    void help();

    /// How often a waiting thread spins before it does something else, about a microsecond each time.
    static constexpr unsigned kMostSpins = 64;

    /// Pauses a spinning thread, for the benefit of the other thread of its core. It yields only after kMostSpins
    /// times: on a busy machine, a thread that yields is descheduled for milliseconds.
    ///
    /// @param spins how often the thread has spun before
    static void spinWait(unsigned spins);

private:
    using Call = void (*)(const void* body, unsigned task, unsigned thread);

    void begin(unsigned tasks, const void* body, Call call);
    unsigned takeThreadNumber();
    bool takeTask(unsigned thread);
    void finish();

    static constexpr std::uint64_t kLoopUnit = std::uint64_t{1} << 32;

    // Written between loops only, and read by threads that have taken a task.
    const void* m_body = nullptr;
    Call m_call = nullptr;
    unsigned m_tasks = 0;
    FloatMode m_floatMode;
    bool m_isRunning = false;

    unsigned m_threads;
    std::unique_ptr<std::atomic<bool>[]> m_isJoined;  ///< [threads]
    alignas(64) std::atomic<std::uint64_t> m_loopAndTasks{
        0};  ///< number of the loop times kLoopUnit, plus the number of tasks that are not taken yet
    alignas(64) std::atomic<unsigned> m_done{0};
    std::atomic<bool> m_isOpen{false};
    std::atomic<bool> m_hasFailed{false};
    std::exception_ptr m_failure;
};
}  // namespace cullet
