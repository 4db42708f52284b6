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
struct DeltaTally
{
    DeltaCounts counts;
    /// As BoxHistory::motion, in a cache line of its own.
    alignas(128) std::uint32_t motion;
};

/// The counters of this update and of the previous one, and of the neighbour list.
struct DeltaTallies
{
    DeltaTally sides[2];
    NearCounts near;
};

/// Clears the old box of a row that did not exist before.
struct EnterRow
{
    AlignedBox* old;

    CULLET_HOST_DEVICE void operator()(std::uint64_t row) const { storeCopy(old, row, nowhere()); }
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
    CULLET_HOST_DEVICE float depthOf(std::uint64_t i) const
    {
        return depths != nullptr && i < counts->kept ? depths[i] : 0.0f;
    }
};

/// Decides whether pair i stays. The boxes of a pair whose depth exceeds the motion are not loaded.
struct PartPairs
{
    PairsBefore before;
    const AlignedBox* boxes;
    std::uint64_t boxCount;
    const std::uint32_t* motion;  ///< as BoxHistory::motion

    CULLET_HOST_DEVICE DepthPair read(std::uint64_t i) const
    {
        if (!before.has(i))
            return {{0, 0}, 0, false};
        return {before.at(i), before.depthOf(i), true};
    }

    /// @param kept    list of the pairs that stay
    /// @param removed list of the pairs that leave
    template <class Kept, class Removed>
    CULLET_HOST_DEVICE void operator()(const DepthPair& item, Kept& kept, Removed& removed) const
    {
        const RowPair pair = item.pair;
        const bool isThere = item.isPair && (pair.a > pair.b ? pair.a : pair.b) < boxCount;
        const float left = depthLeft(item.depth, deeperThan(2 * floatOf(*motion)));
        const bool isDeep = isThere && left > 0;
        const float depth = overlapTogether(boxes, pair, isThere && !isDeep);
        const bool isStaying = isDeep || depth >= 0;
        kept.append(isStaying, pair, isDeep ? left : depthOf(depth));
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
        : m_initial(std::max<std::uint64_t>(options.initialCapacity, 1)), m_search(options), m_near(options)
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
        m_side = 1 - m_side;
        m_frameBefore = m_frame;
        m_frame = m_near.choose(count);
        const bool hadRoom = makeRoom(exec);
        m_search.look(exec);
        prepareInput();
        return hadRoom && isSame;
    }
    /// Whether launch() makes the same launches as an earlier one of the same nextPhase().
    bool isRepeatable(const Exec& exec) const
    {
        if (m_frame == NearFrame::Follow)
            return true;
        // In most cases a list begins where another one was followed.
        const bool isUsual = (m_frameBefore == NearFrame::Follow) == (m_frame == NearFrame::Begin);
        return isUsual && m_search.isRepeatable(exec, m_input);
    }

    /// @pre prepare()
    void launch(Exec& exec)
    {
        exec.clear(tally(), 1);
        exec.forEachFrom(m_oldCount, m_count, EnterRow{m_boxes[1 - m_side].data()});
        findChanges(exec);
        download(exec);
    }
    /// To be called after launch(), or after the recorded launches that replace it.
    void planAhead(Exec& exec)
    {
        m_search.planAhead(exec);
        m_near.sample(exec, copies(), m_count);
    }
    /// Counts an update that replayed recorded launches in place of launch().
    void countRepeat()
    {
        if (m_frame != NearFrame::Follow)
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
        if (m_frame == NearFrame::Follow)
        {
            m_near.policy().noteFollowed(floatOf(staged().near.stretch));
            wasComplete = stagedCounts().added < kVoidCount;
            if (!wasComplete)
                searchInstead(exec);
        }
        for (; !isComplete(); wasComplete = false)
            searchAgain(exec);
        m_counts = stagedCounts();
        m_oldCount = m_count;
        if (m_frame == NearFrame::Begin)
            m_near.noteBegun(staged().near.pairs, m_counts.pairs());
        return wasComplete;
    }

    /// Discards the pairs: the next update starts without any.
    void forget()
    {
        m_counts = {};
        m_oldCount = 0;
        m_boxesOfCaller = nullptr;
        m_near.policy().forget();
        m_isFresh = true;
    }
    /// forget() after a failure: the search may have recorded steps that never ran.
    void recover(const PsapOptions& options)
    {
        m_search = Search<Exec>(options);
        m_near = NearPairs<Exec>(options);
        forget();
    }

    const RowPair* kept() const { return m_kept[m_side].data(); }
    const RowPair* added() const { return m_added[m_side].data(); }
    std::uint64_t addedRoom() const { return m_added[m_side].size(); }
    const RowPair* removed() const { return m_removed.data(); }
    /// In the executor's memory. Until finish(), more pairs may have entered than there is room for.
    const DeltaCounts* countsThere() const { return m_tallies.size() == 0 ? nullptr : &tally()->counts; }
    /// Valid after finish().
    const DeltaCounts& counts() const { return m_counts; }

    static constexpr unsigned kPhases = 2 * (2 * Search<Exec>::kPhases + 1);
    unsigned nextPhase() const
    {
        const unsigned ofSearch = m_search.nextPhase();
        const unsigned phase = m_frame == NearFrame::Search  ? ofSearch
                               : m_frame == NearFrame::Begin ? Search<Exec>::kPhases + ofSearch
                                                             : 2 * Search<Exec>::kPhases;
        return 2 * phase + m_side;
    }
    /// Changes when the launches of a phase change.
    std::uint32_t launches() const { return m_search.launches() + m_near.launches(); }
    /// Mode of the last update.
    NearFrame frame() const { return m_frame; }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    const DeltaTallies& staged() const { return *m_staged.data(); }
    const DeltaCounts& stagedCounts() const { return staged().sides[m_side].counts; }
    DeltaTally* tally() const { return &m_tallies.data()->sides[m_side]; }
    DeltaTally* tallyBefore() const { return &m_tallies.data()->sides[1 - m_side]; }
    NearCounts* nearCounts() const { return &m_tallies.data()->near; }
    const AlignedBox* now() const { return m_boxes[m_side].data(); }
    BoxCopies copies() const
    {
        return {m_boxes[m_side].data(), m_boxes[1 - m_side].data(), m_oldCount, &tally()->motion};
    }
    PairList keptList() const
    {
        return {m_kept[m_side].data(), m_kept[m_side].size(), &tally()->counts.kept};
    }
    /// Where the list is followed, depths of pairs are not kept.
    DepthList keptDepths() const { return {keptList(), m_depths[m_side].data()}; }
    PairList addedList() const
    {
        return {m_added[m_side].data(), m_added[m_side].size(), &tally()->counts.added};
    }
    PairList removedList() const { return {m_removed.data(), m_removed.size(), &tally()->counts.removed}; }
    PairLists<3> sentLists() const { return {{removedList(), addedList(), keptList()}}; }
    WasApart wasApart() const { return {m_boxes[1 - m_side].data(), &tally()->motion}; }

    /// @return whether the memory was sufficient
    bool makeRoom(Exec& exec)
    {
        const std::uint64_t bytes = exec.bytes();
        exec.reserve(m_tallies, 1);
        exec.reserve(m_staged, 1);
        if (m_isFresh)
            exec.clear(m_tallies.data(), 1);
        m_isFresh = false;
        exec.reserve(m_boxes[m_side], m_count);
        exec.reserveKeeping(m_boxes[1 - m_side], m_count, m_oldCount);
        const std::uint64_t pairs = m_counts.pairs();
        exec.reserve(m_kept[m_side], std::max(pairs + pairs / 8, m_initial));
        exec.reserve(m_depths[m_side], m_kept[m_side].size());
        exec.reserve(m_added[m_side], m_initial);
        exec.reserve(m_removed, std::max(pairs + pairs / 8, m_initial));
        if (m_frame == NearFrame::Begin && !m_near.reserve(exec, m_count))
            m_frame = NearFrame::Search;
        return exec.bytes() == bytes;
    }

    void prepareInput()
    {
        if (m_frame == NearFrame::Follow)
            return;
        m_input = {m_boxesOfCaller, m_count, nullptr, m_counts.pairs()};
        if (m_frame == NearFrame::Begin)
            m_input.boxes = m_near.grown();
        else
            m_input.copies = copies();
        if (m_near.growsSizes(m_frame))
            m_search.forgetPlans();
    }

    void findChanges(Exec& exec)
    {
        switch (m_frame)
        {
            case NearFrame::Search:
                search(exec);
                break;
            case NearFrame::Begin:
                begin(exec);
                break;
            case NearFrame::Follow:
                stretch(exec);
                follow(exec);
                break;
        }
    }

    /// Finds the changes without a neighbour list.
    void search(Exec& exec)
    {
        m_search.build(exec, m_input);
        part(exec);
        m_search.emit(exec, wasApart(), addedList());
    }

    /// Makes a new neighbour list, and finds the changes.
    void begin(Exec& exec)
    {
        exec.clear(nearCounts(), 1);
        m_near.grow(exec, m_boxesOfCaller, copies());
        m_search.build(exec, m_input);
        part(exec);
        m_near.find(exec, m_search, nearCounts());
        judge(exec);
    }

    /// Tests for each pair of a new list whether it overlaps.
    void judge(Exec& exec)
    {
        exec.forEachSent(m_near.room(),
                         BeginNear{m_near.list(nearCounts()), m_near.isHeld(m_side), m_near.then(),
                                   wasApart(), &tally()->counts.added},
                         sentLists());
    }

    void stretch(Exec& exec)
    {
        const SharedBoxes shared = {m_count};
        exec.forEach(shared.indices(),
                     StretchSkins{shared, m_boxesOfCaller, m_boxes[m_side].data(), m_near.then(),
                                  &nearCounts()->stretch, &tally()->counts.added});
    }

    void follow(Exec& exec)
    {
        exec.forEachSent(m_near.room(),
                         FollowNear{m_near.list(nearCounts()), m_near.isHeld(1 - m_side),
                                    m_near.isHeld(m_side), now(), &nearCounts()->stretch},
                         sentLists());
    }

    void part(Exec& exec)
    {
        const float* depths = m_frameBefore == NearFrame::Follow ? nullptr : m_depths[1 - m_side].data();
        const PairsBefore before = {m_kept[1 - m_side].data(), depths, m_added[1 - m_side].data(),
                                    &tallyBefore()->counts};
        // The capacity instead of the count, so that the launch does not depend on the number of pairs.
        exec.forEachParted(m_kept[1 - m_side].size() + m_added[1 - m_side].size(),
                           PartPairs{before, now(), m_count, &tally()->motion}, keptDepths(), removedList());
    }

    void download(Exec& exec) { exec.download(m_staged.data(), m_tallies.data(), 1); }

    /// The boxes of this update in a searchable format, since the caller's boxes may have changed.
    const Aabb* boxesAgain(Exec& exec)
    {
        exec.reserve(m_again, m_count);
        exec.forEach(m_count, UnalignBox{now(), m_again.data()});
        return m_again.data();
    }

    /// Searches where boxes have left their skins, so that the neighbour list is incomplete.
    void searchInstead(Exec& exec)
    {
        m_boxesOfCaller = boxesAgain(exec);
        m_frame = m_near.policy().search();
        makeRoom(exec);
        m_search.look(exec);
        prepareInput();
        launch(exec);
        exec.wait();
    }

    bool isComplete() const
    {
        return stagedCounts().added <= m_added[m_side].size() &&
               (m_frame != NearFrame::Begin || staged().near.pairs <= m_near.room());
    }

    void searchAgain(Exec& exec)
    {
        switch (m_frame)
        {
            case NearFrame::Search:
                searchOnceMore(exec);
                break;
            case NearFrame::Begin:
                beginOnceMore(exec);
                break;
            case NearFrame::Follow:
                exec.reserve(m_added[m_side], stagedCounts().added);
                exec.clear(&tally()->counts, 1);
                follow(exec);
                break;
        }
        download(exec);
        exec.wait();
    }

    void searchOnceMore(Exec& exec)
    {
        m_input.boxes = boxesAgain(exec);
        m_input.copies = {};
        const bool isSpilled = stagedCounts().added == kSpilled;
        if (!isSpilled)
            exec.reserve(m_added[m_side], stagedCounts().added);
        exec.clear(&tally()->counts.added, 1);
        if (isSpilled)
            m_search.buildByCounting(exec, m_input.boxes);
        else
            m_search.build(exec, m_input);
        m_search.emit(exec, wasApart(), addedList());
    }

    /// Searches where there is no memory for a neighbour list.
    void searchWithoutList(Exec& exec)
    {
        m_frame = NearFrame::Search;
        m_input.boxes = boxesAgain(exec);
        exec.clear(&tally()->counts.added, 1);
        m_search.build(exec, m_input);
        m_search.emit(exec, wasApart(), addedList());
    }

    void beginOnceMore(Exec& exec)
    {
        if (staged().near.pairs <= m_near.room())
            exec.reserve(m_added[m_side], stagedCounts().added);
        else if (!m_near.findAgain(exec, m_search, nearCounts(), staged().near.pairs))
            return searchWithoutList(exec);
        exec.clear(&tally()->counts.added, 1);
        judge(exec);
    }

    std::uint64_t m_initial;
    Search<Exec> m_search;
    NearPairs<Exec> m_near;
    NearFrame m_frame = NearFrame::Search, m_frameBefore = NearFrame::Search;
    SearchInput m_input{};
    const Aabb* m_boxesOfCaller = nullptr;
    std::uint64_t m_count = 0;  ///< number of boxes
    DeltaCounts m_counts{};
    std::uint64_t m_oldCount = 0;  ///< boxes of the previous update
    unsigned m_side = 0;           ///< index of this update's boxes and pairs
    bool m_isFresh = true;
    Buffer<AlignedBox> m_boxes[2];
    Buffer<Aabb> m_again;  ///< boxes for a repeated search
    Buffer<RowPair> m_kept[2], m_added[2];
    Buffer<float> m_depths[2];  ///< depths of kept pairs
    Buffer<RowPair> m_removed;
    Buffer<DeltaTallies> m_tallies;  ///< the previous counts say how many pairs there are
    typename Exec::template Staging<DeltaTallies> m_staged;
};
}  // namespace cullet::psap
