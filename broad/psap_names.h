// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/backend.h"
#include "broad/host_device.h"
#include "broad/id_pair.h"
#include "broad/pair.h"
#include "broad/psap_pairs.h"

#include <algorithm>
#include <cstdint>
#include <cstring>

/// The changes of an update as the world outside knows them: named by unique ids, in order.
namespace cullet::psap
{
/// How a pair of unique ids makes one integer of Pair's order: no longer than the ids need, for the sake of sorting.
struct IdBits
{
    std::uint32_t bits;  ///< of an id

    static IdBits forIds(std::uint32_t largest)
    {
        std::uint32_t bits = 1;
        while (bits < 32 && largest >> bits != 0)
            ++bits;
        return {bits};
    }

    /// One bit more tells two kinds of pairs apart, where there is room for it.
    CULLET_HOST_DEVICE bool hasLaterKey() const { return bits < 32; }
    CULLET_HOST_DEVICE std::uint64_t laterKey() const { return hasLaterKey() ? 1ull << 2 * bits : 0; }
    int keyBits() const { return static_cast<int>(hasLaterKey() ? 2 * bits + 1 : 64); }

    CULLET_HOST_DEVICE Pair pairOf(std::uint64_t key) const
    {
        const std::uint64_t mask = (1ull << bits) - 1;
        return {static_cast<std::uint32_t>(key >> bits & mask), static_cast<std::uint32_t>(key & mask)};
    }
};

/// The lists of an update, in an executor's memory.
struct ChangeLists
{
    const IdPair* added;
    std::uint64_t addedRoom;
    const IdPair* removed;
    IdPair* kept;  ///< the pairs that enter go behind those that stay
    std::uint64_t keptRoom;
    LookupTable table;
    const Counters* counters;
    const std::uint32_t* sides;
    const std::uint32_t* uniqueIds;  ///< by row

    /// Whether nothing was left out for want of room, so that the search need not run again.
    CULLET_HOST_DEVICE bool areComplete(const ListCounts& counts) const
    {
        return counts.added <= addedRoom && counts.lookups <= table.limit();
    }
};

/// What follows the search, in one launch, since each part would take longer to start than to run: names the changes by
/// unique ids, appends the pairs that enter to those that are held, frees the look-up table, and puts the counts in
/// front of the changes, so that one copy brings both. Index i does change i and slot i.
struct CloseUpdate
{
    ChangeLists lists;
    IdBits bits;
    std::uint64_t room;   ///< for changes
    std::uint64_t* keys;  ///< [room, out] behind the last change: more than any key
    Pair* report;         ///< [kReportPairs + room, out] the changes themselves 0

    /// What the counts take, with one number behind them.
    static constexpr std::uint64_t kReportPairs = sizeof(Counters) / sizeof(Pair) + 1;

    static std::uint32_t* longRunsOf(Pair* report) { return &report[kReportPairs - 1].first; }

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const ListCounts counts = lists.counters->lists;
        if (i == 0)
            reportCounts();
        if (i <= lists.table.mask && lists.areComplete(counts))
            lists.table.slots[i] = LookupTable::kFree;
        if (i >= room)
            return;
        report[kReportPairs + i] = {};
        keys[i] = ~0ull;
        if (!lists.areComplete(counts))
            return;
        if (i < counts.added)
            enter(i, counts.kept);
        else if (i - counts.added < counts.removed)
            keys[i] = bits.laterKey() | keyOf(lists.removed[i - counts.added]);
    }

private:
    static_assert(sizeof(Counters) % sizeof(Pair) == 0, "counts take the place of whole pairs");

    CULLET_HOST_DEVICE void reportCounts() const
    {
        Counters counters = *lists.counters;
        counters.side = *lists.sides;
        memcpy(report, &counters, sizeof(counters));
        report[kReportPairs - 1] = {};
    }

    CULLET_HOST_DEVICE void enter(std::uint64_t i, std::uint64_t kept) const
    {
        keys[i] = keyOf(lists.added[i]);
        if (kept + i < lists.keptRoom)
            lists.kept[kept + i] = lists.added[i];
    }

    CULLET_HOST_DEVICE std::uint64_t keyOf(IdPair pair) const
    {
        const std::uint64_t a = lists.uniqueIds[pair.a];
        const std::uint64_t b = lists.uniqueIds[pair.b];
        return a < b ? a << bits.bits | b : b << bits.bits | a;
    }
};

/// Unpacks key i.
struct UnpackKey
{
    const std::uint64_t* keys;
    IdBits bits;
    Pair* pairs;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const { pairs[i] = bits.pairOf(keys[i]); }
};

/// Finishes an order by kind and first id alone: unpacks key i at its place among those of the same first id.
struct OrderRun
{
    /// So many keys of one first id are too many.
    static constexpr std::uint64_t kLongest = 32;

    const std::uint64_t* keys;  ///< [room] ordered but for the second id
    std::uint64_t room;
    const Counters* counters;
    IdBits bits;
    Pair* ordered;            ///< [room, out] void where there is a longer run
    std::uint32_t* longRuns;  ///< their number

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const std::uint64_t changes = counters->lists.added + counters->lists.removed;
        const std::uint64_t count = changes < room ? changes : room;
        if (i >= count)
            return;
        const std::uint64_t key = keys[i];
        std::uint64_t smaller = 0;
        std::uint64_t before = 0;
        for (; before < kLongest && before < i && isInRun(key, i - before - 1); ++before)
            smaller += keys[i - before - 1] < key ? 1 : 0;
        std::uint64_t behind = 1;
        for (; behind < kLongest && i + behind < count && isInRun(key, i + behind); ++behind)
            smaller += keys[i + behind] < key ? 1 : 0;
        if (before == kLongest)
            return;
        if (behind < kLongest)
            ordered[i - before + smaller] = bits.pairOf(key);
        else if (before == 0)
            fetchAdd(longRuns, 1u);
    }

private:
    CULLET_HOST_DEVICE bool isInRun(std::uint64_t key, std::uint64_t i) const
    {
        return keys[i] >> bits.bits == key >> bits.bits;
    }
};

/// Names the changes of an update, and sorts and fetches the names.
///
/// How many there are, the CPU does not know before they are there: as many are sent for as the last updates had and
/// some more, so that an update waits for the executor once. Where that was not enough they are sent for again.
template <class Exec>
class ChangeNames
{
public:
    explicit ChangeNames(std::uint64_t initialCapacity)
        : m_least(std::max<std::uint64_t>(initialCapacity, 1)), m_expected(m_least)
    {
    }

    /// Asks for the changes, which are there after Exec::wait().
    ///
    /// @param largestId of all unique ids
    void enqueue(Exec& exec, const ChangeLists& lists, std::uint32_t largestId)
    {
        const IdBits bits = IdBits::forIds(largestId);
        // Two kinds of pairs in one array are sorted apart, which takes their numbers.
        enqueue(exec, lists, bits, bits.hasLaterKey() ? m_expected : 0, 0);
    }

    /// What the update counted. Only after enqueue() and Exec::wait().
    Counters counters() const
    {
        Counters counters;
        std::memcpy(&counters, m_staged.data(), sizeof(counters));
        return counters;
    }

    /// Takes the changes; asks again and waits where more were found than expected, or some are not in order.
    ///
    /// @param lists complete
    /// @param isVoid the lists are not those of enqueue()
    /// @param delta [out]
    void take(Exec& exec, const ChangeLists& lists, std::uint32_t largestId, bool isVoid, PairDelta& delta)
    {
        const ListCounts counts = counters().lists;
        const std::uint64_t count = counts.added + counts.removed;
        while (isVoid || count > m_room || longRuns() != 0)
        {
            m_updatesToSkip = longRuns() != 0 ? kUpdatesToSkip : m_updatesToSkip;
            enqueue(exec, lists, IdBits::forIds(largestId), std::max<std::uint64_t>(count, 1), counts.added);
            exec.wait();
            isVoid = false;
        }
        const Pair* pairs = m_staged.data() + CloseUpdate::kReportPairs;
        delta.added.assign(pairs, pairs + counts.added);
        delta.removed.assign(pairs + counts.added, pairs + count);
        m_updatesToSkip -= m_updatesToSkip > 0 ? 1 : 0;
        if (count > m_expected || count < m_expected / 2)
            m_expected = std::max(m_least, count + count / 4);
    }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    // Fewer are sorted in one launch, whatever their length.
    static constexpr std::uint64_t kKeysForRuns = 4096;
    // A box that changed many pairs may do so in the next updates.
    static constexpr std::uint32_t kUpdatesToSkip = 16;

    std::uint32_t longRuns() const { return *CloseUpdate::longRunsOf(m_staged.data()); }

    /// @param room  for changes
    /// @param added of them, where that matters
    void enqueue(Exec& exec, const ChangeLists& lists, IdBits bits, std::uint64_t room, std::uint64_t added)
    {
        m_room = room;
        for (Buffer<std::uint64_t>& keys : m_keys)
            exec.reserve(keys, room);
        const std::uint64_t reported = CloseUpdate::kReportPairs + room;
        exec.reserve(m_report, reported);
        exec.reserve(m_staged, reported);
        exec.forEach(std::max(room, lists.table.mask + 1),
                     CloseUpdate{lists, bits, room, m_keys[0].data(), m_report.data()});
        order(exec, lists.counters, bits, bits.hasLaterKey() ? room : added);
        exec.download(m_staged.data(), m_report.data(), reported);
    }

    /// Sorts the keys and unpacks them. Many are sorted by half of each key, and the few of the same first id by
    /// themselves: half of the passes of a radix sort.
    ///
    /// @param together so many keys in one sort, the others in another
    void order(Exec& exec, const Counters* counters, IdBits bits, std::uint64_t together)
    {
        const bool isByRuns = m_room >= kKeysForRuns && bits.hasLaterKey() && m_updatesToSkip == 0;
        const int firstBit = isByRuns ? static_cast<int>(bits.bits) : 0;
        const std::uint64_t* keys = m_keys[0].data();
        std::uint64_t* sorted = m_keys[1].data();
        exec.sortKeys(keys, sorted, together, firstBit, bits.keyBits());
        exec.sortKeys(keys + together, sorted + together, m_room - together, firstBit, bits.keyBits());
        Pair* ordered = m_report.data() + CloseUpdate::kReportPairs;
        if (isByRuns)
            exec.forEach(m_room, OrderRun{sorted, m_room, counters, bits, ordered,
                                          CloseUpdate::longRunsOf(m_report.data())});
        else
            exec.forEach(m_room, UnpackKey{sorted, bits, ordered});
    }

    std::uint64_t m_least;
    std::uint64_t m_expected;  ///< changes of the next update
    std::uint64_t m_room = 0;  ///< for changes, in the last call
    std::uint32_t m_updatesToSkip = 0;
    Buffer<std::uint64_t> m_keys[2];  ///< as made, and sorted
    Buffer<Pair> m_report;
    typename Exec::template Staging<Pair> m_staged;
};
}  // namespace cullet::psap
