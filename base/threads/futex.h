// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <atomic>
#include <cstdint>

#if defined(__linux__)
#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>
#else
#include <condition_variable>
#include <mutex>
#endif

namespace cullet
{
/// A number that threads can sleep on until it changes. On Linux one system call wakes any number of threads: with a
/// condition variable they would wait for its mutex one after the other.
class Futex
{
public:
    std::uint32_t value() const { return m_word.load(std::memory_order_acquire); }

    /// Sleeps while the number is `seen`; may return earlier.
    void sleep(std::uint32_t seen)
    {
#if defined(__linux__)
        static_assert(sizeof(m_word) == sizeof(std::uint32_t), "the kernel looks at four bytes");
        // Counted before the kernel compares the number: a thread that changes it and then reads a count of 0 need not
        // call the kernel.
        m_sleepers.fetch_add(1);
        syscall(SYS_futex, &m_word, FUTEX_WAIT_PRIVATE, seen, nullptr, nullptr, 0);
        m_sleepers.fetch_sub(1);
#else
        std::unique_lock<std::mutex> lock(m_mutex);
        m_isOther.wait(lock, [&] { return value() != seen; });
#endif
    }

    /// Changes the number and wakes at least `sleepers` threads, if as many sleep.
    void wake(unsigned sleepers)
    {
#if defined(__linux__)
        m_word.fetch_add(1);
        if (m_sleepers.load() == 0)
            return;
        syscall(SYS_futex, &m_word, FUTEX_WAKE_PRIVATE, sleepers, nullptr, nullptr, 0);
#else
        {
            const std::lock_guard<std::mutex> lock(m_mutex);
            m_word.fetch_add(1, std::memory_order_release);
        }
        static_cast<void>(sleepers);
        m_isOther.notify_all();
#endif
    }

private:
    std::atomic<std::uint32_t> m_word{0};
#if defined(__linux__)
    std::atomic<std::uint32_t> m_sleepers{0};
#else
    std::mutex m_mutex;
    std::condition_variable m_isOther;
#endif
};
}  // namespace cullet
