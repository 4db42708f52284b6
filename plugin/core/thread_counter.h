// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <atomic>
#include <cstdint>

namespace cullet
{
/// A sum over all threads. The first thread that adds to it needs no locked instruction.
class ThreadCounter
{
public:
    [[gnu::always_inline]] void add(std::uint64_t count)
    {
        const void* const self = &t_self;
        const void* first = m_first.load(std::memory_order_relaxed);
        if (first == self ||
            (first == nullptr && m_first.compare_exchange_strong(first, self, std::memory_order_relaxed)))
            m_firstSum.store(m_firstSum.load(std::memory_order_relaxed) + count, std::memory_order_relaxed);
        else
            m_otherSum.fetch_add(count, std::memory_order_relaxed);
    }
    void reset()
    {
        m_first.store(nullptr, std::memory_order_relaxed);
        m_firstSum.store(0, std::memory_order_relaxed);
        m_otherSum.store(0, std::memory_order_relaxed);
    }
    std::uint64_t value() const
    {
        return m_firstSum.load(std::memory_order_relaxed) + m_otherSum.load(std::memory_order_relaxed);
    }

private:
    static inline thread_local char t_self = 0;  ///< its address identifies the thread

    std::atomic<const void*> m_first{nullptr};
    std::atomic<std::uint64_t> m_firstSum{0}, m_otherSum{0};
};
}  // namespace cullet
