// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/support/process/failing_new.h"

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <limits>
#include <new>

#if defined(__linux__)
#include <malloc.h>
#endif

namespace
{
constexpr std::uint64_t kNever = std::numeric_limits<std::uint64_t>::max();
thread_local std::uint64_t count = 0;
thread_local std::uint64_t leftBeforeFailure = kNever;
thread_local const std::function<void()>* functionToCall = nullptr;
thread_local std::uint64_t largeUnaligned = 0;
std::atomic<std::int64_t> liveCount{0};
std::atomic<std::int64_t> liveBytes{0};
std::atomic<bool (*)() noexcept> fault{nullptr};

bool isNextToFail() noexcept
{
    ++count;
    const auto isFault = fault.load(std::memory_order_relaxed);
    if (isFault != nullptr && isFault())
        return true;
    if (leftBeforeFailure-- != 0)
        return false;
    if (functionToCall == nullptr)
        return true;
    (*functionToCall)();
    return false;
}

/// Counts memory that is taken (sign 1) or given back (-1).
void* counted(void* memory, int sign = 1) noexcept
{
    liveCount.fetch_add(memory != nullptr ? sign : 0, std::memory_order_relaxed);
#if defined(__linux__)
    liveBytes.fetch_add(sign * static_cast<std::int64_t>(malloc_usable_size(memory)),
                        std::memory_order_relaxed);
#endif
    return memory;
}

void* take(std::size_t size) noexcept
{
    constexpr std::size_t kLarge = std::size_t{1} << 20;
    largeUnaligned += size >= kLarge ? size : 0;
    return isNextToFail() ? nullptr : counted(std::malloc(size != 0 ? size : 1));
}

void* takeAligned(std::size_t size, std::size_t alignment) noexcept
{
    // aligned_alloc() requires multiples of the alignment, which is at least the size of a pointer.
    alignment = std::max(alignment, sizeof(void*));
    return isNextToFail() ? nullptr
                          : counted(std::aligned_alloc(alignment, (size / alignment + 1) * alignment));
}

void give(void* memory) noexcept
{
    std::free(counted(memory, -1));
}
}  // namespace

#include "cullet/tests/support/process/replaced_new.inl"

namespace cullet::test
{
std::uint64_t newCount() noexcept
{
    return count;
}

std::int64_t liveNewCount() noexcept
{
    return liveCount.load(std::memory_order_relaxed);
}

std::int64_t liveNewBytes() noexcept
{
    return liveBytes.load(std::memory_order_relaxed);
}

std::uint64_t largeUnalignedNewBytes() noexcept
{
    return largeUnaligned;
}

void setNewFault(bool (*isNextToFail)() noexcept) noexcept
{
    fault.store(isNextToFail, std::memory_order_relaxed);
}

OneNewFails::OneNewFails(std::uint64_t after) noexcept
{
    leftBeforeFailure = after;
}

OneNewFails::~OneNewFails()
{
    leftBeforeFailure = kNever;
}

bool OneNewFails::hasHappened() const noexcept
{
    return leftBeforeFailure > kNever / 2;  // the counter continues below 0
}

OneNewCalls::OneNewCalls(std::uint64_t after, const std::function<void()>& function) noexcept : m_turn(after)
{
    functionToCall = &function;
}

OneNewCalls::~OneNewCalls()
{
    functionToCall = nullptr;
}
}  // namespace cullet::test
