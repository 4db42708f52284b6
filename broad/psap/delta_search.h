// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/delta_counts.h"
#include "cullet/broad/psap/search.h"
#include "cullet/broad/psap/verlet/neighbour_list.h"

#include <algorithm>
#include <cstdint>

/// The changes of the pairs of boxes that are in an executor's memory, found without a sort: the old boxes decide
/// which pairs enter, the held pairs which leave.
namespace cullet::psap
{
/// Counters of an update, in an executor's memory.
struct DeltaCounters
{
    DeltaCounts counts;
    /// As BoxHistory::motion, in a cache line of its own.
    alignas(128) std::uint32_t motion;
};

/// The counters of this update and of the previous one, and of the neighbour list.
struct DeltaCounterBuffers
{
    DeltaCounters updates[2];
    NeighbourCounts neighbours;
};

/// Clears the old box of a row that did not exist before.
struct ClearOldRow
{
    AlignedBox* old;

    CULLET_HOST_DEVICE void operator()(std::uint64_t row) const { storeCopy(old, row, emptyBox()); }
};

/// The pairs of the previous update: those that stayed, and those that entered.
struct PairsBefore
{
    const RowPair* kept;
    const float* depths;  ///< of the pairs that stayed, as in DepthList; null: unknown
    const RowPair* added;
    const DeltaCounts* counts;

    CULLET_HOST_DEVICE bool has(std::uint64_t i) const { return i < counts->kept + counts->added; }
    CULLET_HOST_DEVICE RowPair at(std::uint64_t i) const
    {
        return i < counts->kept ? kept[i] : added[i - counts->kept];
    }
    /// A lower bound of the depth of pair i; 0: unknown.
    CULLET_HOST_DEVICE float depthLowerBound(std::uint64_t i) const
    {
        return depths != nullptr && i < counts->kept ? depths[i] : 0.0f;
    }
};

/// Decides whether pair i stays. The boxes of a pair whose depth exceeds the motion are not loaded.
struct PartitionPairs
{
    PairsBefore before;
    const AlignedBox* boxes;
    std::uint64_t boxCount;
    const std::uint32_t* motion;  ///< as BoxHistory::motion

    CULLET_HOST_DEVICE DepthPair read(std::uint64_t i) const
    {
        if (!before.has(i))
            return {{0, 0}, 0, false};
        return {before.at(i), before.depthLowerBound(i), true};
    }

    /// @param kept    list of the pairs that stay
    /// @param removed list of the pairs that leave
    template <class Kept, class Removed>
    CULLET_HOST_DEVICE void operator()(const DepthPair& item, Kept& kept, Removed& removed) const
    {
        const RowPair pair = item.pair;
        const bool isThere = item.isPair && (pair.a > pair.b ? pair.a : pair.b) < boxCount;
        const float left = remainingDepth(item.depth, maxDepthGain(2 * floatOf(*motion)));
        const bool isDeep = isThere && left > 0;
        const float depth = overlapByWarp(boxes, pair, isThere && !isDeep);
        const bool isStaying = isDeep || depth >= 0;
        kept.append(isStaying, pair, isDeep ? left : depthLowerBound(depth));
        removed.append(item.isPair && !isStaying, pair);
    }
};

/// Finds the changes from one set of boxes to the next, with one of the searches, on one executor.
///
/// An update is prepare(), which may allocate, and launch(), which only launches; finish() follows when the executor
/// has completed both. The pairs are in two lists, those that stay and those that enter, so that no pair is moved,
/// sorted or compared with others.
template <class Exec>
class DeltaSearch
{
public:
    explicit DeltaSearch(const PsapOptions& options)
        : m_initial(std::max<std::uint64_t>(options.initialCapacity, 1)),
          m_search(options),
          m_neighbours(options)
    {
    }

    /// Reserves memory for the next update.
    ///
    /// @param boxes [count] in the executor's memory
    /// @return whether all memory and the boxes have their old addresses; otherwise recorded launches are void
    bool prepare(Exec& exec, const Aabb* boxes, std::uint64_t count)
    {
        const bool isSame = boxes == m_boxesOfCaller && count == m_count && count == m_oldCount;
        m_boxesOfCaller = boxes;
        m_count = count;
        m_current = 1 - m_current;
        m_previousMode = m_mode;
        m_mode = m_neighbours.choose(count);
        const bool hadRoom = makeRoom(exec);
        m_search.poll(exec);
        prepareInput();
        return hadRoom && isSame;
    }
    /// Whether launch() makes the same launches as an earlier one of the same nextPhase().
    bool isRepeatable(const Exec& exec) const
    {
        if (m_mode == NeighbourMode::Follow)
            return true;
        // In most cases a list begins where another one was followed.
        const bool isUsual = (m_previousMode == NeighbourMode::Follow) == (m_mode == NeighbourMode::Begin);
        return isUsual && m_search.isRepeatable(exec, m_input);
    }

    /// @pre prepare()
    void launch(Exec& exec)
    {
        exec.clear(counters(), 1);
        exec.forEachFrom(m_oldCount, m_count, ClearOldRow{m_boxes[1 - m_current].data()});
        findChanges(exec);
        download(exec);
    }
    /// To be called after launch(), or after the recorded launches that replace it.
    void advanceNextPlan(Exec& exec)
    {
        m_search.advanceNextPlan(exec);
        m_neighbours.sample(exec, copies(), m_count);
    }
    /// Counts an update that replayed recorded launches in place of launch().
    void countRepeat()
    {
        if (m_mode != NeighbourMode::Follow)
            m_search.countRepeat();
    }

    /// Repeats the search with more room as long as a list was too short, after which the counts are right.
    ///
    /// The caller's boxes may have changed.
    ///
    /// @pre the executor has completed launch()
    /// @return whether nothing had to be repeated
    bool finish(Exec& exec)
    {
        bool wasComplete = true;
        if (m_mode == NeighbourMode::Follow)
        {
            m_neighbours.policy().recordFollowed(floatOf(staged().neighbours.displacement));
            wasComplete = stagedCounts().added < kVoidCount;
            if (!wasComplete)
                searchInstead(exec);
        }
        for (; !isComplete(); wasComplete = false)
            searchAgain(exec);
        m_counts = stagedCounts();
        m_oldCount = m_count;
        if (m_mode == NeighbourMode::Begin)
            m_neighbours.recordBegun(staged().neighbours.pairs, m_counts.pairs());
        return wasComplete;
    }

    /// Discards the pairs: the next update starts without any.
    void forget()
    {
        m_counts = {};
        m_oldCount = 0;
        m_boxesOfCaller = nullptr;
        m_neighbours.policy().forget();
        m_isFresh = true;
    }
    /// forget() after a failure: the search may have recorded steps that never ran.
    void recover(const PsapOptions& options)
    {
        m_search = Search<Exec>(options);
        m_neighbours = NeighbourStore<Exec>(options);
        forget();
    }

    const RowPair* kept() const { return m_kept[m_current].data(); }
    const RowPair* added() const { return m_added[m_current].data(); }
    std::uint64_t addedRoom() const { return m_added[m_current].size(); }
    const RowPair* removed() const { return m_removed.data(); }
    /// In the executor's memory. Until finish(), more pairs may have entered than there is room for.
    const DeltaCounts* deviceCounts() const
    {
        return m_updateCounters.size() == 0 ? nullptr : &counters()->counts;
    }
    /// Valid after finish().
    const DeltaCounts& counts() const { return m_counts; }

    static constexpr unsigned kPhases = 2 * (2 * Search<Exec>::kPhases + 1);
    unsigned nextPhase() const
    {
        const unsigned ofSearch = m_search.nextPhase();
        const unsigned phase = m_mode == NeighbourMode::Search  ? ofSearch
                               : m_mode == NeighbourMode::Begin ? Search<Exec>::kPhases + ofSearch
                                                                : 2 * Search<Exec>::kPhases;
        return 2 * phase + m_current;
    }
    /// Changes when the launches of a phase change.
    std::uint32_t launches() const { return m_search.launches() + m_neighbours.launches(); }
    /// Mode of the last update.
    NeighbourMode mode() const { return m_mode; }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    const DeltaCounterBuffers& staged() const { return *m_staged.data(); }
    const DeltaCounts& stagedCounts() const { return staged().updates[m_current].counts; }
    DeltaCounters* counters() const { return &m_updateCounters.data()->updates[m_current]; }
    DeltaCounters* previousCounters() const { return &m_updateCounters.data()->updates[1 - m_current]; }
    NeighbourCounts* neighbourCounts() const { return &m_updateCounters.data()->neighbours; }
    const AlignedBox* now() const { return m_boxes[m_current].data(); }
    BoxCopies copies() const
    {
        return {m_boxes[m_current].data(), m_boxes[1 - m_current].data(), m_oldCount, &counters()->motion};
    }
    PairList keptList() const
    {
        return {m_kept[m_current].data(), m_kept[m_current].size(), &counters()->counts.kept};
    }
    /// Where the list is followed, depths of pairs are not kept.
    DepthList keptDepths() const { return {keptList(), m_depths[m_current].data()}; }
    PairList addedList() const
    {
        return {m_added[m_current].data(), m_added[m_current].size(), &counters()->counts.added};
    }
    PairList removedList() const { return {m_removed.data(), m_removed.size(), &counters()->counts.removed}; }
    PairLists<3> changeLists() const { return {{removedList(), addedList(), keptList()}}; }
    WasSeparated wasSeparated() const { return {m_boxes[1 - m_current].data(), &counters()->motion}; }

    /// @return whether the memory was sufficient
    bool makeRoom(Exec& exec)
    {
        const std::uint64_t bytes = exec.bytes();
        exec.reserve(m_updateCounters, 1);
        exec.reserve(m_staged, 1);
        if (m_isFresh)
            exec.clear(m_updateCounters.data(), 1);
        m_isFresh = false;
        exec.reserve(m_boxes[m_current], m_count);
        exec.reserveKeeping(m_boxes[1 - m_current], m_count, m_oldCount);
        const std::uint64_t pairs = m_counts.pairs();
        exec.reserve(m_kept[m_current], std::max(pairs + pairs / 8, m_initial));
        exec.reserve(m_depths[m_current], m_kept[m_current].size());
        exec.reserve(m_added[m_current], m_initial);
        exec.reserve(m_removed, std::max(pairs + pairs / 8, m_initial));
        if (m_mode == NeighbourMode::Begin && !m_neighbours.reserve(exec, m_count))
            m_mode = NeighbourMode::Search;
        return exec.bytes() == bytes;
    }

    void prepareInput()
    {
        if (m_mode == NeighbourMode::Follow)
            return;
        m_input = {m_boxesOfCaller, m_count, nullptr, m_counts.pairs()};
        if (m_mode == NeighbourMode::Begin)
            m_input.boxes = m_neighbours.grown();
        else
            m_input.copies = copies();
        if (m_neighbours.recordSearchedSkin(m_mode))
            m_search.forgetPlans();
    }

    void findChanges(Exec& exec)
    {
        switch (m_mode)
        {
            case NeighbourMode::Search:
                search(exec);
                break;
            case NeighbourMode::Begin:
                begin(exec);
                break;
            case NeighbourMode::Follow:
                displacement(exec);
                follow(exec);
                break;
        }
    }

    /// Finds the changes without a neighbour list.
    void search(Exec& exec)
    {
        m_search.build(exec, m_input);
        partition(exec);
        m_search.emit(exec, wasSeparated(), addedList());
    }

    /// Makes a new neighbour list, and finds the changes.
    void begin(Exec& exec)
    {
        exec.clear(neighbourCounts(), 1);
        m_neighbours.grow(exec, m_boxesOfCaller, copies());
        m_search.build(exec, m_input);
        partition(exec);
        m_neighbours.find(exec, m_search, neighbourCounts());
        classifyNew(exec);
    }

    /// Tests for each pair of a new list whether it overlaps.
    void classifyNew(Exec& exec)
    {
        exec.forEachMultiAppend(
            m_neighbours.room(),
            BeginNeighbours{m_neighbours.list(neighbourCounts()), m_neighbours.isHeld(m_current),
                            m_neighbours.reference(), wasSeparated(), &counters()->counts.added},
            changeLists());
    }

    void displacement(Exec& exec)
    {
        const StridedBoxes shared = {m_count};
        exec.forEach(
            shared.indices(),
            MeasureDisplacement{shared, m_boxesOfCaller, m_boxes[m_current].data(), m_neighbours.reference(),
                                &neighbourCounts()->displacement, &counters()->counts.added});
    }

    void follow(Exec& exec)
    {
        exec.forEachMultiAppend(
            m_neighbours.room(),
            FollowNeighbours{m_neighbours.list(neighbourCounts()), m_neighbours.isHeld(1 - m_current),
                             m_neighbours.isHeld(m_current), now(), &neighbourCounts()->displacement},
            changeLists());
    }

    void partition(Exec& exec)
    {
        const float* depths =
            m_previousMode == NeighbourMode::Follow ? nullptr : m_depths[1 - m_current].data();
        const PairsBefore before = {m_kept[1 - m_current].data(), depths, m_added[1 - m_current].data(),
                                    &previousCounters()->counts};
        // The capacity instead of the count, so that the launch does not depend on the number of pairs.
        exec.forEachPartition(m_kept[1 - m_current].size() + m_added[1 - m_current].size(),
                              PartitionPairs{before, now(), m_count, &counters()->motion}, keptDepths(),
                              removedList());
    }

    void download(Exec& exec) { exec.download(m_staged.data(), m_updateCounters.data(), 1); }

    /// The boxes of this update in a searchable format, since the caller's boxes may have changed.
    const Aabb* copyBoxesForRetry(Exec& exec)
    {
        exec.reserve(m_retryBoxes, m_count);
        exec.forEach(m_count, UnalignBox{now(), m_retryBoxes.data()});
        return m_retryBoxes.data();
    }

    /// Searches where boxes have left their skins, so that the neighbour list is incomplete.
    void searchInstead(Exec& exec)
    {
        m_boxesOfCaller = copyBoxesForRetry(exec);
        m_mode = m_neighbours.policy().search();
        makeRoom(exec);
        m_search.poll(exec);
        prepareInput();
        launch(exec);
        exec.wait();
    }

    bool isComplete() const
    {
        return stagedCounts().added <= m_added[m_current].size() &&
               (m_mode != NeighbourMode::Begin || staged().neighbours.pairs <= m_neighbours.room());
    }

    void searchAgain(Exec& exec)
    {
        switch (m_mode)
        {
            case NeighbourMode::Search:
                retrySearch(exec);
                break;
            case NeighbourMode::Begin:
                retryBegin(exec);
                break;
            case NeighbourMode::Follow:
                exec.reserve(m_added[m_current], stagedCounts().added);
                exec.clear(&counters()->counts, 1);
                follow(exec);
                break;
        }
        download(exec);
        exec.wait();
    }

    void retrySearch(Exec& exec)
    {
        m_input.boxes = copyBoxesForRetry(exec);
        m_input.copies = {};
        const std::uint64_t added = stagedCounts().added;
        if (added < kVoidCount)
            exec.reserve(m_added[m_current], added);
        exec.clear(&counters()->counts.added, 1);
        if (added == kOverflowed)
            m_search.buildByCounting(exec, m_input.boxes);
        else
            m_search.build(exec, m_input);
        m_search.emit(exec, wasSeparated(), addedList());
    }

    void retryBegin(Exec& exec)
    {
        if (staged().neighbours.pairs <= m_neighbours.room())
            exec.reserve(m_added[m_current], stagedCounts().added);
        else if (!m_neighbours.findAgain(exec, m_search, neighbourCounts(), staged().neighbours.pairs))
        {
            // There is no memory for a list.
            m_mode = NeighbourMode::Search;
            return retrySearch(exec);
        }
        exec.clear(&counters()->counts.added, 1);
        classifyNew(exec);
    }

    std::uint64_t m_initial;
    Search<Exec> m_search;
    NeighbourStore<Exec> m_neighbours;
    NeighbourMode m_mode = NeighbourMode::Search, m_previousMode = NeighbourMode::Search;
    SearchInput m_input{};
    const Aabb* m_boxesOfCaller = nullptr;
    std::uint64_t m_count = 0;  ///< number of boxes
    DeltaCounts m_counts{};
    std::uint64_t m_oldCount = 0;  ///< boxes of the previous update
    unsigned m_current = 0;        ///< index of this update's boxes and pairs
    bool m_isFresh = true;
    Buffer<AlignedBox> m_boxes[2];
    Buffer<Aabb> m_retryBoxes;  ///< boxes for a repeated search
    Buffer<RowPair> m_kept[2], m_added[2];
    Buffer<float> m_depths[2];  ///< depths of kept pairs
    Buffer<RowPair> m_removed;
    Buffer<DeltaCounterBuffers> m_updateCounters;  ///< the previous counts say how many pairs there are
    typename Exec::template Staging<DeltaCounterBuffers> m_staged;
};
}  // namespace cullet::psap
