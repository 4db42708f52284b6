// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/delta_counts.h"
#include "cullet/broad/host_device.h"
#include "cullet/broad/row_pair.h"
#include "cullet/cuda/narrow/pair_steps.h"

#include <cstdint>

/// Merges the changes of a list of pairs into it: the pairs stay in ascending order, and what is known of each goes with
/// it. Launches depend on the rooms of the lists alone, so that the CPU need not know how many pairs there are.
namespace cullet::contacts
{
/// In the place of a change: none. It comes after all others.
inline constexpr std::uint64_t kNoKey = ~std::uint64_t{0};
/// In the place of the length of a list: its changes were void, or there was no room for it.
inline constexpr std::uint64_t kVoidList = ~std::uint64_t{0};

/// The order of changes: by the lower row, then by the other one, and whether the pair enters.
struct ChangeOrder
{
    int bits;  ///< of a row, which is not all ones

    CULLET_HOST_DEVICE std::uint64_t keyOf(RowPair pair, bool isAdded) const
    {
        const std::uint64_t low = pair.a < pair.b ? pair.a : pair.b, high = pair.a < pair.b ? pair.b : pair.a;
        return low << (bits + 1) | high << 1 | (isAdded ? 1u : 0u);
    }
    CULLET_HOST_DEVICE RowPair pairOf(std::uint64_t key) const
    {
        const std::uint64_t high = key >> 1 & ((std::uint64_t{1} << bits) - 1);
        return {static_cast<std::uint32_t>(key >> (bits + 1)), static_cast<std::uint32_t>(high)};
    }
    int bitsOfKey() const { return 2 * bits + 1; }
};

/// The changes of a list as a DeltaSearch has found them.
struct FoundChanges
{
    const RowPair* added = nullptr;  ///< [addedRoom]
    std::uint64_t addedRoom = 0;
    const RowPair* removed = nullptr;
    const DeltaCounts* counts = nullptr;
    std::uint64_t room = 0;  ///< most changes that are merged

    /// @return false if they are void or more than there is room for, and have to be merged later
    CULLET_HOST_DEVICE bool areUsable() const
    {
        return counts->added <= addedRoom && counts->added + counts->removed <= room;
    }
    CULLET_HOST_DEVICE std::uint64_t count() const
    {
        return areUsable() ? counts->added + counts->removed : 0;
    }
};

/// Writes the key of a change, or kNoKey.
struct KeyOfChange
{
    FoundChanges changes;
    ChangeOrder order;
    std::uint64_t* keys;  ///< [changes.room]

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const std::uint64_t added = changes.counts->added;
        if (i >= changes.count())
            keys[i] = kNoKey;
        else if (i < added)
            keys[i] = order.keyOf(changes.added[i], true);
        else
            keys[i] = order.keyOf(changes.removed[i - added], false);
    }
};

/// Writes 1 for a pair that enters, else 0.
struct CountAdded
{
    const std::uint64_t* keys;  ///< [room] sorted
    std::uint64_t room;
    std::uint32_t* isAdded;  ///< [room + 1]

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        isAdded[i] = i < room && keys[i] != kNoKey ? static_cast<std::uint32_t>(keys[i] & 1u) : 0u;
    }
};

/// A list of pairs and what is known of each.
struct RememberedPairs
{
    RowPair* pairs = nullptr;  ///< [room] ascending; {kNoRow, kNoRow} from the length on
    convex::PairMemory memory;
    std::uint64_t* count = nullptr;  ///< its length, or kVoidList
    std::uint64_t room = 0;

    CULLET_HOST_DEVICE void forget(std::uint64_t place, RowPair pair) const
    {
        pairs[place] = pair;
        memory.clear(place);
    }
};

/// The places of pairs before and after the changes.
struct MergeOrder
{
    FoundChanges changes;
    ChangeOrder order;
    const std::uint64_t* keys;         ///< [changes.room] sorted
    const std::uint32_t* addedBefore;  ///< [changes.room + 1] sum of CountAdded
    RememberedPairs from, to;

    /// First place in [0, count) whose number is not less; numberAt() ascends.
    template <class NumberAt>
    CULLET_HOST_DEVICE static std::uint64_t lowerBound(std::uint64_t count, std::uint64_t number,
                                                       const NumberAt& numberAt)
    {
        std::uint64_t first = 0;
        while (count > 0)
        {
            const std::uint64_t half = count / 2;
            const bool isAfter = numberAt(first + half) < number;
            first = isAfter ? first + half + 1 : first;
            count = isAfter ? count - half - 1 : half;
        }
        return first;
    }

    /// Of a pair of the list, or of one that enters.
    ///
    /// @param inList  pairs of the list before it
    /// @param changed changes before it
    CULLET_HOST_DEVICE std::uint64_t placeAfter(std::uint64_t inList, std::uint64_t changed) const
    {
        return inList + 2 * std::uint64_t{addedBefore[changed]} - changed;
    }
    /// Length of the new list.
    CULLET_HOST_DEVICE std::uint64_t countAfter() const { return placeAfter(*from.count, changes.count()); }
};

/// Moves pair i of the list to its new place, unless it leaves, and clears place i of the new one where it has no pair.
struct KeepPairs
{
    MergeOrder merge;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const std::uint64_t after = merge.countAfter();
        if (i == 0)
            *merge.to.count = merge.changes.areUsable() && after <= merge.to.room ? after : kVoidList;
        if (i >= after && i < merge.to.room)
            merge.to.forget(i, {kNoRow, kNoRow});
        if (i < *merge.from.count)
            keep(i);
    }

private:
    CULLET_HOST_DEVICE void keep(std::uint64_t i) const
    {
        const RowPair pair = merge.from.pairs[i];
        const std::uint64_t key = merge.order.keyOf(pair, false), count = merge.changes.count();
        const std::uint64_t changed =
            MergeOrder::lowerBound(count, key, [&](std::uint64_t k) { return merge.keys[k]; });
        const bool isRemoved = changed < count && merge.keys[changed] == key;
        const std::uint64_t place = merge.placeAfter(i, changed);
        if (isRemoved || place >= merge.to.room)
            return;
        merge.to.pairs[place] = pair;
        merge.to.memory.copy(place, merge.from.memory, i);
    }
};

/// Puts the pair of change i into its place, if it enters.
struct AddPairs
{
    MergeOrder merge;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const std::uint64_t key = merge.keys[i];
        if (key == kNoKey || (key & 1u) == 0)
            return;
        const std::uint64_t inList = MergeOrder::lowerBound(
            *merge.from.count, key,
            [&](std::uint64_t k) { return merge.order.keyOf(merge.from.pairs[k], false); });
        const std::uint64_t place = merge.placeAfter(inList, i);
        if (place < merge.to.room)
            merge.to.forget(place, merge.order.pairOf(key));
    }
};
}  // namespace cullet::contacts
