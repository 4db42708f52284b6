// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/psap/update/delta_steps.h"

#include <algorithm>
#include <cstdint>

/// The changes of an update as pairs of unique ids, in order.
namespace cullet::psap
{
/// The range of first ids of the changes of an update, which predicts that of the next update.
struct FirstIds
{
    static constexpr std::uint32_t kAnyId = 0xffffffffu;

    std::uint32_t least = 0;
    std::uint32_t most = kAnyId;

    bool areKnown() const { return most != kAnyId; }

    /// The range, widened on both sides; the full range where there are too few changes to predict it.
    static FirstIds of(const PairDelta& delta)
    {
        if (delta.added.size() + delta.removed.size() < kFew)
            return {};
        FirstIds ids = {kAnyId, 0};
        for (const Pairs* pairs : {&delta.added, &delta.removed})
        {
            if (pairs->empty())
                continue;
            ids.least = std::min(ids.least, pairs->front().first);
            ids.most = std::max(ids.most, pairs->back().first);
        }
        const std::uint32_t more = (ids.most - ids.least) / 8;
        return {ids.least - std::min(more, ids.least), ids.most + std::min(more, kAnyId - 1 - ids.most)};
    }

private:
    static constexpr std::size_t kFew = 256;
};

/// Memory of the CPU for one list of changes. The executor writes it directly, which is faster than writing it to
/// device memory and copying it.
template <class Exec>
class DownloadedPairs
{
public:
    /// Makes room for a list.
    ///
    /// @param pairs [out] invalid until take()
    /// @return address at which steps may write the list
    Pair* prepare(Exec& exec, std::uint64_t room, Pairs& pairs)
    {
        pairs.resize(room);
        // Locking pays for memory that is used again; memory used once is copied faster.
        m_isDirect = pairs.data() == m_last && exec.canAccessDirectly(pairs.data(), pairs.capacity());
        m_last = pairs.data();
        if (m_isDirect)
            return exec.mappedForWriting(pairs.data(), room);
        exec.reserve(m_staged, std::max<std::uint64_t>(room, 1));
        return exec.mappedForWriting(m_staged.data(), room);
    }

    /// Reads the list. To be called after Exec::wait().
    void take(std::uint64_t count, Pairs& pairs) const
    {
        if (m_isDirect)
            pairs.resize(count);
        else
            pairs.assign(m_staged.data(), m_staged.data() + count);
    }

private:
    typename Exec::template Staging<Pair> m_staged;
    const Pair* m_last = nullptr;
    bool m_isDirect = false;
};

/// Converts the changes of an update to pairs of ids, sorts them and downloads them.
///
/// The CPU does not know their number in advance: it requests slightly more than the last updates had, so that an
/// update waits for the executor once, and requests them again where that was too few.
template <class Exec>
class DeltaOutput
{
public:
    explicit DeltaOutput(std::uint64_t initialCapacity)
        : m_least(std::max<std::uint64_t>(initialCapacity, 1)), m_expected{m_least, m_least}
    {
    }

    /// Enqueues the sort and the download of the changes, which are complete after Exec::wait().
    ///
    /// @param largestId largest unique id in use
    /// @param delta     [out] invalid until take()
    void enqueue(Exec& exec, const ChangeLists& lists, std::uint32_t largestId, PairDelta& delta)
    {
        enqueue(exec, lists, largestId, m_expected, delta);
    }

    /// What the update counted. Valid only after enqueue() and Exec::wait().
    const Counters& counters() const { return m_report.data()->counters; }

    /// Reads the changes. Enqueues them again and waits where there are more than expected, or where some are not in
    /// order.
    ///
    /// @param lists  complete lists
    /// @param isVoid the lists have changed since enqueue()
    /// @param delta  [out] the one given to enqueue()
    void take(Exec& exec, const ChangeLists& lists, std::uint32_t largestId, bool isVoid, PairDelta& delta)
    {
        const ChangeCounts counts = {counters().lists.added, counters().lists.removed};
        while (isVoid || counts.added > m_room.added || counts.removed > m_room.removed || isOverfull())
        {
            if (isOverfull())
                m_updatesWithoutBuckets = m_firstIds.areKnown() ? kUpdatesWithoutBuckets : 1;
            enqueue(exec, lists, largestId, counts, delta);
            exec.wait();
            isVoid = false;
        }
        m_added.take(counts.added, delta.added);
        m_removed.take(counts.removed, delta.removed);
        m_firstIds = FirstIds::of(delta);
        m_updatesWithoutBuckets -= m_updatesWithoutBuckets > 0 ? 1 : 0;
        expect(counts.added, m_expected.added);
        expect(counts.removed, m_expected.removed);
    }

    /// After a failed update, whose counts may remain in the buckets.
    void recover() { m_bucketCount = 0; }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    // Up to so many changes are ranked: two launches and a scan less than with buckets. Comparing many more with each
    // other takes longer.
    static constexpr std::uint64_t kFew = 2048;
    static_assert(kFew <= RankChange::kMost, "ranks have no room for as many");
    static constexpr std::uint64_t kChangesPerBucket = 2;
    static constexpr std::uint32_t kFewestBuckets = 128;
    // A box that changed many pairs may do so again in the next updates.
    static constexpr std::uint32_t kUpdatesWithoutBuckets = 16;

    bool isOverfull() const { return m_report.data()->isOverfull != 0; }

    void expect(std::uint64_t count, std::uint64_t& expected) const
    {
        if (count > expected || count < expected / 2)
            expected = std::max(m_least, count + count / 4);
    }

    void enqueue(Exec& exec, const ChangeLists& lists, std::uint32_t largestId, ChangeCounts room,
                 PairDelta& delta)
    {
        const IdBits bits = IdBits::forIds(largestId);
        m_room = room;
        for (Buffer<std::uint64_t>& keys : m_keys)
            exec.reserve(keys, room.total());
        exec.reserve(m_report, 1);
        const SortedChanges changes = {m_added.prepare(exec, room.added, delta.added),
                                       m_removed.prepare(exec, room.removed, delta.removed)};
        if (room.total() <= kFew)
            rank(exec, lists, bits, changes);
        else if (m_updatesWithoutBuckets == 0)
            orderByBuckets(exec, {lists, bits, room, bucketsFor(exec, largestId)}, changes);
        else
            sort(exec, lists, bits, changes);
    }

    /// @param ranks as CloseUpdate::ranks
    void close(Exec& exec, const ChangeLists& lists, IdBits bits, const ChangeBuckets& buckets,
               std::uint32_t* ranks)
    {
        exec.forEach(std::max(m_room.total(), lists.table.mask + 1),
                     CloseUpdate{lists, bits, m_room, m_keys[0].data(), buckets, ranks,
                                 exec.mappedForWriting(m_report.data())});
    }

    void rank(Exec& exec, const ChangeLists& lists, IdBits bits, const SortedChanges& changes)
    {
        exec.reserve(m_ranks, m_room.total());
        // Room without a change in it would be most of the work of a small update.
        if constexpr (Exec::kRunsAtOnce)
            m_room = lists.sortedCounts(m_room);
        close(exec, lists, bits, {}, m_ranks.data());
        const RankChange step = {lists, bits, m_room, m_keys[0].data(), m_ranks.data(), changes};
        exec.forEach(step.indices(), step);
    }

    void orderByBuckets(Exec& exec, const BucketOrder& order, const SortedChanges& changes)
    {
        close(exec, order.lists, order.bits, order.buckets, nullptr);
        exec.exclusiveSum(order.buckets.counts, m_starts.data(), order.buckets.count());
        exec.forEach(std::max<std::uint64_t>(m_room.total(), order.buckets.count()),
                     FillBucket{order, m_keys[0].data(), m_keys[1].data()});
        exec.forEach(m_room.total(),
                     OrderBucket{order, m_keys[1].data(), changes, exec.mappedForWriting(m_report.data())});
    }

    ChangeBuckets bucketsFor(Exec& exec, std::uint32_t largestId)
    {
        const std::uint32_t most = std::min(m_firstIds.most, largestId);
        const std::uint32_t least = std::min(m_firstIds.least, most);
        const ChangeBuckets::Kind added = kindFor(0, m_room.added, most - least);
        const ChangeBuckets::Kind removed = kindFor(added.last + 1, m_room.removed, most - least);
        const std::uint32_t count = removed.last + 1;
        exec.reserve(m_counts, count);
        exec.reserve(m_starts, count);
        exec.reserve(m_ranks, m_room.total());
        // For the same number of buckets, the previous update has left them empty.
        if (count != m_bucketCount)
            exec.clear(m_counts.data(), count);
        m_bucketCount = count;
        return {added, removed, least, m_counts.data(), m_starts.data(), m_ranks.data()};
    }

    /// @param span difference between the largest and the smallest first id
    static ChangeBuckets::Kind kindFor(std::uint32_t first, std::uint64_t room, std::uint32_t span)
    {
        std::uint32_t count = kFewestBuckets;
        while (count * kChangesPerBucket < room)
            count *= 2;
        std::uint32_t shift = 0;
        while (span >> shift >= count)
            ++shift;
        return {first, first + count - 1, shift};
    }

    void sort(Exec& exec, const ChangeLists& lists, IdBits bits, const SortedChanges& changes)
    {
        close(exec, lists, bits, {}, nullptr);
        const std::uint64_t* keys = m_keys[0].data();
        std::uint64_t* sorted = m_keys[1].data();
        exec.sortKeys(keys, sorted, m_room.added, bits.keyBits());
        exec.sortKeys(keys + m_room.added, sorted + m_room.added, m_room.removed, bits.keyBits());
        exec.forEach(m_room.total(), UnpackKey{sorted, bits, m_room, changes});
    }

    std::uint64_t m_least;
    ChangeCounts m_expected;  ///< expected changes of the next update
    ChangeCounts m_room{};    ///< room for changes, in the last call
    FirstIds m_firstIds;      ///< expected first ids
    std::uint32_t m_updatesWithoutBuckets = 0;
    std::uint32_t m_bucketCount = 0;
    Buffer<std::uint32_t> m_counts, m_starts, m_ranks;
    Buffer<std::uint64_t> m_keys[2];  ///< unsorted and sorted
    DownloadedPairs<Exec> m_added, m_removed;
    typename Exec::template Staging<UpdateReport> m_report;
};
}  // namespace cullet::psap
