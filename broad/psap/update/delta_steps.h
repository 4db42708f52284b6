// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/host_device.h"
#include "cullet/broad/pair.h"
#include "cullet/broad/psap/data/pair_lists.h"
#include "cullet/broad/row_pair.h"

#include <algorithm>
#include <cstdint>

/// The steps that convert the changes of an update to pairs of unique ids, and sort them.
namespace cullet::psap
{
/// Packs a pair of unique ids into one integer with the order of Pair, as short as the ids allow, so that sorts need
/// fewer passes.
struct IdBits
{
    std::uint32_t bits;  ///< bits of an id

    static IdBits forIds(std::uint32_t largest) { return {std::max(bitWidthOf(largest), 1u)}; }

    int keyBits() const { return static_cast<int>(2 * bits); }

    CULLET_HOST_DEVICE Pair pairOf(std::uint64_t key) const
    {
        const std::uint64_t mask = (1ull << bits) - 1;
        return {static_cast<std::uint32_t>(key >> bits & mask), static_cast<std::uint32_t>(key & mask)};
    }
};

/// Numbers of the pairs that enter and of those that leave, or of the places for them. Pairs that enter come first.
struct ChangeCounts
{
    std::uint64_t added, removed;

    CULLET_HOST_DEVICE std::uint64_t total() const { return added + removed; }

    CULLET_HOST_DEVICE ChangeCounts atMost(ChangeCounts room) const
    {
        return {added < room.added ? added : room.added, removed < room.removed ? removed : room.removed};
    }
};

/// The lists of an update, in an executor's memory.
struct ChangeLists
{
    const RowPair* added;
    std::uint64_t addedRoom;
    const RowPair* removed;
    RowPair* kept;      ///< the pairs that enter are appended to those that stay
    float* keptDepths;  ///< 0 for the pairs that enter: unknown
    std::uint64_t keptRoom;
    LookupTable table;
    const Counters* counters;
    const std::uint32_t* unboundedCount;
    const std::uint32_t* uniqueIds;  ///< by row
    UpdateCounters* next;            ///< counters of the next update, which this step clears

    /// Whether no list was too short, so that the search need not be repeated.
    CULLET_HOST_DEVICE bool areComplete(const ListCounts& counts) const
    {
        return counts.added <= addedRoom && counts.lookups <= table.limit();
    }

    /// Number of changes to be sorted.
    CULLET_HOST_DEVICE ChangeCounts sortedCounts(ChangeCounts room) const
    {
        const ListCounts counts = counters->lists;
        if (!areComplete(counts))
            return {0, 0};
        return ChangeCounts{counts.added, counts.removed}.atMost(room);
    }
};

/// Memory of the CPU that the executor writes the sorted changes to.
struct SortedChanges
{
    Pair *added, *removed;  ///< room for the expected number of pairs
};

/// What the device reports of an update beside the changes.
struct UpdateReport
{
    Counters counters;
    std::uint32_t isOverfull;  ///< a bucket had too many changes: they are not in order
};

/// Sorts the changes of an update into buckets by kind and first id. Buckets are so small that the changes of each
/// are compared with each other, which takes half the time of a radix sort.
struct ChangeBuckets
{
    /// The buckets of the added or of the removed pairs.
    struct Kind
    {
        std::uint32_t first, last;
        std::uint32_t shift;  ///< 2^shift first ids share a bucket
    };

    Kind added, removed;
    /// Expected least first id. Smaller ids belong to the first bucket, ids past the last bucket to the last one.
    std::uint32_t leastId;
    std::uint32_t* counts;        ///< [count()] number of changes, 0 before and after an update
    const std::uint32_t* starts;  ///< [count()] number of changes in earlier buckets
    std::uint32_t* ranks;         ///< [room] rank of a change in its bucket

    CULLET_HOST_DEVICE std::uint32_t count() const { return removed.last + 1; }

    CULLET_HOST_DEVICE std::uint32_t bucketOf(bool isRemoved, std::uint32_t firstId) const
    {
        const Kind& kind = isRemoved ? removed : added;
        const std::uint32_t steps = firstId < leastId ? 0 : (firstId - leastId) >> kind.shift;
        const std::uint32_t most = kind.last - kind.first;
        return kind.first + (steps < most ? steps : most);
    }
};

/// What follows the search, in one launch, since each part would take longer to start than to run: converts the
/// changes to keys of unique ids, appends the pairs that enter to the held pairs, frees the look-up table, and
/// reports the counts. Index i processes change i and slot i.
struct CloseUpdate
{
    ChangeLists lists;
    IdBits bits;
    ChangeCounts room;
    std::uint64_t* keys;    ///< [room, out] larger than any key where there is no change
    ChangeBuckets buckets;  ///< [out] counts and ranks; its counts are null where only keys are needed
    std::uint32_t* ranks;   ///< [room, out] 0, for RankChange; null: not needed
    UpdateReport* report;   ///< [out]

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const ListCounts counts = lists.counters->lists;
        const bool isComplete = lists.areComplete(counts);
        if (i == 0)
            reportCounts();
        if (i <= lists.table.mask && isComplete)
            lists.table.slots[i] = LookupTable::kFree;
        if (i >= room.total())
            return;
        if (ranks != nullptr)
            ranks[i] = 0;
        const bool isRemoved = i >= room.added;
        const std::uint64_t k = isRemoved ? i - room.added : i;
        if (!isComplete || k >= (isRemoved ? counts.removed : counts.added))
        {
            keys[i] = ~0ull;
            return;
        }
        const RowPair pair = isRemoved ? lists.removed[k] : lists.added[k];
        if (!isRemoved && counts.kept + k < lists.keptRoom)
        {
            lists.kept[counts.kept + k] = pair;
            lists.keptDepths[counts.kept + k] = 0;
        }
        writeKey(i, isRemoved, pair);
    }

private:
    CULLET_HOST_DEVICE void reportCounts() const
    {
        report->counters = *lists.counters;
        report->counters.unboundedCount = *lists.unboundedCount;
        report->isOverfull = 0;
        *lists.next = {};
    }

    CULLET_HOST_DEVICE void writeKey(std::uint64_t i, bool isRemoved, RowPair pair) const
    {
        const std::uint32_t a = lists.uniqueIds[pair.a];
        const std::uint32_t b = lists.uniqueIds[pair.b];
        const std::uint32_t first = a < b ? a : b;
        keys[i] = std::uint64_t{first} << bits.bits | (a < b ? b : a);
        if (buckets.counts != nullptr)
            buckets.ranks[i] = fetchAdd(&buckets.counts[buckets.bucketOf(isRemoved, first)], 1u);
    }
};

/// Changes sorted by bucket.
struct BucketOrder
{
    ChangeLists lists;
    IdBits bits;
    ChangeCounts room;
    ChangeBuckets buckets;

    CULLET_HOST_DEVICE ChangeCounts counts() const { return lists.sortedCounts(room); }

    CULLET_HOST_DEVICE std::uint32_t bucketOf(bool isRemoved, std::uint64_t key) const
    {
        return buckets.bucketOf(isRemoved, bits.pairOf(key).first);
    }
};

/// Writes change i to its bucket, and clears the counter of bucket i.
struct FillBucket
{
    BucketOrder order;
    const std::uint64_t* keys;  ///< [room] from CloseUpdate
    std::uint64_t* byBucket;    ///< [changes, out]

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        if (i < order.buckets.count())
            order.buckets.counts[i] = 0;
        const ChangeCounts counts = order.counts();
        const bool isRemoved = i >= order.room.added;
        const std::uint64_t k = isRemoved ? i - order.room.added : i;
        if (i < order.room.total() && k < (isRemoved ? counts.removed : counts.added))
            byBucket[order.buckets.starts[order.bucketOf(isRemoved, keys[i])] + order.buckets.ranks[i]] =
                keys[i];
    }
};

/// Sorts change i within its bucket.
struct OrderBucket
{
    /// Number of changes from which on a bucket is overfull.
    static constexpr std::uint64_t kOverfull = 48;

    BucketOrder order;
    const std::uint64_t* byBucket;  ///< [changes] from FillBucket
    SortedChanges changes;          ///< [out] void where a bucket is overfull
    UpdateReport* report;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const ChangeCounts counts = order.counts();
        const bool isRemoved = i >= counts.added;
        const std::uint64_t begin = isRemoved ? counts.added : 0;
        const std::uint64_t end = isRemoved ? counts.total() : counts.added;
        if (i >= end)
            return;
        const std::uint64_t key = byBucket[i];
        const std::uint32_t bucket = order.bucketOf(isRemoved, key);
        const auto isInBucket = [&](std::uint64_t k)
        { return order.bucketOf(isRemoved, byBucket[k]) == bucket; };
        std::uint64_t smaller = 0;
        std::uint64_t first = i;
        for (; first > begin && i - first < kOverfull && isInBucket(first - 1); --first)
            smaller += byBucket[first - 1] < key ? 1 : 0;
        std::uint64_t last = i + 1;
        for (; last < end && last - first < kOverfull && isInBucket(last); ++last)
            smaller += byBucket[last] < key ? 1 : 0;
        if (last - first >= kOverfull)
            storeSameValue(&report->isOverfull, 1u);
        else
            (isRemoved ? changes.removed : changes.added)[first - begin + smaller] = order.bits.pairOf(key);
    }
};

/// Sorts few changes without buckets: compares each with all others of its kind. Each change has kShares indices,
/// which add up the numbers of smaller changes that they find; the last one to add writes the change to its place.
struct RankChange
{
    static constexpr std::uint32_t kShares = 16;
    static constexpr std::uint32_t kMost = 1u << 27;  ///< most changes for which the sum does not overflow

    ChangeLists lists;
    IdBits bits;
    ChangeCounts room;          ///< at most kMost
    const std::uint64_t* keys;  ///< [room] from CloseUpdate
    std::uint32_t* ranks;       ///< [room] 0 before
    SortedChanges changes;      ///< [out]

    std::uint64_t indices() const { return room.total() * kShares; }

    CULLET_HOST_DEVICE void operator()(std::uint64_t index) const
    {
        // The lanes of a warp have the same share, so that all of them load the same key at a time.
        const auto all = static_cast<std::uint32_t>(room.total());
        const std::uint32_t share = static_cast<std::uint32_t>(index) / all;
        const std::uint32_t i = static_cast<std::uint32_t>(index) % all;
        const ChangeCounts counts = lists.sortedCounts(room);
        const bool isRemoved = i >= room.added;
        const std::uint64_t* const sameKind = keys + (isRemoved ? room.added : 0);
        const auto count = static_cast<std::uint32_t>(isRemoved ? counts.removed : counts.added);
        const std::uint32_t k = isRemoved ? i - static_cast<std::uint32_t>(room.added) : i;
        if (k >= count)
            return;
        const std::uint64_t key = sameKind[k];
        const std::uint32_t each = (count + kShares - 1) / kShares;
        const std::uint32_t begin = share * each;
        const std::uint32_t end = begin + each < count ? begin + each : count;
        std::uint32_t smaller = 0;
        for (std::uint32_t other = begin; other < end; ++other)
            smaller += sameKind[other] < key ? 1 : 0;
        // The low bits of the sum count the shares that have been added.
        const std::uint32_t before = fetchAdd(&ranks[i], smaller * kShares + 1);
        if (before % kShares == kShares - 1)
            (isRemoved ? changes.removed : changes.added)[before / kShares + smaller] = bits.pairOf(key);
    }
};

/// Unpacks key i.
struct UnpackKey
{
    const std::uint64_t* keys;  ///< [room] sorted; those of the pairs that enter come first
    IdBits bits;
    ChangeCounts room;
    SortedChanges changes;  ///< [room, out]

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        Pair* const to = i < room.added ? changes.added + i : changes.removed + (i - room.added);
        *to = bits.pairOf(keys[i]);
    }
};
}  // namespace cullet::psap
