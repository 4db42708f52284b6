// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/support/process/failing_new.h"

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <new>

namespace
{
constexpr std::uint64_t kNever = std::numeric_limits<std::uint64_t>::max();
thread_local std::uint64_t count = 0;
thread_local std::uint64_t leftBeforeFailure = kNever;
thread_local const std::function<void()>* functionToCall = nullptr;

bool isNextToFail() noexcept
{
    ++count;
    if (leftBeforeFailure-- != 0)
        return false;
    if (functionToCall == nullptr)
        return true;
    (*functionToCall)();
    return false;
}

void* take(std::size_t size) noexcept
{
    return isNextToFail() ? nullptr : std::malloc(size != 0 ? size : 1);
}

void* takeAligned(std::size_t size, std::size_t alignment) noexcept
{
    // aligned_alloc() requires multiples of the alignment, which is at least the size of a pointer.
    alignment = std::max(alignment, sizeof(void*));
    return isNextToFail() ? nullptr : std::aligned_alloc(alignment, (size / alignment + 1) * alignment);
}
}  // namespace

// Not inlined, since the compiler would report a mismatch of free() and operator new.
[[gnu::noinline]] void* operator new(std::size_t size)
{
    if (void* memory = take(size))
        return memory;
    throw std::bad_alloc();
}

[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept
{
    return take(size);
}

[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment)
{
    if (void* memory = takeAligned(size, static_cast<std::size_t>(alignment)))
        return memory;
    throw std::bad_alloc();
}

[[gnu::noinline]] void operator delete(void* memory, std::align_val_t) noexcept
{
    std::free(memory);
}

[[gnu::noinline]] void operator delete(void* memory, std::size_t, std::align_val_t) noexcept
{
    std::free(memory);
}

[[gnu::noinline]] void operator delete(void* memory) noexcept
{
    std::free(memory);
}

[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept
{
    std::free(memory);
}

namespace cullet::test
{
std::uint64_t newCount() noexcept
{
    return count;
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
