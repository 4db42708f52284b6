// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/threads/ordered_parts.h"
#include "cullet/base/threads/parallel_loops.h"
#include "cullet/broad/backend.h"
#include "cullet/broad/psap/update/upload_staging.h"
#include "cullet/broad/psap/update/upload_steps.h"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace cullet::psap
{
/// The rows of a proxy table in an executor's memory: the boxes of this update and of the last one, what changed, filter
/// words and unique ids.
///
/// Changed rows come over in parts. Each is put into its place while the next is on its way, or still being packed.
template <class Exec>
class TableMirror
{
public:
    /// @param threads for packing
    /// @param initialCapacity as PsapOptions has it: of a small one, small tables come in parts too
    TableMirror(unsigned threads, std::uint64_t initialCapacity)
        : m_workers(threads),
          m_tablePart(std::clamp<std::uint64_t>(initialCapacity * kPartOfCapacity, 1, kTablePart))
    {
    }

    /// The next send() brings everything.
    void forget()
    {
        m_rowCount = 0;
        m_dirtyCount = 0;
        m_areOld = false;
        m_hasFilters = false;
        m_isFresh = true;
    }

    /// Brings the changed rows over; rows that changed in the last update grow old first.
    ///
    /// @param ready  where boxes come in parts on a stream of their own, called with the end of each part but the last:
    ///               rows before it are in place while others are on their way
    template <class Ready>
    void send(Exec& exec, const ProxyView& view, const RowWays& ways, const Ready& ready)
    {
        reserveRows(exec, view.size);
        m_haveAllChanged = m_isFresh || view.dirtyCount == view.size;
        const bool isDirect = isSentDirectly(exec, view);
        const bool sendsAll = m_haveAllChanged || isDirect;
        growOld(exec, view, sendsAll);
        if (view.size > m_rowCount)
            exec.forEachFrom(m_rowCount, view.size,
                             ForgetRow{m_now.data(), m_old.data(), m_changes.data(), sent()});
        m_dirtyIsAll = sendsAll;
        m_dirtyCount = sendsAll ? view.size : view.dirtyCount;
        const Staged all =
            sendsAll ? sendTable(exec, view, isDirect, ways, ready) : sendScattered(exec, view, ways);
        if (view.filters != nullptr)
            sendFilters(exec, view, (all.anyChanges & (kRowCreated | kRowRefiltered)) != 0);
        if ((all.anyChanges & kRowCreated) != 0)
            exec.uploadNow(m_uniqueIds.data(), view.uniqueIds, view.size);
        m_largestId = std::max(m_largestId, all.largestId);
        m_hasFilters = view.filters != nullptr;
        m_rowCount = view.size;
        m_isFresh = false;
    }

    /// Rows that changed in this update grow old already, so that the next one need not begin with that. No more is asked about
    /// this one. Not where all have changed: then two arrays may be exchanged instead.
    void growOldBehind(Exec& exec)
    {
        if (m_dirtyIsAll || m_areOld)
            return;
        ageChanged(exec);
        m_areOld = true;
    }

    std::uint64_t count() const { return m_rowCount; }
    const Aabb* now() const { return m_now.data(); }
    const Aabb* old() const { return m_old.data(); }
    const std::uint8_t* changes() const { return m_changes.data(); }
    const Filter* filters() const { return m_hasFilters ? m_filters.data() : nullptr; }
    const std::uint32_t* uniqueIds() const { return m_uniqueIds.data(); }
    std::uint32_t largestId() const { return m_largestId; }  ///< of those sent
    bool haveAllChanged() const { return m_haveAllChanged; }
    /// A bit for each row that came in this update, others are as they were; null where all came.
    const std::uint32_t* sentRows() const { return m_dirtyIsAll ? nullptr : m_sent.data(); }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;
    template <class T>
    using HostMemory = typename Exec::template Staging<T>;
    using Staged = typename UploadStaging<Exec>::Summary;

    void reserveRows(Exec& exec, std::uint64_t count)
    {
        const std::uint64_t room = std::max<std::uint64_t>(count, 1);
        exec.reserveKeeping(m_now, room, m_rowCount);
        exec.reserveKeeping(m_old, room, m_rowCount);
        exec.reserveKeeping(m_changes, room, m_rowCount);
        exec.reserveKeeping(m_sent, wordsFor(room), wordsFor(m_rowCount));
        exec.reserveKeeping(m_filters, room, m_hasFilters ? m_rowCount : 0);
        exec.reserveKeeping(m_uniqueIds, room, m_rowCount);
        exec.reserveKeeping(m_dirty, room, m_dirtyIsAll ? 0 : m_dirtyCount);
    }

    /// Whether all boxes go over as they are: where many have changed, that takes less than to pick those.
    bool isSentDirectly(const Exec& exec, const ProxyView& view) const
    {
        const bool isMost = m_haveAllChanged || view.dirtyCount > view.size / kDirectShare;
        return isMost && isTableLocked(exec, view);
    }

    static bool isTableLocked(const Exec& exec, const ProxyView& view)
    {
        return view.lockableRows >= view.size && exec.canReach(view.boxes, view.lockableRows);
    }

    /// Makes the boxes of the last update old ones.
    ///
    /// @param sendsAll every row comes anew
    void growOld(Exec& exec, const ProxyView& view, bool sendsAll)
    {
        // What stands here is old altogether then.
        if (!m_isFresh && view.size == m_rowCount && sendsAll)
            std::swap(m_now, m_old);
        else if (!m_areOld)
            ageChanged(exec);
        m_areOld = false;
    }

    void ageChanged(Exec& exec)
    {
        exec.forEach(m_dirtyCount, AgeRow{dirtyRows(), m_now.data(), m_old.data(), m_changes.data(), sent()});
    }

    static std::uint64_t wordsFor(std::uint64_t rows) { return (rows + 31) / 32; }
    RowBits sent() const { return RowBits{m_sent.data()}; }
    const std::uint32_t* dirtyRows() const { return m_dirtyIsAll ? nullptr : m_dirty.data(); }

    /// Sends all boxes and puts them into their places.
    ///
    /// @param isDirect from the table itself, which is not packed
    template <class Ready>
    Staged sendTable(Exec& exec, const ProxyView& view, bool isDirect, const RowWays& ways,
                     const Ready& ready)
    {
        const std::uint64_t room = std::max<std::uint64_t>(m_dirtyCount, 1);
        m_staging.reserve(exec, room, !isDirect);
        if (m_dirtyCount <= std::min(kMostRead, m_tablePart))
            return sendToRead(exec, view, isDirect, ways);
        exec.reserve(m_newBoxes, room);
        exec.reserve(m_newChanges, room);
        if (isDirect)
            exec.uploadParts(m_newBoxes.data(), view.boxes, m_dirtyCount, m_tablePart);
        Staged all;
        for (std::uint64_t begin = 0; begin < m_dirtyCount; begin += m_tablePart)
        {
            const std::uint64_t end = std::min(begin + m_tablePart, m_dirtyCount);
            const Staged staged = stageTable(view, begin, end, !isDirect);
            if (isDirect)
                exec.awaitPart(begin / m_tablePart);
            else
                exec.upload(m_newBoxes.data() + begin, m_staging.boxes() + begin, end - begin);
            // Mostly they have all moved and nothing else, which need not be told of each.
            if (!staged.isUniform())
                exec.upload(m_newChanges.data() + begin, m_staging.changes() + begin, end - begin);
            apply(exec, begin, end, {m_newBoxes.data(), false, m_newChanges.data(), nullptr}, staged, ways);
            all.add(staged);
            if (isDirect && end != m_dirtyCount)
                ready(end);
        }
        return all;
    }

    /// The same for a small table: the step that puts boxes into place reads them from the memory of the CPU.
    Staged sendToRead(Exec& exec, const ProxyView& view, bool isDirect, const RowWays& ways)
    {
        const Staged staged = stageTable(view, 0, m_dirtyCount, !isDirect);
        apply(exec, 0, m_dirtyCount,
              {exec.mapped(isDirect ? view.boxes : m_staging.boxes(), m_dirtyCount), false,
               exec.mapped(m_staging.changes(), 0), nullptr},
              staged, ways);
        return staged;
    }

    /// Where the changed rows are to be read.
    struct Source
    {
        const Aabb* boxes;
        bool isTable;  ///< boxes by row, not one after the other
        const std::uint8_t* changes;
        const std::uint32_t* rows;
    };

    /// Sends the rows that the dirty list names and puts them into their places; a step reads them from the memory of
    /// the CPU. It picks the first ones from the table itself: slower than to read packed ones, but done while threads
    /// wake up and pack the others.
    Staged sendScattered(Exec& exec, const ProxyView& view, const RowWays& ways)
    {
        m_areRowsTold = view.anyChanges == kRowMoved && view.lockableDirty >= m_dirtyCount &&
                        exec.canReach(view.dirty, view.lockableDirty);
        const std::uint64_t some = m_dirtyCount <= kMostPicked ? m_dirtyCount : kPickedFirst;
        const std::uint64_t picked = isTableLocked(exec, view) ? some : 0;
        m_staging.reserve(exec, m_dirtyCount, picked != m_dirtyCount);
        if (picked == m_dirtyCount)
            return sendPicked(exec, view, picked, ways);
        OrderedParts parts({picked, m_dirtyCount}, kPackGrain, kTasksPerPart);
        Staged all;
        const auto sendAll = [&]
        {
            all = sendPicked(exec, view, picked, ways);
            all.add(sendPacked(exec, view, parts, ways));
        };
        if (parts.tasks() == 1)
            sendAll();
        else
            m_workers.together(
                [&]
                {
                    m_workers.expect(parts.tasks());
                    sendAll();
                });
        return all;
    }

    /// Sends the first rows of the dirty list, whose boxes the executor picks from the table.
    Staged sendPicked(Exec& exec, const ProxyView& view, std::uint64_t count, const RowWays& ways)
    {
        if (m_areRowsTold)
        {
            if (count == 0)
                return Staged::ofMoved();
            apply(exec, 0, count,
                  {exec.mapped(view.boxes, count), true, nullptr, exec.mapped(view.dirty, count)},
                  Staged::ofMoved(), ways);
            return Staged::ofMoved();
        }
        Staged all;
        for (std::uint64_t begin = 0; begin < count; begin += kPickedPart)
        {
            const std::uint64_t end = std::min(begin + kPickedPart, count);
            const Staged staged = m_staging.stageRows(view, begin, end);
            apply(exec, begin, end,
                  {exec.mapped(view.boxes, end - begin), true, exec.mapped(m_staging.changes(), 0),
                   exec.mapped(m_staging.rows(), end - begin)},
                  staged, ways);
            all.add(staged);
        }
        return all;
    }

    /// Packs rows on threads and sends each part as soon as it is packed.
    Staged sendPacked(Exec& exec, const ProxyView& view, OrderedParts& parts, const RowWays& ways)
    {
        m_summaries.assign(parts.tasks(), {});
        Staged all;
        const auto send = [&](OrderedParts::Range items, unsigned firstTask, unsigned endTask)
        {
            const std::uint64_t count = items.end - items.begin;
            const Staged staged = sumOfTasks(firstTask, endTask);
            apply(exec, items.begin, items.end,
                  {exec.mapped(m_staging.boxes(), count), false, exec.mapped(m_staging.changes(), 0),
                   exec.mapped(m_areRowsTold ? view.dirty : m_staging.rows(), count)},
                  staged, ways);
            all.add(staged);
        };
        m_workers.run(parts.tasks(),
                      [&](unsigned task, unsigned thread)
                      {
                          const OrderedParts::Range items = parts.itemsOfTask(task);
                          m_summaries[task] = stageScattered(view, items);
                          parts.finish(task);
                          if (thread == 0)
                              parts.takeReady(send);
                      });
        parts.takeReady(send);
        return all;
    }

    Staged stageScattered(const ProxyView& view, OrderedParts::Range items)
    {
        if (!m_areRowsTold)
            return m_staging.stageRowsAndBoxes(view, items.begin, items.end);
        m_staging.stageBoxes(view, items.begin, items.end);
        return Staged::ofMoved();
    }

    Staged sumOfTasks(unsigned first, unsigned end) const
    {
        Staged sum;
        for (unsigned task = first; task < end; ++task)
            sum.add(m_summaries[task]);
        return sum;
    }

    /// Stores some changed rows.
    void apply(Exec& exec, std::uint64_t begin, std::uint64_t end, const Source& source, const Staged& staged,
               const RowWays& ways)
    {
        exec.forEachFrom(
            begin, end,
            ApplyRow{source.rows, source.boxes, source.isTable, staged.isUniform() ? nullptr : source.changes,
                     static_cast<std::uint8_t>(staged.anyChanges), m_now.data(), m_old.data(),
                     m_changes.data(), m_dirty.data(), sent(), ways});
    }

    /// Packs some rows where all have changed, on threads: on one core a million would take longer than everything else.
    Staged stageTable(const ProxyView& view, std::uint64_t begin, std::uint64_t end, bool packsBoxes)
    {
        const unsigned tasks = m_workers.tasksFor(end - begin, packsBoxes ? kBoxesGrain : kBitsGrain);
        m_summaries.assign(tasks, {});
        m_workers.run(tasks,
                      [&](unsigned task)
                      {
                          const std::uint64_t first = begin + (end - begin) * task / tasks;
                          const std::uint64_t last = begin + (end - begin) * (task + 1) / tasks;
                          m_summaries[task] = m_staging.stageTable(view, first, last, packsBoxes, m_isFresh);
                      });
        return sumOfTasks(0, tasks);
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

    // Rows of the table that a thread packs at the least: with their boxes, or the change bits alone, which takes no longer
    // than to wake a thread.
    static constexpr std::size_t kBoxesGrain = 2048;
    static constexpr std::size_t kBitsGrain = 1u << 16;

    // Boxes that a device reads itself in less time than a copy and a launch behind it take.
    static constexpr std::uint64_t kMostRead = 1u << 13;

    // Rows that are sent at once where all are, at most and for each one of the initial capacity.
    static constexpr std::uint64_t kTablePart = 1u << 17;
    static constexpr std::uint64_t kPartOfCapacity = 128;

    // Scattered rows: so many are picked by a GPU in the time that sixteen threads take to wake up and pack as many, and so many
    // until the first that are packed can be read. Tasks are short, since threads come one after the other; parts are long, since
    // each costs a launch.
    static constexpr std::uint64_t kMostPicked = 1u << 15;
    static constexpr std::uint64_t kPickedFirst = 1u << 14;
    static constexpr std::uint64_t kPickedPart = 1u << 14;
    static constexpr std::uint64_t kPackGrain = 512;
    static constexpr unsigned kTasksPerPart = 60;

    // From a third of the boxes on: on four threads or sixteen, at 16k to a million boxes.
    static constexpr std::uint32_t kDirectShare = 3;

    ParallelLoops m_workers;
    std::uint64_t m_tablePart;
    bool m_isFresh = true;
    bool m_hasFilters = false;
    std::uint64_t m_rowCount = 0;  ///< rows that have been sent
    std::uint32_t m_largestId = 0;
    Buffer<Aabb> m_now, m_old;
    Buffer<std::uint8_t> m_changes;
    Buffer<std::uint32_t> m_sent;  ///< as RowBits has them
    Buffer<Filter> m_filters;
    Buffer<std::uint32_t> m_uniqueIds;

    bool m_haveAllChanged = false;
    bool m_areRowsTold = false;  ///< scattered rows have only moved, and are read from the dirty list itself
    bool m_dirtyIsAll = false;   ///< all rows were sent in the last update
    bool m_areOld = false;       ///< those that were are old ones already
    std::uint64_t m_dirtyCount = 0;  ///< rows sent then
    UploadStaging<Exec> m_staging;
    std::vector<Staged> m_summaries;  ///< by task
    Buffer<std::uint32_t> m_dirty;
    Buffer<Aabb> m_newBoxes;
    Buffer<std::uint8_t> m_newChanges;
    Buffer<Filter> m_newFilters;
    HostMemory<Filter> m_stagedFilters;
};
}  // namespace cullet::psap
