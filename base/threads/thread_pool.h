// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/threads/futex.h"

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace cullet
{
class ForkJoin;

/// Threads of the process that sleep until some update has loops for several threads. The caller wakes all requested
/// threads at once: if they woke each other in turn, they would join after a short update is over.
///
/// All worlds share the threads, so that several worlds have no more of them than one. No loop waits for a thread that
/// is busy elsewhere.
class ThreadPool
{
    /// A ForkJoin that threads may join while it is registered. `state` has the number of requested threads that have
    /// not joined in its upper half, and the number of joined threads in its lower half.
    struct alignas(64) Slot
    {
        std::atomic<bool> isTaken{false};
        ForkJoin* forkJoin = nullptr;
        std::atomic<std::uint32_t> state{0};
    };

public:
    /// ForkJoin objects that threads can join; further ones run on their first thread alone.
    static constexpr std::size_t kMostForkJoins = 1024;

    /// The pool of the process. It is destroyed with its last owner.
    static std::shared_ptr<ThreadPool> shared();

    ThreadPool();
    ~ThreadPool();
    ThreadPool(const ThreadPool&) = delete;
    ThreadPool& operator=(const ThreadPool&) = delete;

    /// Registers a ForkJoin, so that threads can join it.
    class Registration
    {
    public:
        Registration(ThreadPool& threads, ForkJoin& forkJoin);
        /// Returns when all threads that joined have left. @pre the ForkJoin is closed
        ~Registration();
        Registration(const Registration&) = delete;
        Registration& operator=(const Registration&) = delete;

        /// Requests threads, until `helpers` have joined or are about to join.
        void requestUpTo(unsigned helpers);
        /// Cancels the requests for threads that have not joined. A joined thread leaves the closed ForkJoin when it
        /// runs again: the system may have descheduled it, and no update waits for that.
        void end();

    private:
        ThreadPool& m_threads;
        Slot* m_slot;
    };

private:
    static constexpr std::uint32_t kRequested = 1u << 16;
    static constexpr unsigned kMostThreads = 1023;

    void grow(unsigned count);
    void work();
    bool joinAny();
    Slot* takeSlot();

    std::array<Slot, kMostForkJoins> m_slots;
    std::atomic<std::size_t> m_usedSlots{0};  ///< slots of which any was ever taken: the first ones
    Futex m_calls;
    std::atomic<bool> m_isStopping{false};
    std::mutex m_growMutex;
    std::atomic<unsigned> m_count{0};
    std::vector<std::thread> m_threads;
    long m_process;  ///< the process of the threads: a forked process has none
};
}  // namespace cullet
