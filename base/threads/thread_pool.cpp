// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/base/threads/thread_pool.h"

#include "cullet/base/held_while_forking.h"
#include "cullet/base/threads/fork_join.h"

#include <algorithm>
#include <exception>

#if defined(__unix__)
#include <unistd.h>
#endif

namespace cullet
{
namespace
{
long thisProcess()
{
#if defined(__unix__)
    return getpid();
#else
    return 0;
#endif
}
}  // namespace

std::shared_ptr<ThreadPool> ThreadPool::shared()
{
    struct Shared
    {
        Shared() { holdWhileForking(mutex); }
        std::mutex mutex;
        std::weak_ptr<ThreadPool> threads;
    };
    // Never destroyed: a static object may own a world.
    static Shared& all = *new Shared;
    const std::lock_guard<std::mutex> lock(all.mutex);
    std::shared_ptr<ThreadPool> threads = all.threads.lock();
    if (!threads)
    {
        threads = std::make_shared<ThreadPool>();
        all.threads = threads;
    }
    return threads;
}

ThreadPool::ThreadPool() : m_process(thisProcess()) {}

ThreadPool::~ThreadPool()
{
    m_isStopping.store(true, std::memory_order_relaxed);
    m_calls.wake(kMostThreads);
    for (std::thread& thread : m_threads)
        m_process == thisProcess() ? thread.join() : thread.detach();
}

/// Starts threads until there are `count`, or as many as the system allows.
void ThreadPool::grow(unsigned count)
{
    if (m_count.load(std::memory_order_relaxed) >= count || m_process != thisProcess())
        return;
    const std::lock_guard<std::mutex> lock(m_growMutex);
    try
    {
        while (m_threads.size() < count)
            m_threads.emplace_back([this] { work(); });
    }
    catch (const std::exception&)  // no thread, or no memory for one
    {
    }
    // Stored even if threads are missing, so that further calls do not try again.
    m_count.store(std::max(m_count.load(std::memory_order_relaxed), count), std::memory_order_relaxed);
}

void ThreadPool::work()
{
    for (;;)
    {
        const std::uint32_t seen = m_calls.value();
        if (m_isStopping.load(std::memory_order_relaxed))
            return;
        if (joinAny())
            continue;
        // The loops of the next update may begin soon after those of the last one.
        unsigned spins = 0;
        while (spins < ForkJoin::kMostSpins && m_calls.value() == seen)
            ForkJoin::spinWait(spins++);
        if (spins == ForkJoin::kMostSpins)
            m_calls.sleep(seen);
    }
}

/// Joins a ForkJoin that requests threads, and returns when it has left that; returns false if none requests threads.
bool ThreadPool::joinAny()
{
    const std::size_t used = m_usedSlots.load(std::memory_order_acquire);
    for (std::size_t i = 0; i < used; ++i)
    {
        Slot& slot = m_slots[i];
        std::uint32_t state = slot.state.load(std::memory_order_acquire);
        while (state >= kRequested)
        {
            if (!slot.state.compare_exchange_weak(state, state - kRequested + 1, std::memory_order_acq_rel,
                                                  std::memory_order_acquire))
                continue;
            slot.forkJoin->help();
            slot.state.fetch_sub(1, std::memory_order_release);
            return true;
        }
    }
    return false;
}

ThreadPool::Slot* ThreadPool::takeSlot()
{
    for (std::size_t i = 0; i < m_slots.size(); ++i)
    {
        Slot& slot = m_slots[i];
        if (slot.isTaken.load(std::memory_order_relaxed) ||
            slot.isTaken.exchange(true, std::memory_order_acquire))
            continue;
        std::size_t used = m_usedSlots.load(std::memory_order_relaxed);
        while (used <= i && !m_usedSlots.compare_exchange_weak(used, i + 1, std::memory_order_release,
                                                               std::memory_order_relaxed))
        {
        }
        return &slot;
    }
    return nullptr;
}

ThreadPool::Registration::Registration(ThreadPool& threads, ForkJoin& forkJoin)
    : m_threads(threads), m_slot(threads.takeSlot())
{
    if (m_slot != nullptr)
        m_slot->forkJoin = &forkJoin;
}

ThreadPool::Registration::~Registration()
{
    if (m_slot == nullptr)
        return;
    end();
    // Threads of the process that this one was forked from never leave.
    const bool hasThreads = m_threads.m_process == thisProcess();
    for (unsigned spins = 0; hasThreads && m_slot->state.load(std::memory_order_acquire) != 0; ++spins)
        ForkJoin::spinWait(spins);
    m_slot->state.store(0, std::memory_order_relaxed);
    m_slot->isTaken.store(false, std::memory_order_release);
}

void ThreadPool::Registration::end()
{
    if (m_slot != nullptr)
        m_slot->state.fetch_and(kRequested - 1, std::memory_order_relaxed);
}

void ThreadPool::Registration::requestUpTo(unsigned helpers)
{
    if (m_slot == nullptr)
        return;
    helpers = std::min(helpers, kMostThreads);
    // Every requested thread has joined or will join: only this thread requests threads.
    const std::uint32_t state = m_slot->state.load(std::memory_order_relaxed);
    const unsigned known = state / kRequested + state % kRequested;
    if (known >= helpers)
        return;
    m_threads.grow(helpers);
    m_slot->state.fetch_add((helpers - known) * kRequested, std::memory_order_release);
    m_threads.m_calls.wake(helpers - known);
}
}  // namespace cullet
