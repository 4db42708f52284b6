// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/array.h"

#include <cstddef>
#include <new>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace cullet
{
/// Arrays of at least this size share no page with each other, so that the pages of each can be locked for a device.
inline constexpr std::size_t kLockableBytes = std::size_t{1} << 16;

/// Allocator of memory that the system may back by pages of 2 MiB where it is large: boxes are read in random order,
/// and with pages of 4 KiB each of a million boxes would also cost a page table walk.
template <class T>
struct HugeAllocator
{
    using value_type = T;

    HugeAllocator() = default;
    template <class U>
    HugeAllocator(const HugeAllocator<U>& /*other*/) noexcept
    {
    }

    T* allocate(std::size_t count)
    {
        const std::size_t bytes = count * sizeof(T);
        void* memory = ::operator new(bytes, std::align_val_t(alignmentFor(bytes)));
#if defined(__linux__)
        if (bytes >= kLarge)
            madvise(memory, bytes, MADV_HUGEPAGE);  // a hint: nothing depends on it
#endif
        return static_cast<T*>(memory);
    }

    void deallocate(T* memory, std::size_t count) noexcept
    {
        ::operator delete(memory, std::align_val_t(alignmentFor(count * sizeof(T))));
    }

private:
    static constexpr std::size_t kPage = std::size_t{2} << 20;
    static constexpr std::size_t kLarge = 2 * kPage;
    static constexpr std::size_t kSmallPage = 4096;
    static constexpr std::size_t alignmentFor(std::size_t bytes)
    {
        return bytes >= kLarge ? kPage : bytes >= kLockableBytes ? kSmallPage : alignof(T);
    }
};

template <class T, class U>
bool operator==(const HugeAllocator<T>& /*a*/, const HugeAllocator<U>& /*b*/) noexcept
{
    return true;
}

template <class T, class U>
bool operator!=(const HugeAllocator<T>& /*a*/, const HugeAllocator<U>& /*b*/) noexcept
{
    return false;
}

template <class T>
using HugeVector = Array<T, HugeAllocator<T>>;
}  // namespace cullet
