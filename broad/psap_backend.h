// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/backend.h"
#include "broad/known_rows.h"
#include "broad/log.h"
#include "broad/psap_failure.h"
#include "broad/psap_names.h"
#include "broad/psap_pipeline.h"
#include "broad/worker_pool.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <new>
#include <stdexcept>
#include <utility>
#include <vector>

namespace cullet::psap
{
/// Keeps the pair set of a proxy table up to date with one of the searches, on one executor.
///
/// In the executor's memory live the boxes of this update and of the last one and the held pairs, as rows. An update
/// sends the changed rows, settles the held pairs, searches, and brings back the pairs that enter and those that leave.
/// The order in which pairs are found may differ from run to run; deltas are sorted by unique id.
template <class Exec>
class PsapBackend final : public Backend
{
public:
    template <class... ExecArguments>
    PsapBackend(const PsapOptions& options, const char* name, ExecArguments&&... arguments)
        : m_options(options),
          m_name(name),
          m_workers(options.threads),
          m_exec(std::forward<ExecArguments>(arguments)...),
          m_search(options)
    {
    }

    Status update(const ProxyView& proxies, PairDelta& delta) override
    {
        delta.added.clear();
        delta.removed.clear();
        Status status = Status::OutOfMemory;
        try
        {
            const typename Exec::Use use(m_exec);
            updateOrThrow(proxies, delta);
            return Status::Ok;
        }
        catch (const ExecutorFailure& failure)
        {
            status = failure.status;
            char text[200];
            std::snprintf(text, sizeof(text), "%s: %s: %s", m_name, failure.call, failure.reason);
            log(LogLevel::Info, text);
        }
        catch (const std::bad_alloc&)
        {
        }
        catch (const std::length_error&)
        {
        }
        // Half of what the search remembers may never have happened.
        m_search = Search<Exec>(m_options);
        restart({});
        delta.added.clear();
        delta.removed.clear();
        return status;
    }

    void restart(const std::vector<Pair>& known) override
    {
        m_known = known;
        m_isFresh = true;
        m_heldCount = 0;
        m_dirtyCount = 0;
    }

    const char* name() const noexcept override { return m_name; }

    BackendStats stats() const override
    {
        BackendStats stats = m_stats;
        stats.bytes = m_exec.bytes();
        return stats;
    }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;
    template <class T>
    using Staging = typename Exec::template Staging<T>;

    void updateOrThrow(const ProxyView& view, PairDelta& delta)
    {
        m_stats.path = "idle";
        m_stats.candidates = 0;
        m_stats.bytesMoved = 0;
        m_stats.stages.clear();
        const bool hasFilters = view.filters != nullptr;
        if (!m_isFresh && view.dirtyCount == 0 && view.margin == m_margin && hasFilters == m_hadFilters)
            return;
        m_stats.path = "rebuild";
        ++m_stats.rebuildsTotal;
        m_retestAll = m_hadFilters && !hasFilters;
        m_vanished.clear();
        if (m_isFresh)
            begin(view);
        m_exec.dropStages();
        m_exec.beginStage("upload");
        sendRows(view);
        findChanges(view);
        m_exec.beginStage("deltas");
        takeChanges(delta);
        m_exec.beginStage(nullptr);
        m_exec.takeStages(m_stats.stages);
        m_stats.bytesMoved = m_exec.takeBytesMoved();
        m_margin = view.margin;
        m_hadFilters = hasFilters;
        m_isFresh = false;
    }

    /// Forgets every row and takes over the pairs given to restart().
    void begin(const ProxyView& view)
    {
        m_rowCount = 0;
        m_dirtyCount = 0;
        m_retestAll = false;
        std::vector<IdPair> held;
        splitKnown(m_known, view, held, m_vanished);
        m_heldCount = held.size();
        m_exec.reserve(m_held, std::max<std::uint64_t>(m_heldCount, m_options.initialCapacity));
        m_exec.uploadNow(m_held.data(), held.data(), held.size());
    }

    void reserveRows(std::uint64_t count, std::uint64_t used)
    {
        const std::uint64_t room = std::max<std::uint64_t>(count, 1);
        m_exec.reserveKeeping(m_now, room, used);
        m_exec.reserveKeeping(m_old, room, used);
        m_exec.reserveKeeping(m_changes, room, used);
        m_exec.reserveKeeping(m_filters, room, m_hadFilters ? used : 0);
        m_exec.reserveKeeping(m_uniqueIds, room, used);
        m_exec.reserveKeeping(m_dirty, room, m_dirtyIsAll ? 0 : m_dirtyCount);
    }

    /// Brings the changed rows over; rows that changed in the last update grow old first.
    void sendRows(const ProxyView& view)
    {
        reserveRows(view.size, m_rowCount);
        growOld(view);
        if (view.size > m_rowCount)
            m_exec.forEachFrom(m_rowCount, view.size,
                               ForgetRow{m_now.data(), m_old.data(), m_changes.data()});
        m_dirtyIsAll = m_isFresh || view.dirtyCount == view.size;
        m_dirtyCount = m_dirtyIsAll ? view.size : view.dirtyCount;
        const Staged staged = stage(view);
        // Words that changed while no filter was asked for never came over.
        const bool sendsFilters = view.filters != nullptr;
        if (sendsFilters && !m_hadFilters)
            m_exec.uploadNow(m_filters.data(), view.filters, view.size);
        const bool hasNewFilters = sendsFilters && (staged.changes & (kRowCreated | kRowRefiltered)) != 0;
        if (hasNewFilters)
            stageFilters(view);
        if ((staged.changes & kRowCreated) != 0)
            m_exec.uploadNow(m_uniqueIds.data(), view.uniqueIds, view.size);
        m_largestId = std::max(m_largestId, staged.largestId);
        m_exec.reserve(m_motion, 1);
        m_exec.clear(m_motion.data(), 1);
        m_exec.forEach(
            m_dirtyCount,
            ApplyRow{m_dirtyIsAll ? nullptr : m_dirty.data(), m_newBoxes.data(), m_newChanges.data(),
                     hasNewFilters ? m_newFilters.data() : nullptr, m_now.data(), m_old.data(),
                     m_changes.data(), m_filters.data(), m_motion.data()});
        m_rowCount = view.size;
    }

    /// Makes the boxes of the last update old ones.
    void growOld(const ProxyView& view)
    {
        // Where every row comes anew, what stands here is old altogether.
        if (!m_isFresh && view.size == m_rowCount && view.dirtyCount == view.size)
            std::swap(m_now, m_old);
        else
            m_exec.forEach(m_dirtyCount, AgeRow{m_dirtyIsAll ? nullptr : m_dirty.data(), m_now.data(),
                                                m_old.data(), m_changes.data()});
    }

    /// What is known of all changed rows together.
    struct Staged
    {
        unsigned changes = kRowUnchanged;  ///< RowChange bits of all of them
        std::uint32_t largestId = 0;       ///< of those created
    };

    /// Packs the changed rows and sends them.
    Staged stage(const ProxyView& view)
    {
        const std::uint64_t count = std::max<std::uint64_t>(m_dirtyCount, 1);
        m_exec.reserve(m_stagedChanges, count);
        m_exec.reserve(m_stagedRows, count);
        m_exec.reserve(m_newBoxes, count);
        m_exec.reserve(m_newChanges, count);
        m_exec.reserve(m_newFilters, count);
        const bool isDirect = m_dirtyIsAll && view.lockableRows >= m_dirtyCount &&
                              m_exec.canUploadFrom(view.boxes, view.lockableRows);
        if (isDirect)
            m_exec.upload(m_newBoxes.data(), view.boxes, m_dirtyCount);
        else
            m_exec.reserve(m_stagedBoxes, count);
        Staged all;
        // In blocks, so that the executor's machine copies one while the CPU packs the next.
        const std::uint64_t block = m_dirtyIsAll ? kStageBlock : kScatteredBlock;
        for (std::uint64_t begin = 0; begin < m_dirtyCount; begin += block)
        {
            const std::uint64_t end = std::min(begin + block, m_dirtyCount);
            stageBlock(view, begin, end, !isDirect, all);
            if (!isDirect)
                m_exec.upload(m_newBoxes.data() + begin, m_stagedBoxes.data() + begin, end - begin);
        }
        m_exec.upload(m_newChanges.data(), m_stagedChanges.data(), m_dirtyCount);
        if (!m_dirtyIsAll)
            m_exec.upload(m_dirty.data(), m_stagedRows.data(), m_dirtyCount);
        return all;
    }

    /// Packs some of the changed rows on threads: on one core a million would take longer than everything else.
    void stageBlock(const ProxyView& view, std::uint64_t begin, std::uint64_t end, bool packsBoxes,
                    Staged& all)
    {
        const unsigned tasks = m_workers.tasksFor(end - begin, kStageGrain);
        m_staged.assign(tasks, {});
        m_workers.run(tasks,
                      [&](unsigned task)
                      {
                          m_staged[task] = stageRange(view, begin + (end - begin) * task / tasks,
                                                      begin + (end - begin) * (task + 1) / tasks, packsBoxes);
                      });
        for (const Staged& part : m_staged)
        {
            all.changes |= part.changes;
            all.largestId = std::max(all.largestId, part.largestId);
        }
    }

    /// Packs some of the changed rows.
    Staged stageRange(const ProxyView& view, std::uint64_t begin, std::uint64_t end, bool packsBoxes)
    {
        // Pointers in variables: a store of a byte may change whatever it is that a member points to.
        Aabb* boxes = m_stagedBoxes.data();
        std::uint8_t* changes = m_stagedChanges.data();
        std::uint32_t* rows = m_stagedRows.data();
        const unsigned fresh = m_isFresh ? kRowCreated : kRowUnchanged;
        unsigned all = fresh;
        if (m_dirtyIsAll)
        {
            if (packsBoxes)
                std::copy(view.boxes + begin, view.boxes + end, boxes + begin);
            for (std::uint64_t row = begin; row < end; ++row)
            {
                changes[row] = static_cast<std::uint8_t>(view.changes[row] | fresh);
                all |= changes[row];
            }
        }
        else
        {
            const ProxyView from = view;
            for (std::uint64_t i = begin; i < end; ++i)
            {
                // A cache line or two for each row: they come sixteen rows before they are needed.
                prefetchBox(from.boxes + from.dirty[std::min(i + 16, end - 1)]);
                const std::uint32_t row = from.dirty[i];
                rows[i] = row;
                boxes[i] = from.boxes[row];
                changes[i] = from.changes[row];
                all |= from.changes[row];
            }
        }
        return {all, (all & kRowCreated) != 0 ? largestId(view, begin, end) : 0};
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

    void stageFilters(const ProxyView& view)
    {
        m_exec.reserve(m_stagedFilters, m_dirtyCount);
        for (std::uint64_t i = 0; i < m_dirtyCount; ++i)
            m_stagedFilters.data()[i] = view.filters[m_dirtyIsAll ? i : view.dirty[i]];
        m_exec.upload(m_newFilters.data(), m_stagedFilters.data(), m_dirtyCount);
    }

    /// Settles the held pairs and searches, again with more room as long as a list was too short.
    void findChanges(const ProxyView& view)
    {
        m_exec.reserve(m_counters, 1);
        m_exec.reserve(m_stagedCounts, 1);
        m_exec.reserve(m_kept, std::max<std::uint64_t>(m_heldCount, m_options.initialCapacity));
        m_exec.reserve(m_removed, std::max<std::uint64_t>(m_heldCount, m_options.initialCapacity));
        m_exec.reserve(m_added, m_options.initialCapacity);
        growLookup(m_options.initialCapacity);
        m_exec.beginStage("sort");
        m_search.build(m_exec, {m_now.data(), m_rowCount});
        m_exec.beginStage("settle");
        settle(view);
        m_exec.beginStage("search");
        emit(view);
        while (m_counts.lookups > table().limit())
        {
            growLookup(2 * m_counts.lookups);
            settle(view);
            emit(view);
        }
        while (m_counts.added > m_added.size())
        {
            m_exec.reserve(m_added, m_counts.added);
            m_exec.clear(&m_counters.data()->added, 1);
            emit(view);
        }
    }

    void growLookup(std::uint64_t pairs)
    {
        std::uint64_t slots = std::max<std::uint64_t>(m_lookupSlots, 2);
        while (slots < 2 * pairs)
            slots *= 2;
        m_exec.reserve(m_lookup, slots);
        m_lookupSlots = slots;
    }

    LookupTable table() { return {m_lookup.data(), m_lookupSlots - 1, &m_counters.data()->lookups}; }

    BoxHistory history(const ProxyView& view)
    {
        return {m_now.data(),     m_old.data(), view.filters != nullptr ? m_filters.data() : nullptr,
                m_changes.data(), m_retestAll,  m_retestAll ? nullptr : m_motion.data()};
    }

    void settle(const ProxyView& view)
    {
        m_exec.clear(m_counters.data(), 1);
        m_exec.forEach(m_lookupSlots, FreeSlot{m_lookup.data()});
        const PairList removed = {m_removed.data(), m_removed.size(), &m_counters.data()->removed};
        const PairList kept = {m_kept.data(), m_kept.size(), &m_counters.data()->kept};
        m_exec.forEachTogether(
            m_heldCount,
            SettleHeld{m_held.data(), history(view), view.margin,
                       view.margin >= m_margin && !m_isFresh && !m_dirtyIsAll, removed, table()},
            kept);
    }

    void emit(const ProxyView& view)
    {
        const PairList added = {m_added.data(), m_added.size(), &m_counters.data()->added};
        m_search.emit(m_exec, {history(view), table(), false}, added);
        m_exec.copy(&m_counters.data()->side, m_search.sideCount(), 1);
        m_exec.download(m_stagedCounts.data(), m_counters.data(), 1);
        m_exec.wait();
        m_counts = *m_stagedCounts.data();
    }

    /// Puts together the new held pairs and names the changes by their ids.
    void takeChanges(PairDelta& delta)
    {
        m_exec.reserveKeeping(m_kept, m_counts.kept + m_counts.added, m_counts.kept);
        m_exec.copy(m_kept.data() + m_counts.kept, m_added.data(), m_counts.added);
        m_names.fetch(m_exec, {m_added.data(), m_counts.added}, {m_removed.data(), m_counts.removed},
                      m_uniqueIds.data(), m_largestId, delta);
        if (!m_vanished.empty())
            mergeVanished(delta.removed);
        std::swap(m_held, m_kept);
        m_heldCount = m_counts.kept + m_counts.added;
        m_known.clear();
        m_known.shrink_to_fit();
        m_stats.pairs = m_heldCount;
        m_stats.unbounded = m_counts.side;
        m_stats.entries = m_search.entryCount();
        m_stats.falsePairs = m_search.falsePairCount();
        m_stats.candidates = m_exec.takeTestCount();
    }

    void mergeVanished(std::vector<Pair>& removed)
    {
        for (const std::uint64_t key : m_vanished)
            removed.push_back(pairOfKey(key));
        std::sort(removed.begin(), removed.end());
    }

    static constexpr std::size_t kStageGrain = 2048;
    static constexpr std::uint64_t kStageBlock = 1u << 17;
    // Picked here and there, rows take longer to pack than to copy: smaller blocks, so that copying begins sooner.
    static constexpr std::uint64_t kScatteredBlock = 1u << 15;

    PsapOptions m_options;
    const char* m_name;
    WorkerPool m_workers;
    Exec m_exec;  ///< before the buffers: they live in its memory
    Search<Exec> m_search;
    BackendStats m_stats;

    bool m_isFresh = true;
    std::vector<Pair> m_known;              ///< pairs handed over by restart()
    std::vector<std::uint64_t> m_vanished;  ///< those of them whose proxies are gone
    bool m_hadFilters = false;
    bool m_retestAll = false;
    float m_margin = 0;

    std::uint64_t m_rowCount = 0;  ///< rows that have been sent
    Buffer<Aabb> m_now, m_old;
    Buffer<std::uint8_t> m_changes;
    Buffer<Filter> m_filters;
    Buffer<std::uint32_t> m_uniqueIds;
    std::uint32_t m_largestId = 0;   ///< of those sent
    Buffer<std::uint32_t> m_motion;  ///< [1] bits of the longest way of a side in this update
    std::vector<Staged> m_staged;    ///< by task

    bool m_dirtyIsAll = false;
    std::uint64_t m_dirtyCount = 0;  ///< rows changed in the last update
    Buffer<std::uint32_t> m_dirty;
    Buffer<Aabb> m_newBoxes;
    Buffer<std::uint8_t> m_newChanges;
    Buffer<Filter> m_newFilters;
    Staging<std::uint32_t> m_stagedRows;
    Staging<Aabb> m_stagedBoxes;
    Staging<std::uint8_t> m_stagedChanges;
    Staging<Filter> m_stagedFilters;

    std::uint64_t m_heldCount = 0;
    Buffer<IdPair> m_held, m_kept, m_added, m_removed;
    std::uint64_t m_lookupSlots = 0;
    Buffer<std::uint64_t> m_lookup;
    Buffer<Counters> m_counters;
    Staging<Counters> m_stagedCounts;
    ChangeNames<Exec> m_names;
    Counters m_counts{};
};
}  // namespace cullet::psap
