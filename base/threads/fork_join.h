// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <memory>

namespace cullet
{
/// Threads that stay for several loops, so that these take one fork and join together.
///
/// One thread, the first, runs loops one after the other. Others that help() take tasks of the loop that is there; between loops
/// they look out for the next one for a fraction of a millisecond and leave then. Nobody waits for a thread that did not come,
/// nor for one that is put to sleep outside of a task: the first alone would do all of it.
class ForkJoin
{
public:
    /// @param threads with the first one, whose number is 0
    explicit ForkJoin(unsigned threads) : m_threads(threads), m_isHere(new std::atomic<bool>[threads])
    {
        for (unsigned thread = 0; thread < threads; ++thread)
            m_isHere[thread].store(false, std::memory_order_relaxed);
    }

    /// Calls body(task, thread) for task in [0, tasks), each once, in the calling thread and in those that help. Loops do not
    /// nest.
    ///
    /// @param callHelpers called when there is something to do for them
    template <class Body, class CallHelpers>
    void run(unsigned tasks, const Body& body, const CallHelpers& callHelpers)
    {
        begin(tasks, &body,
              [](const void* what, unsigned task, unsigned thread)
              { (*static_cast<const Body*>(what))(task, thread); });
        callHelpers();
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

    /// Before the loops.
    void open() { m_isOpen.store(true, std::memory_order_relaxed); }

    /// No loop will follow before the next open().
    void close() { m_isOpen.store(false, std::memory_order_release); }

    /// Takes tasks until close() or until no loop came for a while. In some other thread; more than there are numbers for
    /// leave at once.
    void help();

    /// So many looks whoever looks out for something takes before it does something else, about a microsecond each.
    static constexpr unsigned kPatience = 64;

    /// A moment for the thread of this core that is waited for. Others are let in later: who yields on a busy machine is away for
    /// milliseconds.
    ///
    /// @param look how many there were before
    static void rest(unsigned look);

private:
    using Call = void (*)(const void* body, unsigned task, unsigned thread);

    void begin(unsigned tasks, const void* body, Call call);
    unsigned takeNumber();
    bool takeTask(unsigned thread);
    void finish();

    static constexpr std::uint64_t kLoop = std::uint64_t{1} << 32;

    // Written between loops only, and read by who has taken a task.
    const void* m_body = nullptr;
    Call m_call = nullptr;
    unsigned m_tasks = 0;
    bool m_isRunning = false;

    unsigned m_threads;
    std::unique_ptr<std::atomic<bool>[]> m_isHere;  ///< [threads]
    alignas(64) std::atomic<std::uint64_t> m_left{
        0};  ///< number of the loop, and tasks that nobody has taken
    alignas(64) std::atomic<unsigned> m_done{0};
    std::atomic<bool> m_isOpen{false};
    std::atomic<bool> m_hasFailed{false};
    std::exception_ptr m_failure;
};
}  // namespace cullet
