// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/exec/executor_failure.h"
#include "cullet/cuda/contacts/merge_steps.h"

#include <algorithm>
#include <cstdint>
#include <utility>

namespace cullet::contacts
{
/// A list of pairs in ascending order, the lower row of each first, into which changes are merged on an executor, with what
/// PairQueries remembers of each pair.
///
/// A merge is prepare(), which may allocate, and launch(), which only launches. Once the numbers of changes are known,
/// isComplete() returns whether there was room; if not, they are merged again by prepareAgain() and launch(): the list
/// before the changes is still there.
///
/// @tparam Exec HostPairExec or CudaPairExec
template <class Exec>
class MergedPairs
{
public:
    /// Makes room for the next list, and for as many changes as there were lately.
    ///
    /// @param queries what is remembered moves to its other memory
    /// @param count   length of the list before the changes
    /// @param rows    before or after the changes, whichever are more
    /// Errors: what the executor throws, and ExecutorFailure for 2^31 rows or more
    template <class Queries>
    void prepare(Exec& exec, Queries& queries, std::uint64_t count, std::uint64_t rows)
    {
        if (rows > kMostRows)
            throw psap::ExecutorFailure{Status::OutOfMemory, "MergedPairs", "2^31 rows or more"};
        m_order.bits =
            static_cast<int>(bitWidthOf(static_cast<std::uint32_t>(std::max<std::uint64_t>(rows, 1))));
        m_current = 1 - m_current;
        chooseRoom(count);
        exec.reserve(m_counts, 2);
        if (!std::exchange(m_areCountsClear, true))
            exec.clear(m_counts.data(), 2);
        makeRoom(exec);
        queries.swapMemory();
        setMerge(exec, queries);
    }

    /// Makes room for changes that are known now.
    template <class Queries>
    void prepareAgain(Exec& exec, Queries& queries, const DeltaCounts& counts)
    {
        m_changeRoom = std::max(m_changeRoom, counts.added + counts.removed);
        chooseRoom(counts.pairs());
        makeRoom(exec);
        setMerge(exec, queries);
    }

    /// @param changes of the list; their room is that of this object
    /// @pre prepare()
    void launch(Exec& exec, FoundChanges changes)
    {
        changes.room = m_changeRoom;
        exec.forEach(m_changeRoom, KeyOfChange{changes, m_order, m_keys.data()});
        exec.sortKeys(m_keys.data(), m_sortedKeys.data(), m_changeRoom, m_order.bitsOfKey());
        exec.forEach(m_changeRoom + 1, CountAdded{m_sortedKeys.data(), m_changeRoom, m_isAdded.data()});
        exec.exclusiveSum(m_isAdded.data(), m_addedBefore.data(), m_changeRoom + 1);
        const MergeOrder merge = {changes, m_order, m_sortedKeys.data(), m_addedBefore.data(), m_from, m_to};
        exec.forEach(std::max(m_from.room, m_to.room), KeepPairs{merge});
        exec.forEach(m_changeRoom, AddPairs{merge});
    }

    /// Whether the last launch() had room for these changes.
    bool isComplete(const DeltaCounts& counts) const
    {
        return counts.added + counts.removed <= m_changeRoom && counts.pairs() <= m_to.room;
    }

    /// Chooses the room for the next changes by these. To be called once for each list.
    ///
    /// @param isFirst the list was empty before: the next changes will be fewer
    void learn(const DeltaCounts& counts, bool isFirst)
    {
        const std::uint64_t wanted = twice(isFirst ? 0 : counts.added + counts.removed);
        const bool isMuchLess = wanted * 4 <= m_changeRoom;
        m_calm = isMuchLess ? m_calm + 1 : 0;
        if (wanted > m_changeRoom || isFirst || m_calm >= kCalmLists)
        {
            m_changeRoom = wanted;
            m_calm = 0;
        }
    }

    /// Empties the list, also after a failure.
    void forget() { m_areCountsClear = false; }

    /// In the executor's memory, of the last launch(): [room()] pairs, and their number, or kVoidList.
    const RowPair* pairs() const { return m_to.pairs; }
    const std::uint64_t* count() const { return m_to.count; }
    std::uint64_t room() const { return m_to.room; }
    /// Launches depend on it, too.
    std::uint64_t roomForChanges() const { return m_changeRoom; }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    static constexpr std::uint64_t kMostRows = 0x7fffffffu, kMostPairs = 0xffffffffu;
    static constexpr std::uint64_t kFewestChanges = 1024, kStep = 4096;
    static constexpr unsigned kCalmLists = 32;

    /// At least twice as many, a power of two.
    static std::uint64_t twice(std::uint64_t changes)
    {
        std::uint64_t room = kFewestChanges;
        while (room < 2 * changes)
            room *= 2;
        return room;
    }

    /// The room of the list changes seldom, since launches depend on it.
    void chooseRoom(std::uint64_t count)
    {
        const std::uint64_t wanted = (count + count / 8 + kStep) / kStep * kStep;
        if (count + count / 32 >= m_room || m_room > 2 * wanted)
            m_room = wanted;
        if (m_room > kMostPairs)
            throw psap::ExecutorFailure{Status::OutOfMemory, "MergedPairs", "2^32 pairs or more"};
    }

    void makeRoom(Exec& exec)
    {
        exec.reserve(m_pairs[m_current], m_room);
        exec.reserve(m_keys, m_changeRoom);
        exec.reserve(m_sortedKeys, m_changeRoom);
        exec.reserve(m_isAdded, m_changeRoom + 1);
        exec.reserve(m_addedBefore, m_changeRoom + 1);
    }

    template <class Queries>
    void setMerge(Exec& exec, Queries& queries)
    {
        const convex::PairMemory memory = queries.memoryFor(exec, static_cast<std::uint32_t>(m_room));
        m_roomOf[m_current] = m_room;
        m_from = {m_pairs[1 - m_current].data(), queries.otherMemory(), m_counts.data() + (1 - m_current),
                  m_roomOf[1 - m_current]};
        m_to = {m_pairs[m_current].data(), memory, m_counts.data() + m_current, m_room};
    }

    ChangeOrder m_order = {1};
    unsigned m_current = 0;  ///< index of the last list
    std::uint64_t m_room = 0, m_changeRoom = kFewestChanges;
    std::uint64_t m_roomOf[2] = {0, 0};
    unsigned m_calm = 0;  ///< lists in a row with much more room for changes than they needed
    bool m_areCountsClear = false;
    RememberedPairs m_from, m_to;
    Buffer<RowPair> m_pairs[2];
    Buffer<std::uint64_t> m_counts;
    Buffer<std::uint64_t> m_keys, m_sortedKeys;
    Buffer<std::uint32_t> m_isAdded, m_addedBefore;
};
}  // namespace cullet::contacts
