// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/tiles/tiles.h"

#include <cstdint>

/// The sort of a tile's records by cell: a counting sort, by all threads of a block of a GPU or by one of the CPU.
namespace cullet::psap
{
/// A tile sorted by cell.
struct SortedTile
{
    /// [2 * twosFor(cells)] first box of each cell, and one past the last box; aligned to 4 bytes.
    std::uint16_t* starts;
    TileBox* boxes;
    std::uint16_t* ids;  ///< number of each box's record, and axes along which it begins in the tile

    static constexpr std::uint32_t kBeginsShift = 13;
    static_assert(TileShape::kMostRoom <= 1u << kBeginsShift,
                  "a record's number and where it begins have 16 bits");

    /// Starts are stored in twos.
    CULLET_HOST_DEVICE static std::uint32_t twosFor(std::uint32_t cells) { return cells / 2 + 1; }

    CULLET_HOST_DEVICE static std::uint32_t recordOf(std::uint32_t id)
    {
        return id & ((1u << kBeginsShift) - 1);
    }
    /// Whether the tile has the lower corner of the intersection of two boxes, so that it reports them.
    CULLET_HOST_DEVICE static bool isHome(std::uint32_t idA, std::uint32_t idB)
    {
        return (idA | idB) >> kBeginsShift == kBeginsThere;
    }
};

/// @{
/// Numbers 2 * k and 2 * k + 1, in the lower and the upper half of a word, which a GPU loads and stores at once.
CULLET_HOST_DEVICE inline std::uint32_t loadTwo(const std::uint16_t* numbers, std::uint32_t k)
{
#ifdef __CUDA_ARCH__
    return reinterpret_cast<const std::uint32_t*>(numbers)[k];
#else
    return numbers[2 * k] | std::uint32_t{numbers[2 * k + 1]} << 16;
#endif
}
CULLET_HOST_DEVICE inline void storeTwo(std::uint16_t* numbers, std::uint32_t k, std::uint32_t two)
{
#ifdef __CUDA_ARCH__
    reinterpret_cast<std::uint32_t*>(numbers)[k] = two;
#else
    numbers[2 * k] = static_cast<std::uint16_t>(two);
    numbers[2 * k + 1] = static_cast<std::uint16_t>(two >> 16);
#endif
}
/// @}

/// Adds 1 to numbers[k], as other threads of the block do; returns its last value.
CULLET_HOST_DEVICE inline std::uint32_t countOne(std::uint16_t* numbers, std::uint32_t k)
{
#ifdef __CUDA_ARCH__
    const bool isOdd = k % 2 != 0;
    const std::uint32_t before =
        atomicAdd(reinterpret_cast<std::uint32_t*>(numbers) + k / 2, isOdd ? 0x10000u : 1u);
    return isOdd ? before >> 16 : before & 0xffffu;
#else
    return numbers[k]++;
#endif
}

/// Sorts the records of a tile.
///
/// @tparam Block  its threads call this together. forEach(n, body) and forEachOwned(n, body) call body(i) and
///                body(i, number) for each i < n, with a number that a thread keeps for i; sync() waits for all
///                threads, and exclusiveSum(value) sums up the values of previous threads
/// @param records [count] of the tile
/// @param sorted  [out]
template <class Block>
CULLET_HOST_DEVICE void sortTile(Block& block, const TileFrame& frame, const SortRecord* records,
                                 std::uint32_t count, std::uint32_t cells, const SortedTile& sorted)
{
    const std::uint32_t twos = SortedTile::twosFor(cells);
    block.forEach(twos, [&](std::uint32_t k) { storeTwo(sorted.starts, k, 0); });
    block.sync();
    block.forEachOwned(count,
                       [&](std::uint32_t i, std::uint32_t& ranked)
                       {
                           const std::uint32_t cell = frame.cellOf(frame.lowCorner(records[i]));
                           ranked = cell << 16 | countOne(sorted.starts, cell);
                       });
    block.sync();

    // Each thread sums up consecutive counts: an odd number of words, so that threads access different banks.
    const std::uint32_t part = (twos + block.threads() - 1) / block.threads() | 1u;
    const std::uint32_t first = block.thread() * part;
    const std::uint32_t last = first + part < twos ? first + part : twos;
    std::uint32_t sum = 0;
    for (std::uint32_t k = first; k < last; ++k)
    {
        const std::uint32_t counts = loadTwo(sorted.starts, k);
        sum += (counts & 0xffffu) + (counts >> 16);
    }
    std::uint32_t start = block.exclusiveSum(sum);
    for (std::uint32_t k = first; k < last; ++k)
    {
        const std::uint32_t counts = loadTwo(sorted.starts, k);
        const std::uint32_t odd = start + (counts & 0xffffu);
        storeTwo(sorted.starts, k, start | odd << 16);
        start = odd + (counts >> 16);
    }
    block.sync();

    block.forEachOwned(count,
                       [&](std::uint32_t i, std::uint32_t& ranked)
                       {
                           const SortRecord record = records[i];
                           const std::uint32_t slot = sorted.starts[ranked >> 16] + (ranked & 0xffffu);
                           sorted.boxes[slot] = {frame.lowCorner(record), frame.highCorner(record)};
                           sorted.ids[slot] = static_cast<std::uint16_t>(i | TileMark::begins(record.back.bin)
                                                                                 << SortedTile::kBeginsShift);
                       });
    block.sync();
}
}  // namespace cullet::psap
