// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstddef>
#include <cstdint>

/// Replaced operator new, and Bullet's allocator, of the programs that link shuffled_memory.cpp.
namespace cullet::test
{
/// During the lifetime of this object blocks get addresses in an order that a seed decides: one that is made later is as
/// often below as above, and a freed block is not the next one given. One object at a time.
class ShuffledMemory
{
public:
    explicit ShuffledMemory(std::uint32_t seed) noexcept;
    ~ShuffledMemory();
    ShuffledMemory(const ShuffledMemory&) = delete;
    ShuffledMemory& operator=(const ShuffledMemory&) = delete;
};

/// Blocks that were given while some ShuffledMemory lived.
std::uint64_t shuffledBlocks() noexcept;
}  // namespace cullet::test
