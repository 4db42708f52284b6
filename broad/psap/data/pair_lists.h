// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/broad/backend.h"
#include "cullet/broad/host_device.h"
#include "cullet/broad/psap/data/device_boxes.h"
#include "cullet/broad/row_pair.h"

#include <cstdint>

/// The changes of the pair set from one update to the next. Geometry decides: an overlapping pair enters when its old
/// boxes did not overlap, and a held pair leaves when its boxes separate. Only pairs that the old boxes do not decide
/// (held by the margin alone, or with changed filter words) are looked up in a table.
namespace cullet::psap
{
/// Lengths of the lists of one update.
struct ListCounts
{
    std::uint64_t added;    ///< pairs that enter; may exceed the number that was written
    std::uint64_t removed;  ///< pairs that leave
    std::uint64_t kept;     ///< pairs that stay
    std::uint64_t lookups;  ///< pairs in the look-up table; may exceed the number that was written
};

/// Counts of one update, contiguous so that one copy downloads them.
struct Counters
{
    ListCounts lists;
    std::uint64_t unboundedCount;  ///< unbounded boxes: without cells, tested against all others
};

/// Counters that the indices of an update share.
struct UpdateCounters
{
    Counters counters;
    /// As BoxHistory::motion. All indices read it, so that it does not share a cache line with the counters.
    alignas(128) std::uint32_t motion;
};

/// A list that many indices append to. The counter goes past the capacity, so that it reports the capacity needed.
struct PairList
{
    RowPair* pairs;
    std::uint64_t capacity;
    std::uint64_t* count;

    CULLET_HOST_DEVICE void push(RowPair pair) const
    {
        const std::uint64_t slot = claimSlot();
        if (slot < capacity)
            pairs[slot] = pair;
    }

    /// @return place for one pair; valid if it is below the capacity
    CULLET_HOST_DEVICE std::uint64_t claimSlot() const
    {
#ifdef __CUDA_ARCH__
        // The active lanes of the warp share one atomic.
        const unsigned lanes = __activemask();
        const unsigned lane = threadIdx.x & 31u;
        const int leader = __ffs(static_cast<int>(lanes)) - 1;
        unsigned long long base = 0;
        if (static_cast<int>(lane) == leader)
            base = fetchAdd(count, static_cast<std::uint64_t>(__popc(lanes)));
        base = __shfl_sync(lanes, base, leader);
        return base + static_cast<unsigned>(__popc(lanes & ((1u << lane) - 1u)));
#else
        return fetchAdd(count, std::uint64_t{1});
#endif
    }
};

/// A pair with a depth, or nothing.
struct DepthPair
{
    RowPair pair;
    float depth;
    bool isPair;
};

/// Pairs, and for each a lower bound of the depth by which its boxes overlap.
struct DepthList
{
    PairList pairs;
    float* depths;  ///< [pairs.capacity]

    CULLET_HOST_DEVICE void push(RowPair pair, float depth) const
    {
        const std::uint64_t slot = pairs.claimSlot();
        if (slot >= pairs.capacity)
            return;
        pairs.pairs[slot] = pair;
        depths[slot] = depth;
    }
};

/// A pair and the lists that it goes to.
struct RoutedPair
{
    RowPair pair = {};
    std::uint32_t to = 0;  ///< a bit for each list, list 0 the lowest

    CULLET_HOST_DEVICE bool isFor(std::uint32_t list) const { return (to >> list & 1u) != 0; }
};

/// Lists that a step appends to.
template <std::uint32_t kLists>
struct PairLists
{
    static constexpr std::uint32_t kCount = kLists;

    PairList lists[kCount];

    CULLET_HOST_DEVICE const PairList& at(std::uint32_t k) const { return lists[k]; }

    CULLET_HOST_DEVICE void push(const RoutedPair& routed) const
    {
        for (std::uint32_t list = 0; list < kCount; ++list)
        {
            if (routed.isFor(list))
                lists[list].push(routed.pair);
        }
    }
};

/// A set of pairs of rows: a hash table with linear probing, filled in one step and read in later ones.
struct LookupTable
{
    static constexpr std::uint64_t kFree = ~0ull;  // no pair of rows has this key

    std::uint64_t* slots;  ///< [mask + 1] kFree or a key
    std::uint64_t mask;    ///< power of two minus one
    std::uint64_t* count;  ///< goes past limit() where the table is too small; contains() is then void

    CULLET_HOST_DEVICE std::uint64_t limit() const { return (mask + 1) / 2; }

    CULLET_HOST_DEVICE static std::uint64_t keyOf(RowPair pair)
    {
        return pair.a < pair.b ? static_cast<std::uint64_t>(pair.a) << 32 | pair.b
                               : static_cast<std::uint64_t>(pair.b) << 32 | pair.a;
    }

    CULLET_HOST_DEVICE std::uint64_t home(std::uint64_t key) const
    {
        const std::uint64_t hash = key * 0x9E3779B97F4A7C15ull;
        return (hash ^ hash >> 32) & mask;
    }

    /// @pre the pair is not in the table
    CULLET_HOST_DEVICE void insert(RowPair pair) const
    {
        if (fetchAdd(count, std::uint64_t{1}) >= limit())
            return;
        const std::uint64_t key = keyOf(pair);
        std::uint64_t slot = home(key);
        while (compareExchange(&slots[slot], kFree, key) != kFree)
            slot = (slot + 1) & mask;
    }

    CULLET_HOST_DEVICE bool contains(RowPair pair) const
    {
        if (*count == 0)
            return false;
        const std::uint64_t key = keyOf(pair);
        for (std::uint64_t slot = home(key); slots[slot] != kFree; slot = (slot + 1) & mask)
        {
            if (slots[slot] == key)
                return true;
        }
        return false;
    }
};

/// The depth that two boxes can gain by moving so far in total, with a margin for rounding. Boxes that overlap by
/// more than this overlapped before.
CULLET_HOST_DEVICE inline float maxDepthGain(float distance)
{
    return 1.0001f * distance;
}

/// A lower bound of the depth before it was computed and rounded.
CULLET_HOST_DEVICE inline float depthLowerBound(float overlap)
{
    return overlap * (1 - 0x1p-22f);
}

/// A lower bound of the depth of two boxes after they have moved; positive: they still overlap.
///
/// @param gone result of maxDepthGain()
CULLET_HOST_DEVICE inline float remainingDepth(float depth, float gone)
{
    return depthLowerBound(depth - gone);
}

/// @param filters by row; null: every overlapping pair counts
CULLET_HOST_DEVICE inline bool passesFilters(const Filter* filters, RowPair pair)
{
    return filters == nullptr || passesFilter(filters[pair.a], filters[pair.b]);
}

/// The boxes of this update and of the previous one, by row; empty ones are emptyBox().
struct BoxHistory
{
    const Aabb* now;
    const Aabb* old;              ///< emptyBox() for rows that have a new proxy
    const Filter* filters;        ///< null: every overlapping pair counts
    const std::uint8_t* changes;  ///< RowChange bits of this update
    bool retestAll;               ///< filter words no longer count, so that old boxes decide nothing
    /// The longest distance that a face of a box has moved since the previous update, as bits of a float; infinite
    /// where a box is new or its filter words have changed. Null: unknown.
    const std::uint32_t* motion;

    /// Whether boxes that overlap by `depth` on every axis must have overlapped in the previous update.
    CULLET_HOST_DEVICE bool wereOverlapping(float depth) const { return depth > provenDepth(); }
    CULLET_HOST_DEVICE float provenDepth() const
    {
        return motion != nullptr ? maxDepthGain(2 * floatOf(*motion)) : kInfinity;
    }

    CULLET_HOST_DEVICE bool passesFilters(RowPair pair) const { return psap::passesFilters(filters, pair); }

    CULLET_HOST_DEVICE unsigned changesOf(RowPair pair) const
    {
        return static_cast<unsigned>(changes[pair.a]) | changes[pair.b];
    }

    /// Whether the old boxes do not decide if an overlapping pair is held.
    CULLET_HOST_DEVICE bool isUndecided(RowPair pair) const
    {
        if (retestAll)
            return true;
        // Two boxes that have not moved overlapped before as well.
        const unsigned bits = changesOf(pair);
        return bits != 0 &&
               ((bits & kRowRefiltered) != 0 || !overlaps(loadBox(old, pair.a), loadBox(old, pair.b)));
    }
};

/// An entry test that is skipped for boxes that overlap deeply, with the values that it needs only once already
/// loaded.
template <class Test>
struct DepthTest
{
    const Test& test;
    float provenDepth;  ///< boxes that overlap by more overlapped before

    /// @param depth callable; returns an upper bound of the overlap on every axis
    template <class Depth>
    CULLET_HOST_DEVICE bool operator()(RowPair pair, const Depth& depth) const
    {
        return !(depth() > provenDepth) && test(pair);
    }
    /// @param distance how far the two boxes have moved in total
    template <class Depth>
    CULLET_HOST_DEVICE bool operator()(RowPair pair, float distance, const Depth& depth) const
    {
        const float own = maxDepthGain(distance);
        return !(depth() > (own < provenDepth ? own : provenDepth)) && test(pair);
    }
};

/// Decides whether an overlapping pair enters in this update.
struct EntryTest
{
    BoxHistory boxes;
    LookupTable held;  ///< the undecided held pairs

    CULLET_HOST_DEVICE bool operator()(RowPair pair) const
    {
        return boxes.isUndecided(pair) && boxes.passesFilters(pair) && !held.contains(pair);
    }

    CULLET_HOST_DEVICE DepthTest<EntryTest> preloaded() const { return {*this, boxes.provenDepth()}; }
};

/// Decides whether the boxes of an overlapping pair were separated in the previous update.
struct WasSeparated
{
    const AlignedBox* old;
    const std::uint32_t* motion;  ///< as BoxHistory::motion

    CULLET_HOST_DEVICE bool operator()(RowPair pair) const
    {
        return !overlaps(loadBox(old, pair.a), loadBox(old, pair.b));
    }
    CULLET_HOST_DEVICE DepthTest<WasSeparated> preloaded() const
    {
        return {*this, maxDepthGain(2 * floatOf(*motion))};
    }
};

/// Accepts every overlapping pair, for callers that want the pair set itself.
struct EveryPair
{
    CULLET_HOST_DEVICE EveryPair preloaded() const { return *this; }
    CULLET_HOST_DEVICE bool operator()(RowPair) const { return true; }
    template <class Depth>
    CULLET_HOST_DEVICE bool operator()(RowPair, const Depth&) const
    {
        return true;
    }
    template <class Depth>
    CULLET_HOST_DEVICE bool operator()(RowPair, float, const Depth&) const
    {
        return true;
    }
};

/// Frees a slot of the look-up table.
struct FreeSlot
{
    std::uint64_t* slots;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const { slots[i] = LookupTable::kFree; }
};

/// Rows `first` to `last`.
struct RowSpan
{
    std::uint32_t first, last;

    CULLET_HOST_DEVICE bool contains(std::uint32_t row) const { return row >= first && row <= last; }
};
inline constexpr RowSpan kAllRows = {0, 0xffffffffu};

/// Decides about held pair i: it stays, possibly undecided, or it leaves. A pair whose depth exceeds what the motion
/// can have undone stays without a load of its boxes; it overlapped in the previous update too, and so is decided.
///
/// Several steps may share the pairs. Each decides about those whose higher row lies in its span, once the rows up to
/// there are in place. BoxHistory::motion may not include later rows yet: it only has to include both rows of the
/// pair.
struct SettleHeld
{
    const RowPair* held;
    const float* depths;  ///< as in DepthList; null: unknown
    BoxHistory boxes;
    float margin;
    bool canSkipUnchanged;  ///< the margin has not become smaller: pairs without a changed row stay
    RowSpan span;
    LookupTable undecided;

    CULLET_HOST_DEVICE DepthPair read(std::uint64_t i) const
    {
        return {held[i], depths != nullptr ? depths[i] : 0.0f, true};
    }

    /// @param kept    list of the pairs that stay
    /// @param removed list of the pairs that leave
    template <class Kept, class Removed>
    CULLET_HOST_DEVICE void operator()(const DepthPair& item, Kept& kept, Removed& removed) const
    {
        const RowPair pair = item.pair;
        const bool isMine = item.isPair && span.contains(pair.a > pair.b ? pair.a : pair.b);
        float depth = remainingDepth(item.depth, boxes.provenDepth());
        const bool isStaying = isMine && (depth > 0 || stays(item, depth));
        kept.append(isStaying, pair, depth);
        removed.append(isMine && !isStaying, pair);
    }

private:
    /// @param depth [out]
    CULLET_HOST_DEVICE bool stays(const DepthPair& item, float& depth) const
    {
        const RowPair pair = item.pair;
        depth = item.depth;
        if (canSkipUnchanged && !boxes.retestAll && boxes.changesOf(pair) == 0)
            return true;
        const Aabb a = loadBox(boxes.now, pair.a);
        const Aabb b = loadBox(boxes.now, pair.b);
        // Empty boxes first: overlapsWithMargin() returns true for NaN.
        if (!isValid(a) || !isValid(b) || !overlapsWithMargin(a, b, margin))
            return false;
        const float overlap = overlapOf(a, b);
        if (needsLookup(pair, overlap))
            undecided.insert(pair);
        depth = depthLowerBound(overlap);
        return true;
    }

    CULLET_HOST_DEVICE bool needsLookup(RowPair pair, float overlap) const
    {
        // The search does not look up pairs that it does not find, or that the old boxes decide.
        return overlap >= 0 && !boxes.wereOverlapping(overlap) && boxes.isUndecided(pair);
    }
};
}  // namespace cullet::psap
