// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/host_device.h"
#include "cullet/broad/pair.h"
#include "cullet/broad/psap/data/pair_lists.h"
#include "cullet/broad/row_pair.h"

#include <algorithm>
#include <cstdint>

/// How the changes of an update get their names and their order: the steps.
namespace cullet::psap
{
/// How a pair of unique ids makes one integer of Pair's order: no longer than the ids need, for the sake of sorting.
struct IdBits
{
    std::uint32_t bits;  ///< of an id

    static IdBits forIds(std::uint32_t largest) { return {std::max(bitCountOf(largest), 1u)}; }

    int keyBits() const { return static_cast<int>(2 * bits); }

    CULLET_HOST_DEVICE Pair pairOf(std::uint64_t key) const
    {
        const std::uint64_t mask = (1ull << bits) - 1;
        return {static_cast<std::uint32_t>(key >> bits & mask), static_cast<std::uint32_t>(key & mask)};
    }
};

/// Numbers of the pairs that enter and of those that leave; or room for them, first the ones, then the others.
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
    RowPair* kept;      ///< the pairs that enter go behind those that stay
    float* keptDepths;  ///< 0 for those, not known yet
    std::uint64_t keptRoom;
    LookupTable table;
    const Counters* counters;
    const std::uint32_t* sides;
    const std::uint32_t* uniqueIds;  ///< by row
    Tally* next;                     ///< of the next update: set to 0

    /// Whether nothing was left out for want of room, so that the search need not run again.
    CULLET_HOST_DEVICE bool areComplete(const ListCounts& counts) const
    {
        return counts.added <= addedRoom && counts.lookups <= table.limit();
    }

    /// How many changes there are to be put in order.
    CULLET_HOST_DEVICE ChangeCounts namedCounts(ChangeCounts room) const
    {
        const ListCounts counts = counters->lists;
        if (!areComplete(counts))
            return {0, 0};
        return ChangeCounts{counts.added, counts.removed}.atMost(room);
    }
};

/// Where changes are told in order: memory of the CPU that an executor may write to.
struct NamedChanges
{
    Pair *added, *removed;  ///< room for as many as are expected
};

/// What an update tells of itself beside the changes.
struct UpdateReport
{
    Counters counters;
    std::uint32_t isOverfull;  ///< a bucket of changes was: they are not in order
};

/// The changes of an update in buckets by kind and first id, so few in each that they are put in order one by one: half of
/// the time of a radix sort.
struct ChangeBuckets
{
    /// Those of a kind.
    struct Kind
    {
        std::uint32_t first, last;
        std::uint32_t shift;  ///< 2^shift first ids share a bucket
    };

    Kind added, removed;
    std::uint32_t
        leastId;  ///< of the first ids; smaller ones belong to the first bucket, larger ones to the last
    std::uint32_t* counts;        ///< [count()] changes, 0 before an update and after it
    const std::uint32_t* starts;  ///< [count()] changes in the buckets before
    std::uint32_t* ranks;         ///< [room] of a change in its bucket

    CULLET_HOST_DEVICE std::uint32_t count() const { return removed.last + 1; }

    CULLET_HOST_DEVICE std::uint32_t bucketOf(bool isRemoved, std::uint32_t firstId) const
    {
        const Kind& kind = isRemoved ? removed : added;
        const std::uint32_t steps = firstId < leastId ? 0 : (firstId - leastId) >> kind.shift;
        const std::uint32_t most = kind.last - kind.first;
        return kind.first + (steps < most ? steps : most);
    }
};

/// What follows the search, in one launch, since each part would take longer to start than to run: names the changes by
/// unique ids, appends the pairs that enter to those that are held, frees the look-up table, and reports the counts. Index
/// i does change i and slot i.
struct CloseUpdate
{
    ChangeLists lists;
    IdBits bits;
    ChangeCounts room;
    std::uint64_t* keys;    ///< [room, out] where there is no change, more than any key
    ChangeBuckets buckets;  ///< [out] counts and ranks; null: keys alone
    std::uint32_t* ranks;   ///< [room, out] 0, as RankChange wants them; null: not wanted
    UpdateReport* report;   ///< [out]

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const ListCounts counts = lists.counters->lists;
        const bool isComplete = lists.areComplete(counts);
        if (i == 0)
            tellCounts();
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
        name(i, isRemoved, pair);
    }

private:
    CULLET_HOST_DEVICE void tellCounts() const
    {
        report->counters = *lists.counters;
        report->counters.side = *lists.sides;
        report->isOverfull = 0;
        *lists.next = {};
    }

    CULLET_HOST_DEVICE void name(std::uint64_t i, bool isRemoved, RowPair pair) const
    {
        const std::uint32_t a = lists.uniqueIds[pair.a];
        const std::uint32_t b = lists.uniqueIds[pair.b];
        const std::uint32_t first = a < b ? a : b;
        keys[i] = std::uint64_t{first} << bits.bits | (a < b ? b : a);
        if (buckets.counts != nullptr)
            buckets.ranks[i] = fetchAdd(&buckets.counts[buckets.bucketOf(isRemoved, first)], 1u);
    }
};

/// Changes in the order of their buckets.
struct BucketOrder
{
    ChangeLists lists;
    IdBits bits;
    ChangeCounts room;
    ChangeBuckets buckets;

    CULLET_HOST_DEVICE ChangeCounts counts() const { return lists.namedCounts(room); }

    CULLET_HOST_DEVICE std::uint32_t bucketOf(bool isRemoved, std::uint64_t key) const
    {
        return buckets.bucketOf(isRemoved, bits.pairOf(key).first);
    }
};

/// Puts change i to those of its bucket, and empties bucket i.
struct FillBucket
{
    BucketOrder order;
    const std::uint64_t* keys;  ///< [room] of CloseUpdate
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

/// Puts change i of those by bucket in order.
struct OrderBucket
{
    /// So many changes in a bucket are too many.
    static constexpr std::uint64_t kOverfull = 48;

    BucketOrder order;
    const std::uint64_t* byBucket;  ///< [changes] of FillBucket
    NamedChanges changes;           ///< [out] void where a bucket is overfull
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
            setAlike(&report->isOverfull, 1u);
        else
            (isRemoved ? changes.removed : changes.added)[first - begin + smaller] = order.bits.pairOf(key);
    }
};

/// Puts changes in order where there are few: each is compared with all others of its kind, and no buckets. For each there are
/// kShares indices, which add up what they find; the last to do so knows its place.
struct RankChange
{
    static constexpr std::uint32_t kShares = 16;
    static constexpr std::uint32_t kMost = 1u << 27;  ///< changes, lest a sum overflows

    ChangeLists lists;
    IdBits bits;
    ChangeCounts room;          ///< no more than kMost
    const std::uint64_t* keys;  ///< [room] of CloseUpdate
    std::uint32_t* ranks;       ///< [room] 0 before
    NamedChanges changes;       ///< [out]

    std::uint64_t indices() const { return room.total() * kShares; }

    CULLET_HOST_DEVICE void operator()(std::uint64_t index) const
    {
        // The lanes of a warp have the same share, so that all of them read the same key at a time.
        const auto all = static_cast<std::uint32_t>(room.total());
        const std::uint32_t share = static_cast<std::uint32_t>(index) / all;
        const std::uint32_t i = static_cast<std::uint32_t>(index) % all;
        const ChangeCounts counts = lists.namedCounts(room);
        const bool isRemoved = i >= room.added;
        const std::uint64_t* const alike = keys + (isRemoved ? room.added : 0);
        const auto count = static_cast<std::uint32_t>(isRemoved ? counts.removed : counts.added);
        const std::uint32_t k = isRemoved ? i - static_cast<std::uint32_t>(room.added) : i;
        if (k >= count)
            return;
        const std::uint64_t key = alike[k];
        const std::uint32_t each = (count + kShares - 1) / kShares;
        const std::uint32_t begin = share * each;
        const std::uint32_t end = begin + each < count ? begin + each : count;
        std::uint32_t smaller = 0;
        for (std::uint32_t other = begin; other < end; ++other)
            smaller += alike[other] < key ? 1 : 0;
        // How many shares are in the sum is in its lowest bits.
        const std::uint32_t before = fetchAdd(&ranks[i], smaller * kShares + 1);
        if (before % kShares == kShares - 1)
            (isRemoved ? changes.removed : changes.added)[before / kShares + smaller] = bits.pairOf(key);
    }
};

/// Unpacks key i.
struct UnpackKey
{
    const std::uint64_t* keys;  ///< [room] sorted, those of pairs that enter first
    IdBits bits;
    ChangeCounts room;
    NamedChanges changes;  ///< [room, out]

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        Pair* const to = i < room.added ? changes.added + i : changes.removed + (i - room.added);
        *to = bits.pairOf(keys[i]);
    }
};
}  // namespace cullet::psap
