// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/psap/update/delta_steps.h"

#include <algorithm>
#include <cstdint>

/// The changes of an update as the world outside knows them: named by unique ids, in order.
namespace cullet::psap
{
/// The first ids of some changes: about those of the next update.
struct FirstIds
{
    static constexpr std::uint32_t kAnyId = 0xffffffffu;

    std::uint32_t least = 0;
    std::uint32_t most = kAnyId;

    bool areKnown() const { return most != kAnyId; }

    /// Some more on both sides; any id, where changes are so few that they tell nothing.
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

/// Where one list of changes comes to on the CPU: an executor writes it there, which takes less time than to write it
/// into its own memory and to copy that.
template <class Exec>
class FetchedPairs
{
public:
    /// Makes room for a list.
    ///
    /// @param pairs [out] of no use before take()
    /// @return where steps may write it
    Pair* prepare(Exec& exec, std::uint64_t room, Pairs& pairs)
    {
        pairs.resize(room);
        // Memory that comes back is worth locking; what comes once is faster copied.
        m_isDirect = pairs.data() == m_last && exec.canReach(pairs.data(), pairs.capacity());
        m_last = pairs.data();
        if (m_isDirect)
            return exec.mappedForWriting(pairs.data(), room);
        exec.reserve(m_staged, std::max<std::uint64_t>(room, 1));
        return exec.mappedForWriting(m_staged.data(), room);
    }

    /// After Exec::wait().
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

/// Names the changes of an update, puts them in order and fetches them.
///
/// How many there are, the CPU does not know before they are there: as many are sent for as the last updates had and
/// some more, so that an update waits for the executor once. Where that was not enough they are sent for again.
template <class Exec>
class DeltaOutput
{
public:
    explicit DeltaOutput(std::uint64_t initialCapacity)
        : m_least(std::max<std::uint64_t>(initialCapacity, 1)), m_expected{m_least, m_least}
    {
    }

    /// Asks for the changes, which are there after Exec::wait().
    ///
    /// @param largestId of all unique ids
    /// @param delta [out] of no use before take()
    void enqueue(Exec& exec, const ChangeLists& lists, std::uint32_t largestId, PairDelta& delta)
    {
        enqueue(exec, lists, largestId, m_expected, delta);
    }

    /// What the update counted. Only after enqueue() and Exec::wait().
    const Counters& counters() const { return m_report.data()->counters; }

    /// Takes the changes; asks again and waits where more were found than expected, or some are not in order.
    ///
    /// @param lists complete
    /// @param isVoid the lists are not those of enqueue()
    /// @param delta [out] the one of enqueue()
    void take(Exec& exec, const ChangeLists& lists, std::uint32_t largestId, bool isVoid, PairDelta& delta)
    {
        const ChangeCounts counts = {counters().lists.added, counters().lists.removed};
        while (isVoid || counts.added > m_room.added || counts.removed > m_room.removed || isOverfull())
        {
            if (isOverfull())
                m_updatesToSkip = m_firstIds.areKnown() ? kUpdatesToSkip : 1;
            enqueue(exec, lists, largestId, counts, delta);
            exec.wait();
            isVoid = false;
        }
        m_added.take(counts.added, delta.added);
        m_removed.take(counts.removed, delta.removed);
        m_firstIds = FirstIds::of(delta);
        m_updatesToSkip -= m_updatesToSkip > 0 ? 1 : 0;
        expect(counts.added, m_expected.added);
        expect(counts.removed, m_expected.removed);
    }

    /// What was counted may be left over from an update that failed.
    void recover() { m_bucketCount = 0; }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    // Two launches less than with buckets, and a scan; many more take longer to compare with each other than those.
    static constexpr std::uint64_t kFew = 2048;
    static_assert(kFew <= RankChange::kMost, "ranks have no room for as many");
    static constexpr std::uint64_t kChangesPerBucket = 2;
    static constexpr std::uint32_t kFewestBuckets = 128;
    // A box that changed many pairs may do so in the next updates.
    static constexpr std::uint32_t kUpdatesToSkip = 16;

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
        const NamedChanges changes = {m_added.prepare(exec, room.added, delta.added),
                                      m_removed.prepare(exec, room.removed, delta.removed)};
        if (room.total() <= kFew)
            rank(exec, lists, bits, changes);
        else if (m_updatesToSkip == 0)
            orderByBuckets(exec, {lists, bits, room, bucketsFor(exec, largestId)}, changes);
        else
            sort(exec, lists, bits, changes);
    }

    /// @param ranks as CloseUpdate has them
    void close(Exec& exec, const ChangeLists& lists, IdBits bits, const ChangeBuckets& buckets,
               std::uint32_t* ranks)
    {
        exec.forEach(std::max(m_room.total(), lists.table.mask + 1),
                     CloseUpdate{lists, bits, m_room, m_keys[0].data(), buckets, ranks,
                                 exec.mappedForWriting(m_report.data())});
    }

    void rank(Exec& exec, const ChangeLists& lists, IdBits bits, const NamedChanges& changes)
    {
        exec.reserve(m_ranks, m_room.total());
        close(exec, lists, bits, {}, m_ranks.data());
        const RankChange step = {lists, bits, m_room, m_keys[0].data(), m_ranks.data(), changes};
        exec.forEach(step.indices(), step);
    }

    void orderByBuckets(Exec& exec, const BucketOrder& order, const NamedChanges& changes)
    {
        close(exec, order.lists, order.bits, order.buckets, nullptr);
        exec.scan(order.buckets.counts, m_starts.data(), order.buckets.count());
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
        // Otherwise the last update has left them empty.
        if (count != m_bucketCount)
            exec.clear(m_counts.data(), count);
        m_bucketCount = count;
        return {added, removed, least, m_counts.data(), m_starts.data(), m_ranks.data()};
    }

    /// @param span of first ids
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

    void sort(Exec& exec, const ChangeLists& lists, IdBits bits, const NamedChanges& changes)
    {
        close(exec, lists, bits, {}, nullptr);
        const std::uint64_t* keys = m_keys[0].data();
        std::uint64_t* sorted = m_keys[1].data();
        exec.sortKeys(keys, sorted, m_room.added, 0, bits.keyBits());
        exec.sortKeys(keys + m_room.added, sorted + m_room.added, m_room.removed, 0, bits.keyBits());
        exec.forEach(m_room.total(), UnpackKey{sorted, bits, m_room, changes});
    }

    std::uint64_t m_least;
    ChangeCounts m_expected;  ///< changes of the next update
    ChangeCounts m_room{};    ///< for changes, in the last call
    FirstIds m_firstIds;      ///< expected
    std::uint32_t m_updatesToSkip = 0;
    std::uint32_t m_bucketCount = 0;
    Buffer<std::uint32_t> m_counts, m_starts, m_ranks;
    Buffer<std::uint64_t> m_keys[2];  ///< as made, and in order
    FetchedPairs<Exec> m_added, m_removed;
    typename Exec::template Staging<UpdateReport> m_report;
};
}  // namespace cullet::psap
