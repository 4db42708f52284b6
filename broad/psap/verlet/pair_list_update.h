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
/// The lists of the held pairs of an update, in an executor's memory.
struct HeldLists
{
    PairList kept, removed, added;

    /// The lists of the changes. Where the neighbour list is followed, it stores itself which pairs are kept.
    PairLists<2> changes() const { return {{removed, added}}; }
};

/// The neighbour list of the rows of a proxy table, with a flag for each pair that is held.
///
/// An update calls choose(), reserveCounts(), where isFollowed() is true follow() and collectResult(), and
/// recordUpdate(). The next list is made asynchronously after the delta has been enqueued; the next update is the
/// first to read its report. None of these functions waits.
template <class Exec>
class HeldNear
{
public:
    explicit HeldNear(const PsapOptions& options) : m_near(options) {}

    /// Chooses the mode of the next update. The executor must have completed the last update, but not the list made
    /// after it.
    void choose(const ProxyView& view)
    {
        m_isFollowed = m_near.follows(view.size, thinnest(view.margin));
        // The list does not contain the new rows.
        if (m_isFollowed && (view.anyChanges & (kRowCreated | kRowDestroyed)) != 0)
        {
            m_near.policy().noteFollowed(kInfinity);
            m_isFollowed = false;
        }
    }
    bool isFollowed() const { return m_isFollowed; }
    /// Discards the list, since the rows will be others.
    void forget() { m_near.policy().forget(); }

    /// Reserves the counters. To be called before motionRecorder().
    void ready(Exec& exec)
    {
        if (m_reports.size() != 0)
            return;
        exec.reserve(m_counts, 1);
        exec.reserve(m_reports, 2);
        m_reports.data()[0] = m_reports.data()[1] = {};
    }

    /// What the upload of changed rows records of their motion.
    RowWays ways(std::uint32_t* motion) const
    {
        return {motion, m_isFollowed ? m_near.then() : nullptr,
                m_isFollowed ? &m_counts.data()->stretch : nullptr};
    }

    /// @param sentRows as FollowHeld::sentRows
    void follow(Exec& exec, const Aabb* boxes, const Filter* filters, const std::uint32_t* sentRows,
                float margin, const HeldLists& lists)
    {
        exec.forEachSifted(
            m_near.room(),
            FollowHeld{list(), m_near.isHeld(m_side), m_near.isHeld(1 - m_side), boxes, filters, sentRows,
                       margin, &m_counts.data()->stretch, exec.mappedForWriting(&report())},
            lists.changes());
    }
    /// Lists the held pairs from the flags: no list of them is kept up to date while the neighbour list is followed.
    ///
    /// @param before those before this update; null: not needed
    /// @param now    those of this update, after follow() and before recordUpdate(); null: not needed
    void listHeld(Exec& exec, const PairList* before, const PairList* now)
    {
        const SendHeld step = {list(),
                               {before != nullptr ? m_near.isHeld(m_side) : nullptr,
                                now != nullptr ? m_near.isHeld(1 - m_side) : nullptr}};
        const PairList none = {nullptr, 0, nullptr};
        exec.forEachSent(m_near.room(), step,
                         PairLists<2>{{before != nullptr ? *before : none, now != nullptr ? *now : none}});
    }
    /// Collects the report of follow(), once, after the executor has completed it. Returns whether follow() found all
    /// changes; if not, it has found none, and the update has to be searched.
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
    /// Whether follow() may be called once more in this update: not where the next list has replaced this one
    /// already.
    bool canFollowAgain() const { return !m_isReplaced; }
    /// Discards a list that was begun early, since the update is searched after all and the held pairs are others.
    void giveUp()
    {
        if (m_hasNext)
            m_near.policy().forget();
        m_hasNext = false;
        m_isFollowed = false;
    }

    /// Completes the update.
    ///
    /// @param held number of held pairs
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

    /// Decides whether the next list is begun after follow(), before its result is known.
    bool beginsAhead()
    {
        m_isReplaced = m_near.policy().beginsAhead();
        return m_isReplaced;
    }
    /// Decides whether the next list is begun after recordUpdate().
    bool beginsBehind(std::uint64_t count) { return m_near.policy().beginsBehind(count); }
    /// Gives boxes their skins for a new list. Discards the last list, but not the number of its pairs.
    ///
    /// @return whether there is enough memory
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
    /// Whether the last list is void because the search overflowed. Resets the flag.
    bool takeSpill() { return std::exchange(m_isSpilled, false); }
    /// Hysteresis pairs of the last list, which need the table.
    std::uint64_t lookups() const { return report().lookups; }

    /// Makes the search write the neighbouring pairs to the list, and computes which of them are held.
    ///
    /// @pre the search was built for grown()
    /// @param isEarly result of tryBeginEarly()
    /// @param table empty, with a count of 0; empty again afterwards
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
    /// Adopts a list that was not begun early: the next update will use it.
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

    /// Slightly more than the margin, because of rounding: all held pairs must be in the list.
    static float thinnest(float margin) { return margin * (1 + 0x1p-10f); }

    NearList list() const { return m_near.list(m_counts.data()); }
    NearReport& report() { return m_reports.data()[m_which]; }
    const NearReport& report() const { return m_reports.data()[m_which]; }

    NearPairs<Exec> m_near;
    bool m_isFollowed = false;
    bool m_isReplaced = false;
    bool m_hasNext = false;  ///< a list was begun that no update has followed yet
    bool m_isSpilled = false;
    bool m_isNew = false;          ///< the list's report has not been read yet
    std::uint64_t m_room = 0;      ///< room of the list in use
    std::uint64_t m_heldThen = 0;  ///< held pairs when the list was begun
    unsigned m_side = 0;           ///< index of the flags of the last update
    unsigned m_which = 0;          ///< index of the list's report
    Buffer<NearCounts> m_counts;
    typename Exec::template Staging<NearReport> m_reports;
};
}  // namespace cullet::psap
