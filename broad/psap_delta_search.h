// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/delta_counts.h"
#include "broad/psap_pipeline.h"

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

/// Makes a row one that had no box.
struct EnterRow
{
    AlignedBox* old;

    CULLET_HOST_DEVICE void operator()(std::uint64_t row) const { storeCopy(old, row, nowhere()); }
};

/// The pairs of an update: those that had stayed, and those that had entered.
struct PairsBefore
{
    const IdPair* kept;
    const float* depths;  ///< of those that had stayed, as DepthList has it
    const IdPair* added;
    const DeltaCounts* counts;

    CULLET_HOST_DEVICE bool has(std::uint64_t i) const { return i < counts->kept + counts->added; }
    CULLET_HOST_DEVICE IdPair at(std::uint64_t i) const
    {
        return i < counts->kept ? kept[i] : added[i - counts->kept];
    }
    /// 0: not known
    CULLET_HOST_DEVICE float depthOf(std::uint64_t i) const { return i < counts->kept ? depths[i] : 0.0f; }
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
        const IdPair pair = item.pair;
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
        : m_initial(std::max<std::uint64_t>(options.initialCapacity, 1)), m_search(options)
    {
    }

    /// Makes room for the next update.
    ///
    /// @param boxes [count] in the executor's memory
    /// @return whether that and the boxes are where they were; what was recorded before is void otherwise
    bool prepare(Exec& exec, const Aabb* boxes, std::uint64_t count)
    {
        const bool isSame = boxes == m_input.boxes && count == m_input.count && count == m_oldCount;
        m_side = 1 - m_side;
        m_search.look();
        const bool hadRoom = makeRoom(exec, count);
        m_input = {boxes,
                   count,
                   nullptr,
                   m_counts.pairs(),
                   {m_boxes[m_side].data(), m_boxes[1 - m_side].data(), m_oldCount, &tally()->motion}};
        return hadRoom && isSame;
    }
    /// Whether launch() makes the same launches as an earlier one of the same nextPhase().
    bool isRepeatable(const Exec& exec) const { return m_search.isRepeatable(exec, m_input); }

    /// @pre prepare()
    void launch(Exec& exec)
    {
        exec.clear(tally(), 1);
        exec.forEachFrom(m_oldCount, m_input.count, EnterRow{m_boxes[1 - m_side].data()});
        m_search.build(exec, m_input);
        part(exec);
        emit(exec);
        exec.download(m_staged.data(), &tally()->counts, 1);
    }
    /// After launch() or what is in place of it.
    void planAhead(Exec& exec) { m_search.planAhead(exec); }
    /// In place of launch(), where what it launches has been launched in another way.
    void countRepeat() { m_search.countRepeat(); }

    /// Searches again with more room as long as the list was too short; then the counts are right.
    ///
    /// The caller's boxes may be others by now.
    ///
    /// @pre the executor is done with launch()
    /// @return whether nothing had to be done again
    bool finish(Exec& exec)
    {
        bool wasComplete = true;
        for (; staged().added > m_added[m_side].size(); wasComplete = false)
            searchAgain(exec);
        m_counts = staged();
        m_oldCount = m_input.count;
        return wasComplete;
    }

    /// The next update has nothing to compare with.
    void forget()
    {
        m_counts = {};
        m_oldCount = 0;
        m_input = {};
        m_isFresh = true;
    }
    /// The same after a failure: half of what the search remembers may never have happened.
    void recover(const PsapOptions& options)
    {
        m_search = Search<Exec>(options);
        forget();
    }

    const IdPair* kept() const { return m_kept[m_side].data(); }
    const IdPair* added() const { return m_added[m_side].data(); }
    std::uint64_t addedRoom() const { return m_added[m_side].size(); }
    const IdPair* removed() const { return m_removed.data(); }
    /// In the executor's memory. While it is at work, there may be more pairs that enter than there is room for.
    const DeltaCounts* countsThere() const { return m_tally.size() == 0 ? nullptr : &tally()->counts; }
    /// After finish().
    const DeltaCounts& counts() const { return m_counts; }

    static constexpr unsigned kPhases = 2 * Search<Exec>::kPhases;
    unsigned nextPhase() const { return 2 * m_search.nextPhase() + m_side; }
    /// Changes where what a phase launches is not what it did before.
    std::uint32_t launches() const { return m_search.launches(); }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    const DeltaCounts& staged() const { return *m_staged.data(); }
    DeltaTally* tally() const { return m_tally.data() + m_side; }
    DeltaTally* tallyBefore() const { return m_tally.data() + 1 - m_side; }
    const AlignedBox* now() const { return m_boxes[m_side].data(); }

    /// @return whether there was enough
    bool makeRoom(Exec& exec, std::uint64_t count)
    {
        const std::uint64_t bytes = exec.bytes();
        exec.reserve(m_tally, 2);
        exec.reserve(m_staged, 1);
        if (m_isFresh)
            exec.clear(tallyBefore(), 1);
        m_isFresh = false;
        exec.reserve(m_boxes[m_side], count);
        exec.reserveKeeping(m_boxes[1 - m_side], count, m_oldCount);
        const std::uint64_t pairs = m_counts.pairs();
        exec.reserve(m_kept[m_side], std::max(pairs + pairs / 8, m_initial));
        exec.reserve(m_depths[m_side], m_kept[m_side].size());
        exec.reserve(m_added[m_side], m_initial);
        exec.reserve(m_removed, std::max(pairs + pairs / 8, m_initial));
        return exec.bytes() == bytes;
    }

    void part(Exec& exec)
    {
        DeltaCounts& counts = tally()->counts;
        const PairsBefore before = {m_kept[1 - m_side].data(), m_depths[1 - m_side].data(),
                                    m_added[1 - m_side].data(), &tallyBefore()->counts};
        const PairList kept = {m_kept[m_side].data(), m_kept[m_side].size(), &counts.kept};
        // As many indices as fit, so that the launch is the same where there are more pairs.
        exec.forEachParted(m_kept[1 - m_side].size() + m_added[1 - m_side].size(),
                           PartPairs{before, now(), m_input.count, &tally()->motion},
                           DepthList{kept, m_depths[m_side].data()},
                           {m_removed.data(), m_removed.size(), &counts.removed});
    }

    void emit(Exec& exec)
    {
        m_search.emit(exec, WasApart{m_boxes[1 - m_side].data(), &tally()->motion},
                      {m_added[m_side].data(), m_added[m_side].size(), &tally()->counts.added});
    }

    void searchAgain(Exec& exec)
    {
        // The caller's boxes may have changed: from those that were kept.
        exec.reserve(m_again, m_input.count);
        exec.forEach(m_input.count, UnalignBox{now(), m_again.data()});
        m_input.boxes = m_again.data();
        m_input.copies = {};
        const bool isSpilled = staged().added == kSpilled;
        if (!isSpilled)
            exec.reserve(m_added[m_side], staged().added);
        exec.clear(&tally()->counts.added, 1);
        if (isSpilled)
            m_search.buildByCounting(exec, m_input.boxes);
        else
            m_search.build(exec, m_input);
        emit(exec);
        exec.download(m_staged.data(), &tally()->counts, 1);
        exec.wait();
    }

    std::uint64_t m_initial;
    Search<Exec> m_search;
    SearchInput m_input{};
    DeltaCounts m_counts{};
    std::uint64_t m_oldCount = 0;  ///< boxes of the last update
    unsigned m_side = 0;           ///< of the boxes and pairs of this update
    bool m_isFresh = true;
    Buffer<AlignedBox> m_boxes[2];
    Buffer<Aabb> m_again;  ///< those to be searched again
    Buffer<IdPair> m_kept[2], m_added[2];
    Buffer<float> m_depths[2];  ///< of pairs kept
    Buffer<IdPair> m_removed;
    Buffer<DeltaTally>
        m_tally;  ///< [2] by side: what was counted the last time tells how many pairs there are
    typename Exec::template Staging<DeltaCounts> m_staged;
};
}  // namespace cullet::psap
