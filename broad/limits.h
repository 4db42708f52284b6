// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>
#include <new>

// Numbers of boxes and pairs beyond which 30 or 32 bits do not count them. What exceeds one throws std::bad_alloc before
// anything changes, so that the caller learns it as lack of memory: of 100 GB, where it can happen at all.
namespace cullet
{
/// Rows of a ProxyTable: grids keep two flags beside a row.
inline constexpr std::uint32_t kMostRows = 1u << 30;
/// Keys that PairSort sorts at a time: 93,000 boxes at one place have as many pairs.
inline constexpr std::uint64_t kMostSortableKeys = 0xffffffffu;

/// The number of rows, if another one may follow.
inline std::uint32_t extendableRows(std::uint32_t rows)
{
    if (rows >= kMostRows)
        throw std::bad_alloc();
    return rows;
}

/// The number of keys, if PairSort can sort as many.
inline std::uint64_t sortableCount(std::uint64_t keys)
{
    if (keys > kMostSortableKeys)
        throw std::bad_alloc();
    return keys;
}
}  // namespace cullet
