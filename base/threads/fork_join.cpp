// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/base/threads/fork_join.h"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace cullet
{
namespace
{
/// How often a waiting thread yields before it sleeps, half a microsecond each time where nothing else runs.
constexpr unsigned kMostYields = 64;

/// The first sleep, and how many of the same length follow; each later group is longer by as much, up to kMostSleeps.
constexpr std::chrono::microseconds kSleep{50};
constexpr unsigned kSleepsOfSameLength = 8;
constexpr unsigned kMostSleeps = 20;

/// Whether rest() does anything.
#if defined(__SSE2__) || defined(__aarch64__)
constexpr bool kCanRest = true;
#else
constexpr bool kCanRest = false;
#endif

/// Lets some tens of cycles pass, in which the other thread of the core has more of it.
inline void rest()
{
#if defined(__SSE2__)
    _mm_pause();
#elif defined(__aarch64__)
    // Most processors pass over the hint that is meant for this, `yield`. A barrier for instructions takes as long as
    // x86's pause, as Rust's spin_loop() has it.
    __asm__ volatile("isb" ::: "memory");
#endif
}
}  // namespace

void ForkJoin::spinWait(unsigned spins)
{
    if (kCanRest && spins < kMostSpins)
    {
        for (int i = 0; i < 16; ++i)
            rest();
        return;
    }
    // A thread whose task is still not done was descheduled, or has much more to do than the waiting one had. Spinning
    // on would take the core that it may need.
    constexpr unsigned kFirstSleep = kMostSpins + kMostYields;
    if (spins < kFirstSleep)
        std::this_thread::yield();
    else
        std::this_thread::sleep_for(kSleep *
                                    std::min(1 + (spins - kFirstSleep) / kSleepsOfSameLength, kMostSleeps));
}

void ForkJoin::begin(unsigned tasks, const void* body, Call call)
{
    m_body = body;
    m_call = call;
    m_tasks = tasks;
    m_floatMode = FloatMode();
    m_isRunning = true;
    m_done.store(0, std::memory_order_relaxed);
    const std::uint64_t loop = m_loopAndTasks.load(std::memory_order_relaxed) / kLoopUnit + 1;
    m_loopAndTasks.store(loop * kLoopUnit + tasks, std::memory_order_release);
}

/// Takes one task and runs it; returns false when all are taken.
bool ForkJoin::takeTask(unsigned thread)
{
    std::uint64_t left = m_loopAndTasks.load(std::memory_order_acquire);
    do
    {
        if (left % kLoopUnit == 0)
            return false;
    } while (!m_loopAndTasks.compare_exchange_weak(left, left - 1, std::memory_order_acq_rel,
                                                   std::memory_order_acquire));
    // Until this task is counted as done, the loop is the one of `left`.
    try
    {
        const FloatMode::Scope asCaller(m_floatMode);
        m_call(m_body, m_tasks - static_cast<unsigned>(left % kLoopUnit), thread);
    }
    catch (...)
    {
        if (!m_hasFailed.exchange(true, std::memory_order_relaxed))
            m_failure = std::current_exception();
    }
    m_done.fetch_add(1, std::memory_order_release);
    return true;
}

void ForkJoin::finish()
{
    for (unsigned spins = 0; m_done.load(std::memory_order_acquire) != m_tasks; ++spins)
        spinWait(spins);
    m_isRunning = false;
    if (m_hasFailed.exchange(false, std::memory_order_relaxed))
        std::rethrow_exception(std::exchange(m_failure, nullptr));
}

/// Takes a free thread number; returns 0 if there is none.
unsigned ForkJoin::takeThreadNumber()
{
    for (unsigned thread = 1; thread < m_threads; ++thread)
    {
        if (!m_isJoined[thread].load(std::memory_order_relaxed) &&
            !m_isJoined[thread].exchange(true, std::memory_order_acquire))
            return thread;
    }
    return 0;
}

void ForkJoin::help()
{
    const unsigned thread = takeThreadNumber();
    if (thread == 0)
        return;
    for (unsigned spins = 0; spins < kMostSpins && m_isOpen.load(std::memory_order_acquire); ++spins)
    {
        if (takeTask(thread))
            spins = 0;
        else
            spinWait(spins);
    }
    m_isJoined[thread].store(false, std::memory_order_release);
}
}  // namespace cullet
