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
/// Arrays so long share no page with each other, so that a device may lock those of each.
inline constexpr std::size_t kLockableBytes = std::size_t{1} << 16;

/// Memory that the system may back by pages of 2 MiB where it is large: boxes are read in random order, and with pages
/// of 4 KiB each of a million boxes would cost a walk of the page table too.
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
            madvise(memory, bytes, MADV_HUGEPAGE);  // a wish: nothing depends on it
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
