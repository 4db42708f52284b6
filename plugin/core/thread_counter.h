// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace cullet
{
/// A sum over all threads. The first thread that adds to it needs no locked instruction; others seldom share a cache line.
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
            m_others[partOf(self)].sum.fetch_add(count, std::memory_order_relaxed);
    }
    void reset()
    {
        m_first.store(nullptr, std::memory_order_relaxed);
        m_firstSum.store(0, std::memory_order_relaxed);
        for (Part& part : m_others)
            part.sum.store(0, std::memory_order_relaxed);
    }
    std::uint64_t value() const
    {
        std::uint64_t sum = m_firstSum.load(std::memory_order_relaxed);
        for (const Part& part : m_others)
            sum += part.sum.load(std::memory_order_relaxed);
        return sum;
    }

private:
    struct alignas(64) Part
    {
        std::atomic<std::uint64_t> sum{0};
    };
    static constexpr int kBits = 3;

    /// A hash of the thread's address.
    static std::size_t partOf(const void* self)
    {
        return static_cast<std::size_t>(
            reinterpret_cast<std::uintptr_t>(self) * std::uint64_t(0x9e3779b97f4a7c15) >> (64 - kBits));
    }

    static inline thread_local char t_self = 0;  ///< its address identifies the thread

    std::atomic<const void*> m_first{nullptr};
    std::atomic<std::uint64_t> m_firstSum{0};
    std::array<Part, std::size_t(1) << kBits> m_others;
};
}  // namespace cullet
