// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/psap_held_steps.h"
#include "broad/psap_near_pairs.h"
#include "broad/psap_row_steps.h"

#include <cstdint>

namespace cullet::psap
{
/// The lists of an update that tell of held pairs, in an executor's memory.
struct HeldLists
{
    PairList kept, removed, added;

    ThreeLists sent() const { return {{kept, removed, added}}; }
};

/// Near pairs of the rows of a proxy table, and which of them are held.
///
/// An update is choose(), then ready(), then what frame() says: where a list begins, growRows(), find() and judge(); where one is
/// followed, follow(). Those launch only. When the executor is done with them, note() what came of it.
template <class Exec>
class HeldNear
{
public:
    explicit HeldNear(const PsapOptions& options) : m_near(options) {}

    /// What is done with the next update. The executor is done with the last one.
    void choose(const ProxyView& view)
    {
        // A little more than the margin, for rounding: held pairs are to be near.
        m_frame = m_near.choose(view.size, view.margin * (1 + 0x1p-10f));
        if (m_frame != NearFrame::Follow || (view.anyChanges & (kRowCreated | kRowDestroyed)) == 0)
            return;
        m_near.policy().noteFollowed(kInfinity);
        chooseAgain();
    }
    /// In place of following pairs whose boxes have gone too far.
    void chooseAgain() { m_frame = m_near.policy().search(); }
    NearFrame frame() const { return m_frame; }
    /// The list is of no use: rows will be others.
    void forget() { m_near.policy().forget(); }

    /// Makes room. Where there is no memory for a list none begins.
    void ready(Exec& exec, std::uint64_t rows)
    {
        exec.reserve(m_counts, 1);
        exec.reserve(m_report, 1);
        if (m_frame != NearFrame::Begin)
            return;
        exec.clear(m_counts.data(), 1);
        m_rowsGrown = 0;
        if (!m_near.reserve(exec, rows))
            m_frame = NearFrame::Search;
    }

    /// How far rows go is told against these.
    RowWays ways(std::uint32_t* motion) const
    {
        const bool isFollowed = m_frame == NearFrame::Follow;
        return {motion, isFollowed ? m_near.then() : nullptr,
                isFollowed ? &m_counts.data()->stretch : nullptr};
    }

    /// Gives rows up to `end`, which are in place, their skins.
    void growRows(Exec& exec, const RowBoxes& rows, std::uint64_t end)
    {
        m_near.growRows(exec, rows, m_rowsGrown, end);
        m_rowsGrown = end;
    }
    const Aabb* grown() const { return m_near.grown(); }
    bool growsSizes() { return m_near.growsSizes(m_frame); }

    /// Has the search find the near pairs.
    template <class Search>
    void find(Exec& exec, Search& search)
    {
        m_near.find(exec, search, m_counts.data());
    }
    /// Whether there was room for all. Otherwise they are to be found again.
    bool isComplete() const { return report().pairs <= m_near.room(); }
    /// @return whether there is memory for them; otherwise there is no list
    template <class Search>
    bool findAgain(Exec& exec, Search& search)
    {
        const bool isFound = m_near.findAgain(exec, search, m_counts.data(), report().pairs);
        m_frame = isFound ? m_frame : NearFrame::Search;
        return isFound;
    }

    void judge(Exec& exec, const BoxHistory& history, const LookupTable& table, float margin,
               const HeldLists& lists)
    {
        exec.forEachSent(m_near.room(),
                         JudgeHeld{list(), m_near.isHeld(1 - m_side), m_near.then(), history, table, margin,
                                   lists.added.count, exec.mappedForWriting(m_report.data())},
                         lists.sent());
    }

    void follow(Exec& exec, const Aabb* boxes, const Filter* filters, float margin, const HeldLists& lists)
    {
        exec.forEachSent(
            m_near.room(),
            FollowHeld{list(), m_near.isHeld(m_side), m_near.isHeld(1 - m_side), boxes, filters, margin,
                       &m_counts.data()->stretch, lists.added.count, exec.mappedForWriting(m_report.data())},
            lists.sent());
    }
    /// Whether follow() told everything. To be asked once, when the executor is done with it.
    bool noteStretch()
    {
        const float stretch = floatOf(report().stretch);
        m_near.policy().noteFollowed(stretch);
        return stretch <= kMostStretch;
    }

    /// The update is done. @param held pairs
    void note(std::uint64_t held)
    {
        if (m_frame == NearFrame::Search)
            return;
        m_side = 1 - m_side;
        if (m_frame == NearFrame::Begin)
            m_near.noteBegun(report().pairs, held);
    }

    void sample(Exec& exec, const RowBoxes& rows, std::uint64_t count) { m_near.sample(exec, rows, count); }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    NearList list() const { return m_near.list(m_counts.data()); }
    const NearReport& report() const { return *m_report.data(); }

    NearPairs<Exec> m_near;
    NearFrame m_frame = NearFrame::Search;
    std::uint64_t m_rowsGrown = 0;
    unsigned m_side = 0;  ///< of what is held since the last update
    Buffer<NearCounts> m_counts;
    typename Exec::template Staging<NearReport> m_report;
};
}  // namespace cullet::psap
