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
/// The pairs of an awake box with resting boxes that can enter or leave the pair set while no face of the box is
/// farther than `skin` from where it was when the list was made.
///
/// This is a Verlet list (L. Verlet, Phys. Rev. 159, 98, 1967) with a skin of its own for each box.
struct NeighbourList
{
    /// Value of `skin` for a list that has to be made; the list still holds its former pairs.
    static constexpr float kUnmade = -1.0f;

    Aabb box;  ///< the box when the list was made
    float skin;
    std::uint32_t begin;  ///< [count] among the pairs of a NeighbourPart
    std::uint32_t count;
};

/// The lists of some awake boxes, which one task at a time updates.
struct alignas(64) NeighbourPart
{
    VerletPairs pairs;
    std::size_t expiredCount = 0;        ///< expired ones of `pairs`
    std::vector<RowPair> unlistedPairs;  ///< held pairs that this update added to no list
    bool hasLeftSkin = false;            ///< an awake box left the skin of the list of awake pairs
    // Scratch:
    std::vector<std::uint32_t> stale;  ///< awake boxes whose lists have to be made
    std::vector<Aabb> queries;         ///< [stale]
    std::vector<std::uint64_t> keys;   ///< held pairs of stale lists, ascending: index in `stale`, row
    SortedPairs held;                  ///< those of `keys` that the query has not found yet

    void clear()
    {
        pairs.clear();
        expiredCount = 0;
        beginUpdate();
    }

    void beginUpdate()
    {
        unlistedPairs.clear();
        hasLeftSkin = false;
        stale.clear();
        queries.clear();
        keys.clear();
    }

    std::uint64_t bytes() const
    {
        return pairs.bytes() + unlistedPairs.capacity() * sizeof(RowPair) +
               stale.capacity() * sizeof(std::uint32_t) + queries.capacity() * sizeof(Aabb) +
               keys.capacity() * sizeof(std::uint64_t) + held.bytes();
    }
};
}  // namespace cullet
