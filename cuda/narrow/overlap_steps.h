// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/host_device.h"
#include "cullet/cuda/narrow/pair_types.h"

#include <cstdint>

/// Lists the pairs that overlap in the order of all pairs: count, sum, fill.
namespace cullet::convex
{
/// Pairs whose states one index reads.
inline constexpr std::uint32_t kPairsPerChunk = 64;

inline std::uint32_t chunksOf(std::uint32_t pairs)
{
    return static_cast<std::uint32_t>((std::uint64_t{pairs} + kPairsPerChunk - 1) / kPairsPerChunk);
}

/// Calls body(pair) for each pair of a chunk that overlaps, in order.
template <class Body>
CULLET_HOST_DEVICE inline void forEachOverlap(const PairState* states, std::uint32_t count,
                                              std::uint64_t chunk, const Body& body)
{
    const std::uint64_t first = chunk * kPairsPerChunk, end = first + kPairsPerChunk;
    for (std::uint64_t pair = first; pair < (end < count ? end : count); ++pair)
    {
        if (states[pair] == PairState::Overlapping)
            body(static_cast<std::uint32_t>(pair));
    }
}

struct CountOverlaps
{
    const PairState* states;  ///< [count]
    std::uint32_t count;
    std::uint32_t* inChunk;  ///< [out, chunks + 1], the last is 0

    CULLET_HOST_DEVICE void operator()(std::uint64_t chunk) const
    {
        std::uint32_t found = 0;
        forEachOverlap(states, count, chunk, [&](std::uint32_t) { ++found; });
        inChunk[chunk] = found;
    }
};

struct ListOverlaps
{
    const PairState* states;  ///< [count]
    std::uint32_t count;
    const std::uint32_t* before;  ///< [chunks + 1] overlapping pairs before each chunk
    std::uint32_t* overlaps;      ///< [out, count]

    CULLET_HOST_DEVICE void operator()(std::uint64_t chunk) const
    {
        if (chunk * kPairsPerChunk >= count)
            return;
        std::uint32_t place = before[chunk];
        forEachOverlap(states, count, chunk, [&](std::uint32_t pair) { overlaps[place++] = pair; });
    }
};
}  // namespace cullet::convex
