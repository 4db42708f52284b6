// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/support/process/shuffled_memory.h"

#include <LinearMath/btAlignedAllocator.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <iterator>
#include <mutex>
#include <new>
#include <utility>

namespace
{
constexpr std::size_t kGrain = 64, kBags = 512, kBagSize = 32;

/// Stands right below what the caller gets.
struct Header
{
    void* block;        ///< from the C library
    std::size_t bytes;  ///< of the block
};

/// Free blocks of one size.
struct Bag
{
    void* blocks[kBagSize];
    std::size_t count;
};

std::mutex mutex;
Bag bags[kBags];
std::uint32_t state = 1;
std::atomic<bool> isShuffling{false};
std::atomic<std::uint64_t> shuffled{0};

/// xorshift32
std::size_t drawBelow(std::size_t count) noexcept
{
    state ^= state << 13;
    state ^= state >> 17;
    state ^= state << 5;
    return state % count;
}

Bag* bagOf(std::size_t bytes) noexcept
{
    return bytes / kGrain < kBags ? &bags[bytes / kGrain] : nullptr;
}

void* takeOut(Bag& bag, std::size_t bytes) noexcept
{
    while (bag.count < kBagSize)
    {
        void* const block = std::aligned_alloc(kGrain, bytes);
        if (block == nullptr)
            break;
        bag.blocks[bag.count++] = block;
    }
    if (bag.count == 0)
        return nullptr;
    std::swap(bag.blocks[drawBelow(bag.count)], bag.blocks[bag.count - 1]);
    return bag.blocks[--bag.count];
}

/// A large block: one of some, of which the others are freed at once.
void* takeLarge(std::size_t bytes) noexcept
{
    void* blocks[6];
    for (void*& block : blocks)
        block = std::aligned_alloc(kGrain, bytes);
    std::swap(blocks[0], blocks[drawBelow(std::size(blocks))]);
    for (std::size_t i = 1; i < std::size(blocks); ++i)
        std::free(blocks[i]);
    return blocks[0];
}

void* takeBlock(std::size_t bytes) noexcept
{
    if (!isShuffling.load(std::memory_order_relaxed))
        return std::aligned_alloc(kGrain, bytes);
    const std::lock_guard<std::mutex> lock(mutex);
    shuffled.fetch_add(1, std::memory_order_relaxed);
    Bag* const bag = bagOf(bytes);
    return bag != nullptr ? takeOut(*bag, bytes) : takeLarge(bytes);
}

void giveBlock(void* block, std::size_t bytes) noexcept
{
    Bag* const bag = bagOf(bytes);
    if (bag != nullptr && isShuffling.load(std::memory_order_relaxed))
    {
        const std::lock_guard<std::mutex> lock(mutex);
        if (bag->count < kBagSize)
        {
            bag->blocks[bag->count++] = block;
            return;
        }
        std::swap(block, bag->blocks[drawBelow(kBagSize)]);
    }
    std::free(block);
}

void* takeAligned(std::size_t size, std::size_t alignment) noexcept
{
    // The header is in front, and the block a multiple of what the C library aligns it to.
    alignment = std::max(alignment, kGrain);
    const std::size_t bytes = (size + alignment + kGrain) / kGrain * kGrain + (alignment - kGrain);
    char* const block = static_cast<char*>(takeBlock(bytes));
    if (block == nullptr)
        return nullptr;
    const std::size_t misfit = reinterpret_cast<std::uintptr_t>(block) % alignment;
    char* const memory = block + alignment - misfit;
    reinterpret_cast<Header*>(memory)[-1] = {block, bytes};
    return memory;
}

void* take(std::size_t size) noexcept
{
    return takeAligned(size, kGrain);
}

void give(void* memory) noexcept
{
    if (memory == nullptr)
        return;
    const Header header = static_cast<Header*>(memory)[-1];
    giveBlock(header.block, header.bytes);
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

namespace cullet::test
{
ShuffledMemory::ShuffledMemory(std::uint32_t seed) noexcept
{
    const std::lock_guard<std::mutex> lock(mutex);
    state = seed * 2654435761u | 1u;
    isShuffling = true;
}

ShuffledMemory::~ShuffledMemory()
{
    isShuffling = false;
}

std::uint64_t shuffledBlocks() noexcept
{
    return shuffled;
}
}  // namespace cullet::test
