// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/api.h"
#include "cullet/broad/huge_vector.h"

#include <atomic>
#include <cstddef>

namespace cullet
{
/// Called with the address of memory that is about to be given back. No exception may leave it. Any thread.
using BoxMemoryRelease = void (*)(const void* memory);

/// One in the process, also when boxes are allocated outside of the shared library.
CULLET_API inline std::atomic<BoxMemoryRelease>& boxMemoryRelease() noexcept
{
    static std::atomic<BoxMemoryRelease> release{nullptr};
    return release;
}

/// Allocates arrays that a device may copy from or to directly: whoever locked the pages of one is told before it goes
/// away.
template <class T>
struct BoxAllocator
{
    using value_type = T;

    BoxAllocator() = default;
    template <class U>
    BoxAllocator(const BoxAllocator<U>&) noexcept
    {
    }

    T* allocate(std::size_t count) { return HugeAllocator<T>().allocate(count); }
    void deallocate(T* memory, std::size_t count) noexcept
    {
        const BoxMemoryRelease release = boxMemoryRelease().load(std::memory_order_acquire);
        if (release != nullptr && count * sizeof(T) >= kLockableBytes)
            release(memory);
        HugeAllocator<T>().deallocate(memory, count);
    }

    template <class U>
    bool operator==(const BoxAllocator<U>&) const noexcept
    {
        return true;
    }
    template <class U>
    bool operator!=(const BoxAllocator<U>&) const noexcept
    {
        return false;
    }
};
}  // namespace cullet
