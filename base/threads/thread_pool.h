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

/// Threads of the process that sleep until some update has loops for several threads. All that are called are woken at once, by
/// the caller: where they wake each other in turn, they come when a short update is over.
///
/// All worlds share them, so that several have no more threads than one. No loop waits for a thread that is somewhere else.
class ThreadPool
{
    /// A crew that threads may join while it lives. In `state` how many more are called, in the upper half, and how many are there.
    struct alignas(64) Slot
    {
        std::atomic<bool> isTaken{false};
        ForkJoin* crew = nullptr;
        std::atomic<std::uint32_t> state{0};
    };

public:
    /// Crews that threads can join; others are alone.
    static constexpr std::size_t kMostCrews = 1024;

    /// Those of the process. They end with their last owner.
    static std::shared_ptr<ThreadPool> shared();

    ThreadPool();
    ~ThreadPool();
    ThreadPool(const ThreadPool&) = delete;
    ThreadPool& operator=(const ThreadPool&) = delete;

    /// Lets threads join a crew.
    class Call
    {
    public:
        Call(ThreadPool& threads, ForkJoin& crew);
        /// Returns when all that came have left. The crew is closed.
        ~Call();
        Call(const Call&) = delete;
        Call& operator=(const Call&) = delete;

        /// Calls threads until so many are there or on their way.
        void ask(unsigned helpers);
        /// Those that have not come need not come. One that is there leaves the closed crew when it runs again: the system may
        /// have put it aside, for which no update waits.
        void end();

    private:
        ThreadPool& m_threads;
        Slot* m_slot;
    };

private:
    static constexpr std::uint32_t kCalled = 1u << 16;
    static constexpr unsigned kMostThreads = 1023;

    void grow(unsigned count);
    void work();
    bool joinSome();
    Slot* takeSlot();

    std::array<Slot, kMostCrews> m_slots;
    std::atomic<std::size_t> m_usedSlots{0};  ///< the first ones
    Futex m_calls;
    std::atomic<bool> m_isOver{false};
    std::mutex m_growing;
    std::atomic<unsigned> m_count{0};
    std::vector<std::thread> m_threads;
    long m_process;  ///< that has them: a forked one has none
};
}  // namespace cullet
