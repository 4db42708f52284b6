// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/fuzz/largest_new.h"

#include <algorithm>
#include <cstdlib>
#include <new>

namespace
{
thread_local std::size_t largest = 0;
}  // namespace

namespace cullet::test
{
void resetLargestNew() noexcept
{
    largest = 0;
}

std::size_t largestNew() noexcept
{
    return largest;
}
}  // namespace cullet::test

// Not inlined, since the compiler would report a mismatch of free() and operator new.
[[gnu::noinline]] void* operator new(std::size_t size)
{
    largest = std::max(largest, size);
    if (void* memory = std::malloc(size != 0 ? size : 1))
        return memory;
    throw std::bad_alloc();
}

[[gnu::noinline]] void operator delete(void* memory) noexcept
{
    std::free(memory);
}

[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept
{
    std::free(memory);
}
