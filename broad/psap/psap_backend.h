// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/log.h"
#include "cullet/broad/pairs/restart_rows.h"
#include "cullet/broad/psap/exec/executor_failure.h"
#include "cullet/broad/psap/held_pairs.h"
#include "cullet/broad/psap/search.h"
#include "cullet/broad/psap/update/delta_output.h"
#include "cullet/broad/psap/update/table_mirror.h"
#include "cullet/broad/psap/update/update_buffers.h"
#include "cullet/broad/psap/verlet/pair_list_update.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <new>
#include <stdexcept>
#include <utility>
#include <vector>

namespace cullet::psap
{
/// Keeps the pair set of a proxy table up to date with a search, on one executor.
///
/// @tparam SearchOn   Search, or another class with its members
/// @tparam SearchOptions what it is made of; PsapOptions or derived from it
///
/// The executor's memory holds the boxes of this update and of the previous one, and the held pairs, as rows. An
/// update uploads the changed rows, settles the held pairs (tests whether each stays) and searches, or it follows the
/// neighbour list instead of both. Then it downloads the pairs that enter and those that leave. It waits for the
/// executor once, and again only where a list was too short. The next neighbour list is made asynchronously after an
/// update.
///
/// The order in which pairs are found may differ from run to run; deltas are sorted by unique id.
template <class Exec, template <class> class SearchOn = Search, class SearchOptions = PsapOptions>
class PsapBackend final : public Backend
{
public:
    template <class... ExecArguments>
    PsapBackend(const SearchOptions& options, const char* name, ExecArguments&&... arguments)
        : m_options(options),
          m_name(name),
          m_exec(std::forward<ExecArguments>(arguments)...),
          m_rows(options.threads, options.initialCapacity),
          m_search(options),
          m_neighbours(options),
          m_held(options.initialCapacity),
          m_output(options.initialCapacity)
    {
    }

    Status update(const ProxyView& proxies, PairDelta& delta) override
    {
        Status status = Status::OutOfMemory;
        try
        {
            const typename Exec::DeviceGuard use(m_exec);
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
        m_exec.drain();
        // The search may have recorded steps that never ran.
        m_search = SearchOn<Exec>(m_options);
        m_neighbours = PairListUpdate<Exec>(m_options);
        m_output.recover();
        restart({});
        delta.clear();
        return status;
    }

    void restart(const Pairs& known) override
    {
        m_known = known;
        m_lastWords = Words::Unknown;
        m_held.clear();
        m_neighbours.forget();
    }

    const char* name() const noexcept override { return m_name; }
    const SearchOn<Exec>& search() const { return m_search; }

    BackendStats stats() const override
    {
        BackendStats stats = m_stats;
        stats.bytes = m_exec.bytes();
        return stats;
    }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;
    void updateOrThrow(const ProxyView& view, PairDelta& delta)
    {
        m_stats.path = "idle";
        m_stats.candidates = 0;
        m_stats.bytesMoved = 0;
        m_stats.stages.clear();
        m_words = view.filters != nullptr ? Words::Present : Words::Absent;
        if (m_words == m_lastWords && view.dirtyCount == 0 && view.margin == m_margin)
        {
            delta.clear();
            return;
        }
        m_vanished.clear();
        if (m_lastWords == Words::Unknown)
            begin(view);
        m_neighbours.choose(view);
        m_exec.dropStages();
        m_exec.beginStage("upload");
        m_updateCounters.begin(m_exec);
        prepareLists();
        m_neighbours.reserveCounts(m_exec);
        if (!m_neighbours.isFollowed())
            m_held.list(m_exec, m_neighbours);
        m_rows.send(m_exec, view, m_neighbours.motionRecorder(&m_updateCounters.current()->motion),
                    [&](std::uint64_t end) { settleEarly(view, end); });
        if (!m_neighbours.isFollowed() || !followNeighbours(view, delta))
            searchChanges(view, delta);
        collectChanges(delta);
        enqueueNextList();
        m_exec.beginStage(nullptr);
        m_rows.copyToPreviousEarly(m_exec);
        m_exec.collectStages(m_stats.stages);
        m_stats.bytesMoved = m_exec.collectBytesMoved();
        m_margin = view.margin;
        m_lastWords = m_words;
        m_updateCounters.markNextEmpty();
    }

    /// Discards all rows and adopts the pairs given to restart().
    void begin(const ProxyView& view)
    {
        m_rows.forget();
        m_undecided.setFree(false);
        std::vector<RowPair> held;
        splitKnown(m_known, view, held, m_vanished);
        m_held.upload(m_exec, held);
    }

    /// Empties the lists of this update, and reserves them as far as their sizes are known.
    void prepareLists()
    {
        const std::uint64_t initial = m_options.initialCapacity;
        m_held.prepare(m_exec);
        m_exec.reserve(m_removed, std::max(m_held.count(), initial));
        m_exec.reserve(m_added, initial);
        m_undecided.grow(m_exec, initial);
        m_undecided.use(m_exec);
        m_rowsSettled = 0;
        m_isMotionKnown = true;
    }

    /// Settles the held pairs of the rows before `end`, which are in place, while later rows are being uploaded.
    void settleEarly(const ProxyView& view, std::uint64_t end)
    {
        if (m_neighbours.isFollowed())
            return;  // the list takes as long for some of the pairs as for all
        // Filter words are uploaded after the boxes; pairs whose filter words have changed are always undecided.
        if (view.filters != nullptr && m_lastWords != Words::Present)
            return;
        // Only once half of the missing rows are in place: each call reads all held pairs.
        if (view.size - end > (view.size - m_rowsSettled) / 2)
            return;
        settle(view.margin, {m_rowsSettled, static_cast<std::uint32_t>(end) - 1});
        m_rowsSettled = static_cast<std::uint32_t>(end);
    }

    /// Finds the changes with the neighbour list.
    ///
    /// @return whether that succeeded; if not, the update has not changed anything
    bool followNeighbours(const ProxyView& view, PairDelta& delta)
    {
        m_stats.path = "near pairs";
        m_exec.beginStage("follow");
        follow(view.margin);
        advanceNextPlan();
        m_exec.beginStage("deltas");
        m_output.enqueue(m_exec, lists(), m_rows.largestId(), delta);
        m_undecided.setFree(true);  // nothing has been inserted
        m_exec.mark();
        enqueueNextListEarly();
        m_exec.awaitMark();
        m_counts = m_output.counters();
        if (!m_neighbours.collectResult())
            return searchInstead();
        while (m_counts.lists.added > m_added.size())
        {
            m_exec.reserve(m_added, m_counts.lists.added);
            if (m_neighbours.isReplaced())
                return searchInstead();
            m_exec.clear(&counters()->lists, 1);
            follow(view.margin);
            fetchAgain(delta);
        }
        // Where the list of kept pairs was too short, the neighbour list that was begun from it is incomplete.
        return !m_neighbours.isReplaced() || heldCountAfter() <= m_held.keptRoom() || searchInstead();
    }

    bool searchInstead()
    {
        m_neighbours.giveUp();
        m_held.list(m_exec, m_neighbours);
        m_isMotionKnown = false;
        m_exec.clear(&counters()->lists, 1);
        return false;
    }

    void follow(float margin)
    {
        // Otherwise pairs may leave or enter although their boxes have not moved.
        const bool areOthersUnchanged = margin >= m_margin && !mustRetestAll();
        m_neighbours.follow(m_exec, m_rows.now(), m_rows.filters(),
                            areOthersUnchanged ? m_rows.sentRows() : nullptr, margin, heldLists());
    }

    /// Begins the next neighbour list where this update is the last one for the current list. Launched before the CPU
    /// waits for the changes, whose download does not wait for it.
    void enqueueNextListEarly()
    {
        if (!m_neighbours.tryBeginEarly())
            return;
        // Also the pairs before this update, in case it has to be searched: the list that stores them is discarded.
        m_held.listAlsoKept(m_exec, m_neighbours);
        if (m_neighbours.grow(m_exec, rows(), m_rows.count()))
            beginNeighbours(m_held.listedKept());
    }

    /// Begins the next neighbour list after an update whose changes have been collected.
    void enqueueNextList()
    {
        if (!m_neighbours.tryBegin(m_rows.count()))
            return;
        m_held.list(m_exec, m_neighbours);
        if (!m_neighbours.grow(m_exec, rows(), m_rows.count()))
            return;
        m_exec.clear(&counters()->lists.lookups, 1);
        beginNeighbours(m_held.before());
    }

    void beginNeighbours(const PairListView& held)
    {
        m_exec.beginStage("near pairs");
        buildWithSkins();
        m_undecided.grow(m_exec, m_neighbours.lookups() + m_neighbours.lookups() / 4);
        m_undecided.use(m_exec);
        m_neighbours.begin(m_exec, m_search, held, m_rows.now(), m_rows.filters(), table());
        m_undecided.setFree(true);
        m_exec.collectTestCount();
    }

    void buildWithSkins()
    {
        const bool areSkinsThicker = m_neighbours.recordSearchedSkin();
        m_search.poll(m_exec);
        if (m_neighbours.collectOverflow())
            return m_search.buildByCounting(m_exec, m_neighbours.grown());
        if (areSkinsThicker)
            m_search.forgetPlans();
        m_search.build(m_exec, {m_neighbours.grown(), m_rows.count(), nullptr, m_held.count()});
    }

    /// Settles the held pairs and searches for pairs that enter.
    void searchChanges(const ProxyView& view, PairDelta& delta)
    {
        m_stats.path = "rebuild";
        ++m_stats.rebuildsTotal;
        m_exec.beginStage("sort");
        m_search.poll(m_exec);
        m_search.build(m_exec, {m_rows.now(), m_rows.count(), nullptr, m_held.count()});
        m_exec.beginStage("settle");
        settle(view.margin, {m_rowsSettled, kAllRows.last});
        m_exec.beginStage("search");
        emit();
        advanceNextPlan();
        m_exec.beginStage("deltas");
        fetchChanges(delta);
        repeatUntilComplete(view, delta);
    }

    /// Repeats the search with more room, as long as a list was too short.
    void repeatUntilComplete(const ProxyView& view, PairDelta& delta)
    {
        while (m_counts.lists.lookups > table().limit())
        {
            m_undecided.grow(m_exec, 2 * m_counts.lists.lookups);
            m_exec.clear(&counters()->lists, 1);
            m_undecided.use(m_exec);
            settle(view.margin, kAllRows);
            emitAgain(delta);
        }
        if (m_counts.lists.added == kOverflowed)
        {
            m_search.buildByCounting(m_exec, m_rows.now());
            searchAgain(delta);
        }
        while (m_counts.lists.added > m_added.size())
        {
            m_exec.reserve(m_added, m_counts.lists.added);
            searchAgain(delta);
        }
    }

    /// Advances the next plan, and samples boxes for the skins. To be called after the last step that finds pairs.
    void advanceNextPlan()
    {
        m_search.advanceNextPlan(m_exec);
        m_neighbours.sample(m_exec, rows(), m_rows.count());
    }

    void searchAgain(PairDelta& delta)
    {
        m_exec.clear(&counters()->lists.added, 1);
        emitAgain(delta);
    }

    void emitAgain(PairDelta& delta)
    {
        emit();
        fetchAgain(delta);
    }

    void fetchAgain(PairDelta& delta)
    {
        ++m_stats.retriesTotal;
        fetchChanges(delta);
    }

    Counters* counters() const { return &m_updateCounters.current()->counters; }
    LookupTable table() const { return m_undecided.table(&counters()->lists.lookups); }

    RowBoxes rows() const { return {m_rows.now(), m_rows.old()}; }

    BoxHistory history()
    {
        const bool hasMotion = m_isMotionKnown && !mustRetestAll();
        return {m_rows.now(),     m_rows.old(),    m_rows.filters(),
                m_rows.changes(), mustRetestAll(), hasMotion ? &m_updateCounters.current()->motion : nullptr};
    }

    /// Settles the held pairs whose higher row is in the span.
    ///
    /// @pre the table is empty and the counts are 0, except for what other spans have added
    void settle(float margin, RowSpan span)
    {
        const HeldLists lists = heldLists();
        const bool canSkipUnchanged =
            margin >= m_margin && m_lastWords != Words::Unknown && !m_rows.haveAllChanged();
        m_exec.forEachPartition(
            m_held.count(),
            SettleHeld{m_held.pairs(), m_held.depths(), history(), margin, canSkipUnchanged, span, table()},
            DepthList{lists.kept, m_held.keptDepths()}, lists.removed);
    }

    HeldLists heldLists() const
    {
        ListCounts& counts = counters()->lists;
        return {{m_held.kept(), m_held.keptRoom(), &counts.kept},
                {m_removed.data(), m_removed.size(), &counts.removed},
                {m_added.data(), m_added.size(), &counts.added}};
    }

    /// Finds the pairs that enter.
    void emit() { m_search.emit(m_exec, EntryTest{history(), table()}, heldLists().added); }

    ChangeLists lists()
    {
        return {m_added.data(),
                m_added.size(),
                m_removed.data(),
                m_held.kept(),
                m_held.keptDepths(),
                m_neighbours.isFollowed() ? 0 : m_held.keptRoom(),
                table(),
                counters(),
                m_search.unboundedCount(),
                m_rows.uniqueIds(),
                m_updateCounters.next()};
    }

    void fetchChanges(PairDelta& delta)
    {
        m_output.enqueue(m_exec, lists(), m_rows.largestId(), delta);
        m_exec.wait();
        m_counts = m_output.counters();
        m_undecided.setFree(lists().areComplete(m_counts.lists));
    }

    /// Collects the changes and assembles the new held pairs.
    void collectChanges(PairDelta& delta)
    {
        const bool wasKeptTooShort =
            !m_neighbours.isFollowed() && m_held.makeRoom(m_exec, m_counts.lists.kept, heldCountAfter());
        m_output.take(m_exec, lists(), m_rows.largestId(), wasKeptTooShort, delta);
        addExpired(m_vanished, delta.removed);
        if (m_neighbours.isFollowed())
            m_held.adoptFollowed(heldCountAfter(), m_neighbours.isReplaced());
        else
            m_held.adoptSearched(heldCountAfter());
        m_neighbours.recordUpdate(m_held.count());
        m_known.clear();
        m_known.shrink_to_fit();
        m_stats.pairs = m_held.count();
        m_stats.unbounded = m_counts.unboundedCount;
        m_stats.entries = m_search.entryCount();
        m_stats.candidates = m_exec.collectTestCount();
    }

    std::uint64_t heldCountAfter() const
    {
        const ListCounts& counts = m_counts.lists;
        return m_neighbours.isFollowed() ? m_held.count() + counts.added - counts.removed
                                         : counts.kept + counts.added;
    }

    /// The filter words of an update.
    enum class Words : std::uint8_t
    {
        Unknown,  ///< there was no update since restart()
        Absent,
        Present
    };

    /// Whether filter words excluded pairs until now, so that boxes do not tell what was held.
    bool mustRetestAll() const { return m_lastWords == Words::Present && m_words == Words::Absent; }

    SearchOptions m_options;
    const char* m_name;
    Exec m_exec;  ///< declared before the buffers, which use its memory
    TableMirror<Exec> m_rows;
    SearchOn<Exec> m_search;
    PairListUpdate<Exec> m_neighbours;
    BackendStats m_stats;

    Words m_lastWords = Words::Unknown, m_words = Words::Unknown;
    Pairs m_known;                          ///< pairs handed over by restart()
    std::vector<std::uint64_t> m_vanished;  ///< ids of known pairs whose proxies no longer exist
    float m_margin = 0;

    std::uint32_t m_rowsSettled = 0;  ///< rows settled before the upload is complete
    HeldPairs<Exec> m_held;
    Buffer<RowPair> m_added, m_removed;
    bool m_isMotionKnown = true;  ///< BoxHistory::motion is complete
    UndecidedPairs<Exec> m_undecided;
    UpdateCounterBuffers<Exec> m_updateCounters;
    DeltaOutput<Exec> m_output;
    Counters m_counts{};
};
}  // namespace cullet::psap
