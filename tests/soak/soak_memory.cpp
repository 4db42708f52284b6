// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/soak/soak_memory.h"

#include <LinearMath/btAlignedAllocator.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <malloc.h>
#include <new>

namespace
{
/// Threads count in places of their own, so that they do not wait for each other.
struct alignas(64) Place
{
    std::atomic<std::int64_t> bytes{0};
};
constexpr unsigned kPlaces = 64;
Place places[kPlaces];
std::atomic<unsigned> threads{0};

Place& placeOfThread() noexcept
{
    thread_local const unsigned number = threads.fetch_add(1, std::memory_order_relaxed);
    return places[number % kPlaces];
}

void* counted(void* memory) noexcept
{
    if (memory != nullptr)
        placeOfThread().bytes.fetch_add(static_cast<std::int64_t>(malloc_usable_size(memory)),
                                        std::memory_order_relaxed);
    return memory;
}

void give(void* memory) noexcept
{
    placeOfThread().bytes.fetch_sub(static_cast<std::int64_t>(malloc_usable_size(memory)),
                                    std::memory_order_relaxed);
    std::free(memory);
}

void* take(std::size_t size) noexcept
{
    return counted(std::malloc(size != 0 ? size : 1));
}

void* takeAligned(std::size_t size, std::size_t alignment) noexcept
{
    alignment = std::max(alignment, sizeof(void*));
    return counted(std::aligned_alloc(alignment, (size / alignment + 1) * alignment));
}

// Before any block of Bullet's is taken.
[[maybe_unused]] const bool isBulletsAllocatorReplaced = []
{
    btAlignedAllocSetCustomAligned([](std::size_t size, int alignment)
                                   { return takeAligned(size, static_cast<std::size_t>(alignment)); },
                                   give);
    return true;
}();
}  // namespace

#include "cullet/tests/support/process/replaced_new.inl"

std::int64_t cullet::test::liveBytes() noexcept
{
    std::int64_t bytes = 0;
    for (const Place& place : places)
        bytes += place.bytes.load(std::memory_order_relaxed);
    return bytes;
}
