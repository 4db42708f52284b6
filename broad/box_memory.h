// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/api.h"
#include "cullet/broad/huge_vector.h"

#include <atomic>
#include <cstddef>

namespace cullet
{
/// Called, in any thread, with the address of memory that is about to be freed. No exception may leave it.
using BoxMemoryRelease = void (*)(const void* memory);

/// The callback of the process, the same one when boxes are allocated outside of the shared library.
CULLET_API inline std::atomic<BoxMemoryRelease>& boxMemoryRelease() noexcept
{
    static std::atomic<BoxMemoryRelease> release{nullptr};
    return release;
}

/// Allocates arrays that a device may copy from or to directly: boxMemoryRelease() is called before an array is freed,
/// so that its pages can be unlocked.
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
