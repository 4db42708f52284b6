// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// In a program that links this file, Bullet's allocations can fail. Bullet itself tests no result, so that a failing
// allocator of an application has to throw.
#include "cullet/tests/faults/support/faults.h"

#include <LinearMath/btAlignedAllocator.h>

#include <algorithm>
#include <cstdlib>
#include <new>

namespace
{
using namespace cullet::test;

void* allocate(std::size_t size, int alignment)
{
    const std::size_t unit = std::max(static_cast<std::size_t>(alignment), sizeof(void*));
    void* const memory = isNextFault(FaultKind::BulletAllocation)
                             ? nullptr
                             : std::aligned_alloc(unit, (size / unit + 1) * unit);
    if (memory == nullptr)
        throw std::bad_alloc();
    countBulletMemory(1);
    return memory;
}

void deallocate(void* memory)
{
    countBulletMemory(memory != nullptr ? -1 : 0);
    std::free(memory);
}

[[maybe_unused]] const bool isInstalled = []
{
    btAlignedAllocSetCustomAligned(allocate, deallocate);
    return true;
}();
}  // namespace
