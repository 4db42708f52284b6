// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/delta_counts.h"
#include "cullet/broad/psap/search.h"
#include "cullet/broad/psap/verlet/neighbour_list.h"

#include <algorithm>
#include <cstdint>

/// What changes in the pairs of boxes that are in an executor's memory already, told without a sort: the old boxes decide
/// what enters, the held pairs what leaves.
namespace cullet::psap
{
/// What an update has counted, in an executor's memory.
struct DeltaTally
{
    DeltaCounts counts;
    /// As BoxHistory::motion, apart from what others count.
    alignas(128) std::uint32_t motion;
};

/// The same of an update and of the one before, and of the near pairs.
struct DeltaTallies
{
    DeltaTally sides[2];
    NearCounts near;
};

/// Makes a row one that had no box.
struct EnterRow
{
    AlignedBox* old;

    CULLET_HOST_DEVICE void operator()(std::uint64_t row) const { storeCopy(old, row, nowhere()); }
};

/// The pairs of an update: those that had stayed, and those that had entered.
struct PairsBefore
{
    const RowPair* kept;
    const float* depths;  ///< of those that had stayed, as DepthList has it; null: not known
    const RowPair* added;
    const DeltaCounts* counts;

    CULLET_HOST_DEVICE bool has(std::uint64_t i) const { return i < counts->kept + counts->added; }
    CULLET_HOST_DEVICE RowPair at(std::uint64_t i) const
    {
        return i < counts->kept ? kept[i] : added[i - counts->kept];
    }
    /// 0: not known
    CULLET_HOST_DEVICE float depthOf(std::uint64_t i) const
    {
        return depths != nullptr && i < counts->kept ? depths[i] : 0.0f;
    }
};

/// Decides whether pair i stays. Boxes that overlapped by more than they have gone since are not looked at.
struct PartPairs
{
    PairsBefore before;
    const AlignedBox* boxes;
    std::uint64_t boxCount;
    const std::uint32_t* motion;  ///< as BoxHistory has it

    CULLET_HOST_DEVICE DepthPair read(std::uint64_t i) const
    {
        if (!before.has(i))
            return {{0, 0}, 0, false};
        return {before.at(i), before.depthOf(i), true};
    }

    /// @param kept    receives the pair when it stays
    /// @param removed receives it when it leaves
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

/// Searches for what changes from one set of boxes to the next, with one of the searches, on one executor.
///
/// An update is prepare(), which may allocate, then launch(), which only launches; later, when the executor is done with
/// both, finish(). Its pairs are in two lists, those that stay and those that enter, so that none is moved, sorted or
/// compared with others.
template <class Exec>
class DeltaSearch
{
public:
    explicit DeltaSearch(const PsapOptions& options)
        : m_initial(std::max<std::uint64_t>(options.initialCapacity, 1)), m_search(options), m_near(options)
    {
    }

    /// Makes room for the next update.
    ///
    /// @param boxes [count] in the executor's memory
    /// @return whether that and the boxes are where they were; what was recorded before is void otherwise
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
        // A list mostly begins where another one has been followed.
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
    /// After launch() or what is in place of it.
    void planAhead(Exec& exec)
    {
        m_search.planAhead(exec);
        m_near.sample(exec, copies(), m_count);
    }
    /// In place of launch(), where what it launches has been launched in another way.
    void countRepeat()
    {
        if (m_frame != NearFrame::Follow)
            m_search.countRepeat();
    }

    /// Searches again with more room as long as the list was too short; then the counts are right.
    ///
    /// The caller's boxes may be others by now.
    ///
    /// @pre the executor is done with launch()
    /// @return whether nothing had to be done again
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

    /// The next update has nothing to compare with.
    void forget()
    {
        m_counts = {};
        m_oldCount = 0;
        m_boxesOfCaller = nullptr;
        m_near.policy().forget();
        m_isFresh = true;
    }
    /// The same after a failure: half of what the search remembers may never have happened.
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
    /// In the executor's memory. While it is at work, there may be more pairs that enter than there is room for.
    const DeltaCounts* countsThere() const { return m_tallies.size() == 0 ? nullptr : &tally()->counts; }
    /// After finish().
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
    /// Changes where what a phase launches is not what it did before.
    std::uint32_t launches() const { return m_search.launches() + m_near.launches(); }
    /// What the last update did.
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
    /// Depths of pairs that were followed are not kept.
    DepthList keptDepths() const { return {keptList(), m_depths[m_side].data()}; }
    PairList addedList() const
    {
        return {m_added[m_side].data(), m_added[m_side].size(), &tally()->counts.added};
    }
    PairList removedList() const { return {m_removed.data(), m_removed.size(), &tally()->counts.removed}; }
    PairLists<3> sentLists() const { return {{removedList(), addedList(), keptList()}}; }
    WasApart wasApart() const { return {m_boxes[1 - m_side].data(), &tally()->motion}; }

    /// @return whether there was enough
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

    /// Without near pairs.
    void search(Exec& exec)
    {
        m_search.build(exec, m_input);
        part(exec);
        m_search.emit(exec, wasApart(), addedList());
    }

    /// Finds the near pairs, and what has changed.
    void begin(Exec& exec)
    {
        exec.clear(nearCounts(), 1);
        m_near.grow(exec, m_boxesOfCaller, copies());
        m_search.build(exec, m_input);
        part(exec);
        m_near.find(exec, m_search, nearCounts());
        judge(exec);
    }

    /// Says of each near pair whether it overlaps.
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
        // As many indices as fit, so that the launch is the same where there are more pairs.
        exec.forEachParted(m_kept[1 - m_side].size() + m_added[1 - m_side].size(),
                           PartPairs{before, now(), m_count, &tally()->motion}, keptDepths(), removedList());
    }

    void download(Exec& exec) { exec.download(m_staged.data(), m_tallies.data(), 1); }

    /// The boxes of this update in a form that can be searched. The caller's may have changed.
    const Aabb* boxesAgain(Exec& exec)
    {
        exec.reserve(m_again, m_count);
        exec.forEach(m_count, UnalignBox{now(), m_again.data()});
        return m_again.data();
    }

    /// In place of following near pairs that do not tell everything any more.
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

    /// Where there is no memory for one.
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
    std::uint64_t m_count = 0;  ///< boxes
    DeltaCounts m_counts{};
    std::uint64_t m_oldCount = 0;  ///< boxes of the last update
    unsigned m_side = 0;           ///< of the boxes and pairs of this update
    bool m_isFresh = true;
    Buffer<AlignedBox> m_boxes[2];
    Buffer<Aabb> m_again;  ///< those to be searched again
    Buffer<RowPair> m_kept[2], m_added[2];
    Buffer<float> m_depths[2];  ///< of pairs kept
    Buffer<RowPair> m_removed;
    Buffer<DeltaTallies> m_tallies;  ///< what was counted the last time tells how many pairs there are
    typename Exec::template Staging<DeltaTallies> m_staged;
};
}  // namespace cullet::psap
