// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/array.h"
#include "cullet/broad/box_memory.h"

#include <cstdint>

namespace cullet
{
/// Two proxies by their unique ids, first < second.
struct Pair
{
    std::uint32_t first;
    std::uint32_t second;
};

inline bool operator==(Pair a, Pair b) noexcept
{
    return a.first == b.first && a.second == b.second;
}

inline bool operator!=(Pair a, Pair b) noexcept
{
    return !(a == b);
}

inline bool operator<(Pair a, Pair b) noexcept
{
    return a.first != b.first ? a.first < b.first : a.second < b.second;
}

/// The pair of two different ids in the order that Pair demands.
inline Pair makePair(std::uint32_t a, std::uint32_t b) noexcept
{
    // Compilers turn a comparison here into a branch, which is not predictable.
    const std::uint32_t swap = (a ^ b) & (0u - static_cast<std::uint32_t>(b < a));
    return {a ^ swap, b ^ swap};
}

/// One integer per pair, ordered as operator<.
inline std::uint64_t pairKey(Pair pair) noexcept
{
    return static_cast<std::uint64_t>(pair.first) << 32 | pair.second;
}

inline Pair pairOfKey(std::uint64_t key) noexcept
{
    return {static_cast<std::uint32_t>(key >> 32), static_cast<std::uint32_t>(key)};
}

/// List of pairs, in memory that a device may write into directly.
using Pairs = Array<Pair, BoxAllocator<Pair>>;

/// What changed between two updates of a backend: both lists sorted by (first, second), unique, disjoint.
struct PairDelta
{
    Pairs added;
    Pairs removed;

    void clear() noexcept
    {
        added.clear();
        removed.clear();
    }
};
}  // namespace cullet
