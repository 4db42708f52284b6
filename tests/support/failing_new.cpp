// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "tests/support/failing_new.h"

#include <cstdlib>
#include <limits>
#include <new>

namespace
{
constexpr std::uint64_t kNever = std::numeric_limits<std::uint64_t>::max();
thread_local std::uint64_t count = 0;
thread_local std::uint64_t leftBeforeFailure = kNever;

void* take(std::size_t size) noexcept
{
    ++count;
    return leftBeforeFailure-- == 0 ? nullptr : std::malloc(size != 0 ? size : 1);
}
}  // namespace

// Not inline: the compiler would take free() for what does not belong to the new of others.
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
    return leftBeforeFailure > kNever / 2;  // it counts on below 0
}
}  // namespace cullet::test
