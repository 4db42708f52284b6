// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/broad/grid/resting/verlet_pairs.h"
#include "cullet/broad/pairs/sorted_pairs.h"
#include "cullet/broad/row_pair.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// Which pairs of an active box are watched: all those with settled boxes that can come into the pair set, or leave it, while no
/// face of the box is farther than `reach` from where it was when the list was made.
///
/// That is a Verlet list (L. Verlet, Phys. Rev. 159, 98, 1967) with a shell of its own for each box.
struct NeighbourList
{
    /// Of a list that has to be made; what it holds are pairs of before.
    static constexpr float kUnmade = -1.0f;

    Aabb box;  ///< when the list was made
    float reach;
    std::uint32_t begin;  ///< [count] among the pairs of a NeighbourPart
    std::uint32_t count;
};

/// The lists of some active boxes, which one task at a time brings up to date.
struct alignas(64) NeighbourPart
{
    VerletPairs pairs;
    std::size_t goneCount = 0;       ///< of these
    std::vector<RowPair> strangers;  ///< held pairs that came into no list in this update
    bool hasStray = false;           ///< an active box is not where the list of active pairs knows it
    // Scratch:
    std::vector<std::uint32_t> stale;  ///< active boxes whose lists have to be made
    std::vector<Aabb> queries;         ///< [stale]
    std::vector<std::uint64_t> keys;   ///< held pairs of these, ascending: index in `stale`, row
    SortedPairs held;                  ///< the same, those left that were not met again

    void clear()
    {
        pairs.clear();
        goneCount = 0;
        beginUpdate();
    }

    void beginUpdate()
    {
        strangers.clear();
        hasStray = false;
        stale.clear();
        queries.clear();
        keys.clear();
    }

    std::uint64_t bytes() const
    {
        return pairs.bytes() + strangers.capacity() * sizeof(RowPair) +
               stale.capacity() * sizeof(std::uint32_t) + queries.capacity() * sizeof(Aabb) +
               keys.capacity() * sizeof(std::uint64_t) + held.bytes();
    }
};
}  // namespace cullet
