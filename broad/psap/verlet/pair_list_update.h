// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/update/upload_steps.h"
#include "cullet/broad/psap/verlet/neighbour_list.h"
#include "cullet/broad/psap/verlet/pair_list_steps.h"

#include <cstdint>
#include <utility>

namespace cullet::psap
{
/// The lists of an update that tell of held pairs, in an executor's memory.
struct HeldLists
{
    PairList kept, removed, added;

    /// Those of pairs that change; there a list that is followed knows which are kept.
    PairLists<2> changes() const { return {{removed, added}}; }
};

/// Near pairs of the rows of a proxy table, and which of them are held.
///
/// An update is choose(), then ready(), where it says so follow() and isTold(), and note(). A list is made behind the changes that an
/// update tells, with nobody waiting for it: the next update is the first to learn what came of that. All of these launch only.
template <class Exec>
class HeldNear
{
public:
    explicit HeldNear(const PsapOptions& options) : m_near(options) {}

    /// What is done with the next update. The executor is done with the last one, but maybe not with the list made behind it.
    void choose(const ProxyView& view)
    {
        m_isFollowed = m_near.follows(view.size, thinnest(view.margin));
        // Rows of which the list knows nothing.
        if (m_isFollowed && (view.anyChanges & (kRowCreated | kRowDestroyed)) != 0)
        {
            m_near.policy().noteFollowed(kInfinity);
            m_isFollowed = false;
        }
    }
    bool isFollowed() const { return m_isFollowed; }
    /// The list is of no use: rows will be others.
    void forget() { m_near.policy().forget(); }

    /// Makes room for what is counted. Before ways().
    void ready(Exec& exec)
    {
        if (m_reports.size() != 0)
            return;
        exec.reserve(m_counts, 1);
        exec.reserve(m_reports, 2);
        m_reports.data()[0] = m_reports.data()[1] = {};
    }

    /// How far rows go is told against these.
    RowWays ways(std::uint32_t* motion) const
    {
        return {motion, m_isFollowed ? m_near.then() : nullptr,
                m_isFollowed ? &m_counts.data()->stretch : nullptr};
    }

    /// @param sentRows as FollowHeld has them
    void follow(Exec& exec, const Aabb* boxes, const Filter* filters, const std::uint32_t* sentRows,
                float margin, const HeldLists& lists)
    {
        exec.forEachSifted(
            m_near.room(),
            FollowHeld{list(), m_near.isHeld(m_side), m_near.isHeld(1 - m_side), boxes, filters, sentRows,
                       margin, &m_counts.data()->stretch, exec.mappedForWriting(&report())},
            lists.changes());
    }
    /// Lists the held pairs, which nobody has listed since near pairs are followed.
    ///
    /// @param before those before this update; null: they are not asked for
    /// @param now    those of this update, behind follow(), and before note()
    void listHeld(Exec& exec, const PairList* before, const PairList* now)
    {
        const SendHeld step = {list(),
                               {before != nullptr ? m_near.isHeld(m_side) : nullptr,
                                now != nullptr ? m_near.isHeld(1 - m_side) : nullptr}};
        const PairList none = {nullptr, 0, nullptr};
        exec.forEachSent(m_near.room(), step,
                         PairLists<2>{{before != nullptr ? *before : none, now != nullptr ? *now : none}});
    }
    /// Whether follow() told everything; otherwise it told nothing, and the update is to be searched. To be asked once, when
    /// the executor is done with it.
    bool isTold()
    {
        if (report().pairs > m_room)
        {
            m_near.noteShort(report().pairs);
            m_isSpilled = report().pairs == kSpilled;
            m_isFollowed = false;
            return false;
        }
        const float stretch = floatOf(report().stretch);
        if (!m_hasNext)
            m_near.policy().noteFollowed(stretch);
        m_isFollowed = stretch <= kMostStretch;
        return m_isFollowed;
    }
    /// Whether the list can be followed once more in this update: unless another one was to be begun in its place.
    bool canFollowAgain() const { return !m_isReplaced; }
    /// The update is to be searched all the same: a list that was begun ahead is of no use, since held pairs are others.
    void giveUp()
    {
        if (m_hasNext)
            m_near.policy().forget();
        m_hasNext = false;
        m_isFollowed = false;
    }

    /// The update is done.
    ///
    /// @param held pairs
    void note(std::uint64_t held)
    {
        if (!m_isFollowed && !m_isSpilled)
            m_near.growsSizes(NearFrame::Search);
        if (!m_isFollowed)
            return;
        m_side = 1 - m_side;
        if (m_isNew)
            m_near.noteBegun(report().pairs, m_heldThen);
        m_isNew = false;
        useNext(held);
    }

    /// Whether a list is to be begun behind follow(), before it is known what that tells.
    bool beginsAhead()
    {
        m_isReplaced = m_near.policy().beginsAhead();
        return m_isReplaced;
    }
    /// The same behind note().
    bool beginsBehind(std::uint64_t count) { return m_near.policy().beginsBehind(count); }
    /// Gives boxes skins for a list that begins. The last one is gone, but for how many pairs it had.
    ///
    /// @return whether there is memory for one
    bool grow(Exec& exec, const RowBoxes& rows, std::uint64_t count)
    {
        if (!m_near.reserve(exec, count))
            return false;
        exec.clear(m_counts.data(), 1);
        m_near.growRows(exec, rows);
        return true;
    }
    const Aabb* grown() const { return m_near.grown(); }
    bool growsSizes() { return m_near.growsSizes(NearFrame::Begin); }
    /// Whether the last list is void since the search had no room. Once.
    bool takeSpill() { return std::exchange(m_isSpilled, false); }
    /// Of the last list: held pairs that a table was needed for.
    std::uint64_t lookups() const { return report().lookups; }

    /// Has the search find the near pairs, and notes which of them are held.
    ///
    /// @pre the search has been given grown()
    /// @param isAhead as beginsAhead() said
    /// @param table free and without a count; the same behind this
    template <class Search>
    void begin(Exec& exec, Search& search, bool isAhead, const PairListView& held, const Aabb* boxes,
               const Filter* filters, const LookupTable& table)
    {
        m_near.find(exec, search, m_counts.data());
        exec.forEach(held.room, TellApart{held, boxes, filters, table});
        const unsigned side = isAhead ? 1 - m_side : m_side;
        exec.forEach(m_near.room(), JudgeNear{list(), m_near.isHeld(side), m_near.then(), filters, table});
        exec.forEach(table.mask + 1,
                     EndList{table, list(), exec.mappedForWriting(m_reports.data() + 1 - m_which)});
        m_hasNext = true;
    }
    /// Where that was not ahead: the next update follows the list.
    void useNext(std::uint64_t held)
    {
        if (!m_hasNext)
            return;
        m_hasNext = false;
        m_which = 1 - m_which;
        m_room = m_near.room();
        m_heldThen = held;
        m_isNew = true;
    }

    void sample(Exec& exec, const RowBoxes& rows, std::uint64_t count) { m_near.sample(exec, rows, count); }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    /// A little more than the margin, for rounding: held pairs are to be near.
    static float thinnest(float margin) { return margin * (1 + 0x1p-10f); }

    NearList list() const { return m_near.list(m_counts.data()); }
    NearReport& report() { return m_reports.data()[m_which]; }
    const NearReport& report() const { return m_reports.data()[m_which]; }

    NearPairs<Exec> m_near;
    bool m_isFollowed = false;
    bool m_isReplaced = false;
    bool m_hasNext = false;  ///< a list has been begun that no update has followed
    bool m_isSpilled = false;
    bool m_isNew = false;          ///< nothing is known yet of the list
    std::uint64_t m_room = 0;      ///< of the list
    std::uint64_t m_heldThen = 0;  ///< when the list was made
    unsigned m_side = 0;           ///< of what is held since the last update
    unsigned m_which = 0;          ///< report that the list has
    Buffer<NearCounts> m_counts;
    typename Exec::template Staging<NearReport> m_reports;
};
}  // namespace cullet::psap
