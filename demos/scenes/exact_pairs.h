// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/broad/pair.h"
#include "cullet/demos/scenes/splitmix64.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// A set of pairs as a number of pairs and a hash that does not depend on their order. Equal sets compare equal; a
/// duplicate or a missing pair changes both members.
struct PairDigest
{
    std::uint64_t count = 0;
    std::uint64_t hash = 0;

    void add(Pair pair) noexcept
    {
        ++count;
        hash += splitMix(pairKey(pair));
    }
};

inline bool operator==(const PairDigest& a, const PairDigest& b) noexcept
{
    return a.count == b.count && a.hash == b.hash;
}

inline bool operator!=(const PairDigest& a, const PairDigest& b) noexcept
{
    return !(a == b);
}

/// A box in double, to which floats convert exactly.
struct ExactBox
{
    double min[3];
    double max[3];
};

ExactBox toExactBox(const Aabb& box) noexcept;

inline bool overlaps(const ExactBox& a, const ExactBox& b) noexcept
{
    return a.min[0] <= b.max[0] && b.min[0] <= a.max[0] && a.min[1] <= b.max[1] && b.min[1] <= a.max[1] &&
           a.min[2] <= b.max[2] && b.min[2] <= a.max[2];
}

/// All pairs of rows whose closed boxes overlap, sorted: the reference of the demos and benchmarks.
///
/// Sort by min x and sweep, sharing no code with the backends. O(n log n + pairs of overlapping x intervals). Inverted
/// boxes and boxes with a NaN overlap nothing.
Pairs findExactPairs(const std::vector<ExactBox>& boxes);
}  // namespace cullet
