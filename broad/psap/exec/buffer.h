// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>
#include <type_traits>
#include <utility>

namespace cullet::psap
{
/// Owns memory of an executor and stores its size in elements. Movable.
///
/// @tparam Memory has allocateBytes(bytes), which may throw, deallocate(memory), which does not, and kAlignment
template <class T, class Memory>
class ExecutorBuffer
{
public:
    ExecutorBuffer() = default;
    ExecutorBuffer(const ExecutorBuffer&) = delete;
    ExecutorBuffer& operator=(const ExecutorBuffer&) = delete;
    ExecutorBuffer(ExecutorBuffer&& other) noexcept
        : m_data(std::exchange(other.m_data, nullptr)),
          m_size(std::exchange(other.m_size, 0)),
          m_account(std::exchange(other.m_account, nullptr))
    {
    }
    ExecutorBuffer& operator=(ExecutorBuffer&& other) noexcept
    {
        std::swap(m_data, other.m_data);
        std::swap(m_size, other.m_size);
        std::swap(m_account, other.m_account);
        return *this;
    }
    ~ExecutorBuffer() { release(); }

    T* data() const { return m_data; }
    std::uint64_t size() const { return m_size; }

    /// Throws what Memory throws, also for more bytes than 64 bits count; the buffer is then empty.
    ///
    /// @param account counter that includes the bytes while the buffer owns them; null: none
    void allocate(std::uint64_t size, std::uint64_t* account = nullptr)
    {
        release();
        constexpr std::uint64_t kMostBytes = ~std::uint64_t{0} >> 1;  // more than any memory has
        const bool isCountable = size <= kMostBytes / sizeof(T);
        m_data = static_cast<T*>(Memory::allocateBytes(isCountable ? size * sizeof(T) : kMostBytes));
        m_size = size;
        m_account = account;
        if (m_account != nullptr)
            *m_account += m_size * sizeof(T);
    }

    void release() noexcept
    {
        if (m_data != nullptr)
            Memory::deallocate(m_data);
        if (m_account != nullptr)
            *m_account -= m_size * sizeof(T);
        m_data = nullptr;
        m_size = 0;
        m_account = nullptr;
    }

private:
    static_assert(std::is_trivially_copyable_v<T>, "copied as bytes");
    static_assert(alignof(T) <= Memory::kAlignment, "the memory is not aligned for this");

    T* m_data = nullptr;
    std::uint64_t m_size = 0;
    std::uint64_t* m_account = nullptr;
};
}  // namespace cullet::psap
