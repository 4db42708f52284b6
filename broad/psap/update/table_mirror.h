// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/threads/ordered_parts.h"
#include "cullet/base/threads/parallel_loops.h"
#include "cullet/broad/backend.h"
#include "cullet/broad/psap/update/filter_mirror.h"
#include "cullet/broad/psap/update/upload_staging.h"
#include "cullet/broad/psap/update/upload_steps.h"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace cullet::psap
{
/// The rows of a proxy table in an executor's memory: the boxes of this update and of the previous one, the change
/// bits, filter words and unique ids.
///
/// Changed rows are uploaded in parts. Each part is stored while the next one is being uploaded or packed.
template <class Exec>
class TableMirror
{
public:
    /// @param threads         threads that pack rows
    /// @param initialCapacity PsapOptions::initialCapacity; if it is small, small tables are uploaded in parts too
    TableMirror(unsigned threads, std::uint64_t initialCapacity)
        : m_workers(threads),
          m_tablePart(std::clamp<std::uint64_t>(initialCapacity * kPartOfCapacity, 1, kTablePart))
    {
    }

    /// Makes the next send() upload all rows.
    void forget()
    {
        m_rowCount = 0;
        m_dirtyCount = 0;
        m_filters.forget();
        m_last = Upload::None;
    }

    /// Uploads the changed rows, after copying the rows that changed in the last update to the previous boxes.
    ///
    /// @param onPart called with the end of each part but the last, where boxes are uploaded in parts on a stream of
    ///     their own: rows before that end are in place while later ones are being uploaded
    template <class OnPart>
    void send(Exec& exec, const ProxyView& view, const MotionRecorder& motion, const OnPart& onPart)
    {
        reserveRows(exec, view.size);
        const bool isFirst = m_last == Upload::None;
        m_haveAllChanged = isFirst || view.dirtyCount == view.size;
        const bool isDirect = isSentDirectly(exec, view);
        const bool sendsAll = m_haveAllChanged || isDirect;
        const Sending sending = {view, motion, isFirst, !sendsAll && canReadDirtyList(exec, view)};
        copyToPrevious(exec, view, sendsAll);
        if (view.size > m_rowCount)
            exec.forEachFrom(m_rowCount, view.size,
                             ClearRow{m_now.data(), m_old.data(), m_changes.data(), sent()});
        m_last = sendsAll ? Upload::All : Upload::Some;
        m_dirtyCount = sendsAll ? view.size : view.dirtyCount;
        const Staged all =
            sendsAll ? sendTable(exec, sending, isDirect, onPart) : sendScattered(exec, sending);
        m_filters.send(exec, view, (all.anyChanges & (kRowCreated | kRowRefiltered)) != 0, dirtyRows(),
                       m_dirtyCount);
        if ((all.anyChanges & kRowCreated) != 0)
            exec.uploadAndWait(m_uniqueIds.data(), view.uniqueIds, view.size);
        m_largestId = std::max(m_largestId, all.largestId);
        m_rowCount = view.size;
    }

    /// Copies rows that changed in this update to the previous boxes already after this update, so that the next one
    /// need not begin with that. The caller must have finished with this update. Does nothing where all rows have
    /// changed: the two arrays are swapped instead.
    void copyToPreviousEarly(Exec& exec)
    {
        if (m_last != Upload::Some)
            return;
        copyChangedToPrevious(exec);
        m_last = Upload::SomeCopied;
    }

    std::uint64_t count() const { return m_rowCount; }
    const Aabb* now() const { return m_now.data(); }
    const Aabb* old() const { return m_old.data(); }
    const std::uint8_t* changes() const { return m_changes.data(); }
    const Filter* filters() const { return m_filters.words(); }
    const std::uint32_t* uniqueIds() const { return m_uniqueIds.data(); }
    std::uint32_t largestId() const { return m_largestId; }  ///< largest unique id that was uploaded
    bool haveAllChanged() const { return m_haveAllChanged; }
    /// A bit for each row, set for rows that were uploaded in this update; null where all were.
    const std::uint32_t* sentRows() const { return m_last == Upload::All ? nullptr : m_sent.data(); }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;
    using Staged = typename UploadStaging<Exec>::Summary;

    /// What the last send() uploaded, and whether its rows are in m_old already:
    ///
    ///   forget()            {all rows}                   {some rows}         {copyToPreviousEarly()}
    ///   -------> None ----------------> All <---------------------> Some ----------------------> SomeCopied
    ///                                    ^---------------------------^------------- {the next} ------'
    enum class Upload : std::uint8_t
    {
        None,
        All,
        Some,  ///< those of m_dirty
        SomeCopied
    };

    /// One call of send().
    struct Sending
    {
        const ProxyView& view;
        const MotionRecorder& motion;
        bool isFirst;         ///< the executor has none of the rows yet
        bool readsDirtyList;  ///< steps read the dirty list itself: rows have only moved
    };

    void reserveRows(Exec& exec, std::uint64_t count)
    {
        const std::uint64_t room = std::max<std::uint64_t>(count, 1);
        exec.reserveKeeping(m_now, room, m_rowCount);
        exec.reserveKeeping(m_old, room, m_rowCount);
        exec.reserveKeeping(m_changes, room, m_rowCount);
        exec.reserveKeeping(m_sent, wordsFor(room), wordsFor(m_rowCount));
        m_filters.reserve(exec, room, m_rowCount);
        exec.reserveKeeping(m_uniqueIds, room, m_rowCount);
        exec.reserveKeeping(m_dirty, room, m_last == Upload::All ? 0 : m_dirtyCount);
    }

    /// Whether all boxes are uploaded directly from the table: where many have changed, that is faster than packing
    /// those.
    bool isSentDirectly(const Exec& exec, const ProxyView& view) const
    {
        const bool isMost = m_haveAllChanged || view.dirtyCount > view.size / kDirectShare;
        return isMost && isTableLocked(exec, view);
    }

    static bool canReadDirtyList(const Exec& exec, const ProxyView& view)
    {
        return view.anyChanges == kRowMoved && view.lockableDirty >= view.dirtyCount &&
               exec.canAccessDirectly(view.dirty, view.lockableDirty);
    }

    static bool isTableLocked(const Exec& exec, const ProxyView& view)
    {
        return view.lockableRows >= view.size && exec.canAccessDirectly(view.boxes, view.lockableRows);
    }

    /// Makes the boxes of the last update the previous ones.
    ///
    /// @param sendsAll every row is uploaded anew
    void copyToPrevious(Exec& exec, const ProxyView& view, bool sendsAll)
    {
        // All current boxes become previous ones.
        if (m_last != Upload::None && view.size == m_rowCount && sendsAll)
            std::swap(m_now, m_old);
        else if (m_last != Upload::SomeCopied)
            copyChangedToPrevious(exec);
    }

    void copyChangedToPrevious(Exec& exec)
    {
        exec.forEach(m_dirtyCount,
                     CopyRowToPrevious{dirtyRows(), m_now.data(), m_old.data(), m_changes.data(), sent()});
    }

    static std::uint64_t wordsFor(std::uint64_t rows) { return (rows + 31) / 32; }
    RowBits sent() const { return RowBits{m_sent.data()}; }
    const std::uint32_t* dirtyRows() const { return m_last == Upload::All ? nullptr : m_dirty.data(); }

    /// Uploads all boxes and stores them in place.
    ///
    /// @param isDirect uploads from the table itself, without packing
    template <class OnPart>
    Staged sendTable(Exec& exec, const Sending& sending, bool isDirect, const OnPart& onPart)
    {
        const std::uint64_t room = std::max<std::uint64_t>(m_dirtyCount, 1);
        m_staging.reserve(exec, room, !isDirect);
        if (m_dirtyCount <= std::min(kMostRead, m_tablePart))
            return sendMapped(exec, sending, isDirect);
        exec.reserve(m_newBoxes, room);
        exec.reserve(m_newChanges, room);
        if (isDirect)
            exec.uploadParts(m_newBoxes.data(), sending.view.boxes, m_dirtyCount, m_tablePart);
        Staged all;
        for (std::uint64_t begin = 0; begin < m_dirtyCount; begin += m_tablePart)
        {
            const std::uint64_t end = std::min(begin + m_tablePart, m_dirtyCount);
            const Staged staged = stageTable(sending, begin, end, !isDirect);
            if (isDirect)
                exec.awaitPart(begin / m_tablePart);
            else
                exec.upload(m_newBoxes.data() + begin, m_staging.boxes() + begin, end - begin);
            // Usually all rows have moved and nothing else, so that no change bits per row are needed.
            if (!staged.isUniform())
                exec.upload(m_newChanges.data() + begin, m_staging.changes() + begin, end - begin);
            apply(exec, begin, end, {m_newBoxes.data(), false, m_newChanges.data(), nullptr}, staged,
                  sending.motion);
            all.add(staged);
            if (isDirect && end != m_dirtyCount)
                onPart(end);
        }
        return all;
    }

    /// sendTable() for a small table: the step that stores the boxes reads them from the memory of the CPU.
    Staged sendMapped(Exec& exec, const Sending& sending, bool isDirect)
    {
        const Staged staged = stageTable(sending, 0, m_dirtyCount, !isDirect);
        apply(exec, 0, m_dirtyCount,
              {exec.mapped(isDirect ? sending.view.boxes : m_staging.boxes(), m_dirtyCount), false,
               exec.mapped(m_staging.changes(), 0), nullptr},
              staged, sending.motion);
        return staged;
    }

    /// Addresses from which a step reads changed rows.
    struct Source
    {
        const Aabb* boxes;
        bool isTable;  ///< boxes are indexed by row, not by position in the list
        const std::uint8_t* changes;
        const std::uint32_t* rows;
    };

    /// Uploads the rows in the dirty list and stores them in place; a step reads them from the memory of the CPU. It
    /// gathers the first ones from the table itself. That is slower than reading packed rows, but runs while threads
    /// wake up and pack the others.
    Staged sendScattered(Exec& exec, const Sending& sending)
    {
        const std::uint64_t some = m_dirtyCount <= kMostPicked ? m_dirtyCount : kPickedFirst;
        const std::uint64_t picked = isTableLocked(exec, sending.view) ? some : 0;
        m_staging.reserve(exec, m_dirtyCount, picked != m_dirtyCount);
        if (picked == m_dirtyCount)
            return sendPicked(exec, sending, picked);
        OrderedParts parts({picked, m_dirtyCount}, kPackGrain, kTasksPerPart);
        Staged all;
        const auto sendAll = [&]
        {
            all = sendPicked(exec, sending, picked);
            all.add(sendPacked(exec, sending, parts));
        };
        if (parts.tasks() == 1)
            sendAll();
        else
            m_workers.runRegion(
                [&]
                {
                    m_workers.prewake(parts.tasks());
                    sendAll();
                });
        return all;
    }

    /// Uploads the first rows of the dirty list; the executor gathers their boxes from the table.
    Staged sendPicked(Exec& exec, const Sending& sending, std::uint64_t count)
    {
        const ProxyView& view = sending.view;
        if (sending.readsDirtyList)
        {
            if (count == 0)
                return Staged::ofMoved();
            apply(exec, 0, count,
                  {exec.mapped(view.boxes, count), true, nullptr, exec.mapped(view.dirty, count)},
                  Staged::ofMoved(), sending.motion);
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
                  staged, sending.motion);
            all.add(staged);
        }
        return all;
    }

    /// Packs rows on several threads and uploads each part as soon as it is packed.
    Staged sendPacked(Exec& exec, const Sending& sending, OrderedParts& parts)
    {
        m_summaries.assign(parts.tasks(), {});
        Staged all;
        const auto send = [&](OrderedParts::Range items, unsigned firstTask, unsigned endTask)
        {
            const std::uint64_t count = items.end - items.begin;
            const Staged staged = sumOfTasks(firstTask, endTask);
            apply(exec, items.begin, items.end,
                  {exec.mapped(m_staging.boxes(), count), false, exec.mapped(m_staging.changes(), 0),
                   exec.mapped(sending.readsDirtyList ? sending.view.dirty : m_staging.rows(), count)},
                  staged, sending.motion);
            all.add(staged);
        };
        m_workers.run(parts.tasks(),
                      [&](unsigned task, unsigned thread)
                      {
                          const OrderedParts::Range items = parts.itemsOfTask(task);
                          m_summaries[task] = stageScattered(sending, items);
                          parts.finish(task);
                          if (thread == 0)
                              parts.deliverReady(send);
                      });
        parts.deliverReady(send);
        return all;
    }

    Staged stageScattered(const Sending& sending, OrderedParts::Range items)
    {
        if (!sending.readsDirtyList)
            return m_staging.stageRowsAndBoxes(sending.view, items.begin, items.end);
        m_staging.stageBoxes(sending.view, items.begin, items.end);
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
               const MotionRecorder& motion)
    {
        exec.forEachFrom(
            begin, end,
            ApplyRow{source.rows, source.boxes, source.isTable, staged.isUniform() ? nullptr : source.changes,
                     static_cast<std::uint8_t>(staged.anyChanges), m_now.data(), m_old.data(),
                     m_changes.data(), m_dirty.data(), sent(), motion});
    }

    /// Packs some rows where all have changed, on several threads: on one core, packing a million rows would take
    /// longer than the rest of the update.
    Staged stageTable(const Sending& sending, std::uint64_t begin, std::uint64_t end, bool packsBoxes)
    {
        const unsigned tasks = m_workers.tasksFor(end - begin, packsBoxes ? kBoxesGrain : kBitsGrain);
        m_summaries.assign(tasks, {});
        m_workers.run(tasks,
                      [&](unsigned task)
                      {
                          const std::uint64_t first = begin + (end - begin) * task / tasks;
                          const std::uint64_t last = begin + (end - begin) * (task + 1) / tasks;
                          m_summaries[task] =
                              m_staging.stageTable(sending.view, first, last, packsBoxes, sending.isFirst);
                      });
        return sumOfTasks(0, tasks);
    }

    // Least number of rows that a thread packs: with boxes, and with change bits only. Packing so many takes as long
    // as waking a thread.
    static constexpr std::size_t kBoxesGrain = 2048;
    static constexpr std::size_t kBitsGrain = 1u << 16;

    // Up to so many boxes, a device reads mapped memory in less time than a copy followed by a launch takes.
    static constexpr std::uint64_t kMostRead = 1u << 13;

    // Rows per part of a table that is uploaded as a whole: the most, and for each unit of the initial capacity.
    static constexpr std::uint64_t kTablePart = 1u << 17;
    static constexpr std::uint64_t kPartOfCapacity = 128;

    // Scattered rows: a GPU gathers kMostPicked of them in the time in which sixteen threads wake up and pack as
    // many, and kPickedFirst in the time until the first packed ones can be read. Tasks are short, since threads wake
    // up one after the other; parts are long, since each costs a launch.
    static constexpr std::uint64_t kMostPicked = 1u << 15;
    static constexpr std::uint64_t kPickedFirst = 1u << 14;
    static constexpr std::uint64_t kPickedPart = 1u << 14;
    static constexpr std::uint64_t kPackGrain = 512;
    static constexpr unsigned kTasksPerPart = 60;

    // Share of changed boxes above which all are uploaded: a third, on four threads or sixteen, at 16k to a million
    // boxes.
    static constexpr std::uint32_t kDirectShare = 3;

    ParallelLoops m_workers;
    std::uint64_t m_tablePart;
    Upload m_last = Upload::None;
    std::uint64_t m_rowCount = 0;  ///< rows that have been uploaded
    std::uint32_t m_largestId = 0;
    Buffer<Aabb> m_now, m_old;
    Buffer<std::uint8_t> m_changes;
    Buffer<std::uint32_t> m_sent;  ///< words of RowBits
    FilterMirror<Exec> m_filters;
    Buffer<std::uint32_t> m_uniqueIds;

    bool m_haveAllChanged = false;
    std::uint64_t m_dirtyCount = 0;  ///< rows uploaded in the last update
    UploadStaging<Exec> m_staging;
    std::vector<Staged> m_summaries;  ///< indexed by task
    Buffer<std::uint32_t> m_dirty;
    Buffer<Aabb> m_newBoxes;
    Buffer<std::uint8_t> m_newChanges;
};
}  // namespace cullet::psap
