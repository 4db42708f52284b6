// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/backend.h"
#include "broad/psap_pairs.h"
#include "broad/worker_pool.h"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace cullet::psap
{
/// The rows of a proxy table in an executor's memory: the boxes of this update and of the last one, what changed, filter
/// words and unique ids.
///
/// Changed rows come over in blocks. Each is put into its place while the next is on its way, or still being packed.
template <class Exec>
class RowMemory
{
public:
    /// @param threads for packing
    explicit RowMemory(unsigned threads) : m_workers(threads) {}

    /// The next send() brings everything.
    void forget()
    {
        m_rowCount = 0;
        m_dirtyCount = 0;
        m_hasFilters = false;
        m_isFresh = true;
    }

    /// Brings the changed rows over; rows that changed in the last update grow old first.
    ///
    /// @param motion as BoxHistory::motion; 0 before
    void send(Exec& exec, const ProxyView& view, std::uint32_t* motion)
    {
        reserveRows(exec, view.size);
        m_haveAllChanged = m_isFresh || view.dirtyCount == view.size;
        const bool isDirect = isSentDirectly(exec, view);
        const bool sendsAll = m_haveAllChanged || isDirect;
        growOld(exec, view, sendsAll);
        if (view.size > m_rowCount)
            exec.forEachFrom(m_rowCount, view.size, ForgetRow{m_now.data(), m_old.data(), m_changes.data()});
        m_dirtyIsAll = sendsAll;
        m_dirtyCount = sendsAll ? view.size : view.dirtyCount;
        const Staged all = sendBlocks(exec, view, isDirect, motion);
        if (view.filters != nullptr)
            sendFilters(exec, view, (all.anyChanges & (kRowCreated | kRowRefiltered)) != 0);
        if ((all.anyChanges & kRowCreated) != 0)
            exec.uploadNow(m_uniqueIds.data(), view.uniqueIds, view.size);
        m_largestId = std::max(m_largestId, all.largestId);
        m_hasFilters = view.filters != nullptr;
        m_rowCount = view.size;
        m_isFresh = false;
    }

    std::uint64_t count() const { return m_rowCount; }
    const Aabb* now() const { return m_now.data(); }
    const Aabb* old() const { return m_old.data(); }
    const std::uint8_t* changes() const { return m_changes.data(); }
    const Filter* filters() const { return m_hasFilters ? m_filters.data() : nullptr; }
    const std::uint32_t* uniqueIds() const { return m_uniqueIds.data(); }
    std::uint32_t largestId() const { return m_largestId; }  ///< of those sent
    bool haveAllChanged() const { return m_haveAllChanged; }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;
    template <class T>
    using Staging = typename Exec::template Staging<T>;

    /// What is known of some changed rows together.
    struct Staged
    {
        unsigned anyChanges = kRowUnchanged;  ///< RowChange bits that some row has
        unsigned allChanges = 0xffu;          ///< those that every row has
        std::uint32_t largestId = 0;          ///< of those created

        bool isUniform() const { return anyChanges == allChanges; }
        void add(const Staged& other)
        {
            anyChanges |= other.anyChanges;
            allChanges &= other.allChanges;
            largestId = std::max(largestId, other.largestId);
        }
    };

    void reserveRows(Exec& exec, std::uint64_t count)
    {
        const std::uint64_t room = std::max<std::uint64_t>(count, 1);
        exec.reserveKeeping(m_now, room, m_rowCount);
        exec.reserveKeeping(m_old, room, m_rowCount);
        exec.reserveKeeping(m_changes, room, m_rowCount);
        exec.reserveKeeping(m_filters, room, m_hasFilters ? m_rowCount : 0);
        exec.reserveKeeping(m_uniqueIds, room, m_rowCount);
        exec.reserveKeeping(m_dirty, room, m_dirtyIsAll ? 0 : m_dirtyCount);
    }

    /// Whether all boxes go over as they are: where many have changed, that takes less than to pick those.
    bool isSentDirectly(const Exec& exec, const ProxyView& view) const
    {
        const bool isMost = m_haveAllChanged || view.dirtyCount > view.size / kDirectShare;
        return isMost && view.lockableRows >= view.size && exec.canUploadFrom(view.boxes, view.lockableRows);
    }

    /// Makes the boxes of the last update old ones.
    ///
    /// @param sendsAll every row comes anew
    void growOld(Exec& exec, const ProxyView& view, bool sendsAll)
    {
        // What stands here is old altogether then.
        if (!m_isFresh && view.size == m_rowCount && sendsAll)
            std::swap(m_now, m_old);
        else
            exec.forEach(m_dirtyCount, AgeRow{dirtyRows(), m_now.data(), m_old.data(), m_changes.data()});
    }

    const std::uint32_t* dirtyRows() const { return m_dirtyIsAll ? nullptr : m_dirty.data(); }

    /// Packs the changed rows, sends them and puts them into their places.
    ///
    /// @param isDirect from the table itself, which is not packed
    Staged sendBlocks(Exec& exec, const ProxyView& view, bool isDirect, std::uint32_t* motion)
    {
        reserveStaging(exec);
        // Picked here and there, rows take longer to pack than to copy: smaller blocks, so that copying begins sooner.
        const std::uint64_t block = m_dirtyIsAll ? kStageBlock : kScatteredBlock;
        if (isDirect)
            exec.uploadParts(m_newBoxes.data(), view.boxes, m_dirtyCount, block);
        else
            exec.reserve(m_stagedBoxes, std::max<std::uint64_t>(m_dirtyCount, 1));
        Staged all;
        for (std::uint64_t begin = 0; begin < m_dirtyCount; begin += block)
        {
            const std::uint64_t end = std::min(begin + block, m_dirtyCount);
            const Staged staged = stageBlock(view, begin, end, !isDirect);
            if (isDirect)
                exec.awaitPart(begin / block);
            else
                exec.upload(m_newBoxes.data() + begin, m_stagedBoxes.data() + begin, end - begin);
            apply(exec, begin, end, staged, motion);
            all.add(staged);
        }
        return all;
    }

    void reserveStaging(Exec& exec)
    {
        const std::uint64_t count = std::max<std::uint64_t>(m_dirtyCount, 1);
        exec.reserve(m_stagedChanges, count);
        exec.reserve(m_stagedRows, count);
        exec.reserve(m_newBoxes, count);
        exec.reserve(m_newChanges, count);
    }

    /// Stores some changed rows, whose boxes have been sent.
    void apply(Exec& exec, std::uint64_t begin, std::uint64_t end, const Staged& staged,
               std::uint32_t* motion)
    {
        if (!m_dirtyIsAll)
            exec.upload(m_dirty.data() + begin, m_stagedRows.data() + begin, end - begin);
        // Mostly they have all moved and nothing else, which need not be told of each.
        if (!staged.isUniform())
            exec.upload(m_newChanges.data() + begin, m_stagedChanges.data() + begin, end - begin);
        exec.forEachFrom(
            begin, end,
            ApplyRow{dirtyRows(), m_newBoxes.data(), staged.isUniform() ? nullptr : m_newChanges.data(),
                     static_cast<std::uint8_t>(staged.anyChanges), m_now.data(), m_old.data(),
                     m_changes.data(), motion});
    }

    /// Packs some of the changed rows on threads: on one core a million would take longer than everything else.
    Staged stageBlock(const ProxyView& view, std::uint64_t begin, std::uint64_t end, bool packsBoxes)
    {
        const unsigned tasks =
            m_workers.tasksFor(end - begin, m_dirtyIsAll && !packsBoxes ? kBitsGrain : kBoxesGrain);
        m_staged.assign(tasks, {});
        m_workers.run(tasks,
                      [&](unsigned task)
                      {
                          m_staged[task] = stageRange(view, begin + (end - begin) * task / tasks,
                                                      begin + (end - begin) * (task + 1) / tasks, packsBoxes);
                      });
        Staged all;
        for (const Staged& part : m_staged)
            all.add(part);
        return all;
    }

    Staged stageRange(const ProxyView& view, std::uint64_t begin, std::uint64_t end, bool packsBoxes)
    {
        Staged staged = m_dirtyIsAll ? stageAll(view, begin, end, packsBoxes) : stagePicked(view, begin, end);
        if ((staged.anyChanges & kRowCreated) != 0)
            staged.largestId = largestId(view, begin, end);
        return staged;
    }

    /// Packs rows where all have changed.
    Staged stageAll(const ProxyView& view, std::uint64_t begin, std::uint64_t end, bool packsBoxes)
    {
        if (packsBoxes)
            std::copy(view.boxes + begin, view.boxes + end, m_stagedBoxes.data() + begin);
        // Pointers in variables: a store of a byte may change whatever it is that a member points to.
        std::uint8_t* changes = m_stagedChanges.data();
        const std::uint8_t* from = view.changes;
        const std::uint8_t fresh = m_isFresh ? kRowCreated : kRowUnchanged;
        // Bytes, so that as many of them as fit into a register go together.
        std::uint8_t any = 0;
        std::uint8_t all = 0xff;
        for (std::uint64_t row = begin; row < end; ++row)
        {
            const auto bits = static_cast<std::uint8_t>(from[row] | fresh);
            changes[row] = bits;
            any = static_cast<std::uint8_t>(any | bits);
            all = static_cast<std::uint8_t>(all & bits);
        }
        return {any, all, 0};
    }

    /// Packs some of the rows that the dirty list names.
    Staged stagePicked(const ProxyView& view, std::uint64_t begin, std::uint64_t end)
    {
        Aabb* boxes = m_stagedBoxes.data();
        std::uint8_t* changes = m_stagedChanges.data();
        std::uint32_t* rows = m_stagedRows.data();
        const ProxyView from = view;
        unsigned any = 0;
        unsigned all = 0xffu;
        for (std::uint64_t i = begin; i < end; ++i)
        {
            // A cache line or two for each row: they come sixteen rows before they are needed.
            prefetchBox(from.boxes + from.dirty[std::min(i + 16, end - 1)]);
            const std::uint32_t row = from.dirty[i];
            rows[i] = row;
            boxes[i] = from.boxes[row];
            changes[i] = from.changes[row];
            any |= from.changes[row];
            all &= from.changes[row];
        }
        return {any, all, 0};
    }

    static void prefetchBox(const Aabb* box)
    {
        __builtin_prefetch(&box->min);
        __builtin_prefetch(&box->max[2]);
    }

    std::uint32_t largestId(const ProxyView& view, std::uint64_t begin, std::uint64_t end) const
    {
        std::uint32_t largest = 0;
        for (std::uint64_t i = begin; i < end; ++i)
            largest = std::max(largest, view.uniqueIds[m_dirtyIsAll ? i : view.dirty[i]]);
        return largest;
    }

    /// @param areNew some words of changed rows are
    void sendFilters(Exec& exec, const ProxyView& view, bool areNew)
    {
        // Words that changed while no filter was asked for never came over.
        if (!m_hasFilters)
        {
            exec.uploadNow(m_filters.data(), view.filters, view.size);
            return;
        }
        if (!areNew)
            return;
        exec.reserve(m_newFilters, m_dirtyCount);
        exec.reserve(m_stagedFilters, m_dirtyCount);
        for (std::uint64_t i = 0; i < m_dirtyCount; ++i)
            m_stagedFilters.data()[i] = view.filters[m_dirtyIsAll ? i : view.dirty[i]];
        exec.upload(m_newFilters.data(), m_stagedFilters.data(), m_dirtyCount);
        exec.forEach(m_dirtyCount, ApplyFilter{dirtyRows(), m_newFilters.data(), m_filters.data()});
    }

    // Rows that a thread packs: with their boxes, or the change bits alone, which takes no longer than to wake a thread.
    static constexpr std::size_t kBoxesGrain = 2048;
    static constexpr std::size_t kBitsGrain = 1u << 16;
    static constexpr std::uint64_t kStageBlock = 1u << 17;
    static constexpr std::uint64_t kScatteredBlock = 1u << 15;

    // From a third of the boxes on: on four threads or sixteen, at 16k to a million boxes.
    static constexpr std::uint32_t kDirectShare = 3;

    WorkerPool m_workers;
    bool m_isFresh = true;
    bool m_hasFilters = false;
    std::uint64_t m_rowCount = 0;  ///< rows that have been sent
    std::uint32_t m_largestId = 0;
    Buffer<Aabb> m_now, m_old;
    Buffer<std::uint8_t> m_changes;
    Buffer<Filter> m_filters;
    Buffer<std::uint32_t> m_uniqueIds;

    bool m_haveAllChanged = false;
    bool m_dirtyIsAll = false;       ///< all rows were sent in the last update
    std::uint64_t m_dirtyCount = 0;  ///< rows sent then
    std::vector<Staged> m_staged;    ///< by task
    Buffer<std::uint32_t> m_dirty;
    Buffer<Aabb> m_newBoxes;
    Buffer<std::uint8_t> m_newChanges;
    Buffer<Filter> m_newFilters;
    Staging<std::uint32_t> m_stagedRows;
    Staging<Aabb> m_stagedBoxes;
    Staging<std::uint8_t> m_stagedChanges;
    Staging<Filter> m_stagedFilters;
};
}  // namespace cullet::psap
