// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/base/threads/fork_join.h"

#include <thread>
#include <utility>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace cullet
{
void ForkJoin::rest(unsigned look)
{
#if defined(__SSE2__)
    if (look < kPatience)
    {
        for (int i = 0; i < 16; ++i)
            _mm_pause();
        return;
    }
#endif
    static_cast<void>(look);
    std::this_thread::yield();
}

void ForkJoin::begin(unsigned tasks, const void* body, Call call)
{
    m_body = body;
    m_call = call;
    m_tasks = tasks;
    m_isRunning = true;
    m_done.store(0, std::memory_order_relaxed);
    const std::uint64_t loop = m_left.load(std::memory_order_relaxed) / kLoop + 1;
    m_left.store(loop * kLoop + tasks, std::memory_order_release);
}

/// Takes one task and runs it; returns false when all are taken.
bool ForkJoin::takeTask(unsigned thread)
{
    std::uint64_t left = m_left.load(std::memory_order_acquire);
    do
    {
        if (left % kLoop == 0)
            return false;
    } while (
        !m_left.compare_exchange_weak(left, left - 1, std::memory_order_acq_rel, std::memory_order_acquire));
    // Until this task is counted as done, the loop is the one of `left`.
    try
    {
        m_call(m_body, m_tasks - static_cast<unsigned>(left % kLoop), thread);
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
    for (unsigned look = 0; m_done.load(std::memory_order_acquire) != m_tasks; ++look)
        rest(look);
    m_isRunning = false;
    if (m_hasFailed.exchange(false, std::memory_order_relaxed))
        std::rethrow_exception(std::exchange(m_failure, nullptr));
}

/// Takes a free thread number; returns 0 if there is none.
unsigned ForkJoin::takeNumber()
{
    for (unsigned thread = 1; thread < m_threads; ++thread)
    {
        if (!m_isHere[thread].load(std::memory_order_relaxed) &&
            !m_isHere[thread].exchange(true, std::memory_order_acquire))
            return thread;
    }
    return 0;
}

void ForkJoin::help()
{
    const unsigned thread = takeNumber();
    if (thread == 0)
        return;
    for (unsigned look = 0; look < kPatience && m_isOpen.load(std::memory_order_acquire); ++look)
    {
        if (takeTask(thread))
            look = 0;
        else
            rest(look);
    }
    m_isHere[thread].store(false, std::memory_order_release);
}
}  // namespace cullet
