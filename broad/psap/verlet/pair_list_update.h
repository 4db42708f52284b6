// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/update/upload_steps.h"
#include "cullet/broad/psap/verlet/neighbour_list.h"
#include "cullet/broad/psap/verlet/pair_list_steps.h"

#include <cstdint>

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
class PairListUpdate
{
public:
    explicit PairListUpdate(const PsapOptions& options) : m_neighbours(options) {}

    /// Chooses the mode of the next update. The executor must have completed the last update, but not the list made
    /// after it.
    void choose(const ProxyView& view)
    {
        bool hasList = m_neighbours.chooseFollow(view.size, thinnest(view.margin));
        // The list does not contain the new rows.
        if (hasList && (view.anyChanges & (kRowCreated | kRowDestroyed)) != 0)
        {
            m_neighbours.policy().recordFollowed(kInfinity);
            hasList = false;
        }
        if (!hasList)
            stopFollowing();
    }
    bool isFollowed() const { return m_state >= State::New; }
    /// Discards the list, since the rows will be others.
    void forget() { m_neighbours.policy().forget(); }

    /// Reserves the counters. To be called before motionRecorder().
    void reserveCounts(Exec& exec)
    {
        if (m_reports.size() != 0)
            return;
        exec.reserve(m_counts, 1);
        exec.reserve(m_reports, 2);
        m_reports.data()[0] = m_reports.data()[1] = {};
    }

    /// What the upload of changed rows records of their motion.
    MotionRecorder motionRecorder(std::uint32_t* motion) const
    {
        return {motion, isFollowed() ? m_neighbours.reference() : nullptr,
                isFollowed() ? &m_counts.data()->displacement : nullptr};
    }

    /// @param sentRows as FollowHeld::sentRows
    void follow(Exec& exec, const Aabb* boxes, const Filter* filters, const std::uint32_t* sentRows,
                float margin, const HeldLists& lists)
    {
        exec.forEachCompacted(m_neighbours.room(),
                              FollowHeld{list(), m_neighbours.isHeld(m_current),
                                         m_neighbours.isHeld(1 - m_current), boxes, filters, sentRows, margin,
                                         &m_counts.data()->displacement, exec.mappedForWriting(&report())},
                              lists.changes());
    }
    /// Lists the held pairs from the flags: no list of them is kept up to date while the neighbour list is followed.
    ///
    /// @param before those before this update; null: not needed
    /// @param now    those of this update, after follow() and before recordUpdate(); null: not needed
    void listHeld(Exec& exec, const PairList* before, const PairList* now)
    {
        const AppendHeld step = {list(),
                                 {before != nullptr ? m_neighbours.isHeld(m_current) : nullptr,
                                  now != nullptr ? m_neighbours.isHeld(1 - m_current) : nullptr}};
        const PairList none = {nullptr, 0, nullptr};
        exec.forEachMultiAppend(
            m_neighbours.room(), step,
            PairLists<2>{{before != nullptr ? *before : none, now != nullptr ? *now : none}});
    }
    /// Collects the report of follow(), once, after the executor has completed it. Returns whether follow() found all
    /// changes; if not, it has found none, and the update has to be searched.
    bool collectResult()
    {
        if (report().pairs > m_room)
        {
            const bool hasOverflowed = report().pairs == kOverflowed;
            m_neighbours.recordOverflow(report().pairs);
            m_state = hasOverflowed ? State::Overflowed : State::None;
            return false;
        }
        const float displacement = floatOf(report().displacement);
        if (m_state != State::Replaced)
            m_neighbours.policy().recordFollowed(displacement);
        if (displacement <= kMostDisplacement)
            return true;
        giveUp();
        return false;
    }
    /// Whether this is the last update that follows the list: it is being replaced, so that follow() may not be called
    /// again.
    bool isReplaced() const { return m_state >= State::Ending; }
    /// Discards the list, and one that was begun early, since the update is searched after all and the held pairs are
    /// others.
    void giveUp()
    {
        if (m_state == State::Replaced)
            m_neighbours.policy().forget();
        stopFollowing();
    }

    /// Completes the update.
    ///
    /// @param held number of held pairs
    void recordUpdate(std::uint64_t held)
    {
        if (m_state == State::None)
            m_neighbours.recordSearchedSkin(NeighbourMode::Search);
        if (!isFollowed())
            return;
        m_current = 1 - m_current;
        if (m_state == State::New)
            m_neighbours.recordBegun(report().pairs, m_heldAtBegin);
        if (m_state == State::Replaced)
            adoptNextList(held);
        else
            m_state = State::Followed;
    }

    /// Decides whether the next list is begun after follow(), before its result is known.
    bool tryBeginEarly()
    {
        if (!m_neighbours.policy().tryBeginEarly())
            return false;
        m_state = State::Ending;
        return true;
    }
    /// Decides whether the next list is begun after recordUpdate().
    bool tryBegin(std::uint64_t count) { return m_neighbours.policy().tryBegin(count); }
    /// Gives boxes their skins for a new list. Discards the last list, but not the number of its pairs.
    ///
    /// @return whether there is enough memory
    bool grow(Exec& exec, const RowBoxes& rows, std::uint64_t count)
    {
        if (!m_neighbours.reserve(exec, count))
            return false;
        exec.clear(m_counts.data(), 1);
        m_neighbours.growRows(exec, rows);
        return true;
    }
    const Aabb* grown() const { return m_neighbours.grown(); }
    bool recordSearchedSkin() { return m_neighbours.recordSearchedSkin(NeighbourMode::Begin); }
    /// Whether there is no list because the search for the last one overflowed. The next call returns false.
    bool collectOverflow()
    {
        const bool hasOverflowed = m_state == State::Overflowed;
        if (hasOverflowed)
            m_state = State::None;
        return hasOverflowed;
    }
    /// Hysteresis pairs of the last list, which need the table.
    std::uint64_t lookups() const { return report().lookups; }

    /// Makes the search write the neighbouring pairs to the list, and computes which of them are held.
    ///
    /// @pre the search was built for grown()
    /// @param held as of this update
    /// @param table empty, with a count of 0; empty again afterwards
    template <class Search>
    void begin(Exec& exec, Search& search, const PairListView& held, const Aabb* boxes, const Filter* filters,
               const LookupTable& table)
    {
        const bool isEarly = m_state == State::Ending;
        m_neighbours.find(exec, search, m_counts.data());
        exec.forEach(held.room, InsertHysteresisPairs{held, boxes, filters, table});
        const unsigned current = isEarly ? 1 - m_current : m_current;
        exec.forEach(m_neighbours.room(), BeginHeld{list(), m_neighbours.isHeld(current),
                                                    m_neighbours.reference(), filters, table});
        exec.forEach(table.mask + 1,
                     FinishList{table, list(), exec.mappedForWriting(m_reports.data() + 1 - m_reportIndex)});
        if (isEarly)
            m_state = State::Replaced;
        else
            adoptNextList(held.room);
    }

    void sample(Exec& exec, const RowBoxes& rows, std::uint64_t count)
    {
        m_neighbours.sample(exec, rows, count);
    }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    /// What is known of the neighbour list; from New on this update follows it. In braces what leads to a state:
    ///
    ///         {begin()}     {recordUpdate()}          {tryBeginEarly()}        {begin()}
    ///   None ----------> New --------------> Followed ----------------> Ending ---------> Replaced
    ///    ^ ^              |  ^                  |                          |                 |  |
    ///    | '--------------+--|------------------+--------------------------+-----------------'  |
    ///    |   {choose(), collectResult(), giveUp()}                                              |
    ///    |                |  '------------------------------------------------------------------'
    ///    |                v  {collectResult()}                {recordUpdate()}
    ///    '----------- Overflowed
    ///   {collectOverflow()}
    enum class State : std::uint8_t
    {
        None,        ///< no list
        Overflowed,  ///< no list, since the search for it overflowed
        New,         ///< nobody has read the list's report
        Followed,
        Ending,   ///< as Followed, for the last time: the next list may overwrite this one
        Replaced  ///< as Ending, and the next list was begun
    };

    void stopFollowing()
    {
        if (isFollowed())
            m_state = State::None;
    }

    /// The next update will use the list that was begun.
    ///
    /// @param held number of held pairs
    void adoptNextList(std::uint64_t held)
    {
        m_reportIndex = 1 - m_reportIndex;
        m_room = m_neighbours.room();
        m_heldAtBegin = held;
        m_state = State::New;
    }

    /// Slightly more than the margin, because of rounding: all held pairs must be in the list.
    static float thinnest(float margin) { return margin * (1 + 0x1p-10f); }

    NeighbourView list() const { return m_neighbours.list(m_counts.data()); }
    NeighbourReport& report() { return m_reports.data()[m_reportIndex]; }
    const NeighbourReport& report() const { return m_reports.data()[m_reportIndex]; }

    NeighbourStore<Exec> m_neighbours;
    State m_state = State::None;
    std::uint64_t m_room = 0;         ///< room of the list in use
    std::uint64_t m_heldAtBegin = 0;  ///< held pairs when the list was begun
    unsigned m_current = 0;           ///< index of the flags of the last update
    unsigned m_reportIndex = 0;       ///< index of the list's report
    Buffer<NeighbourCounts> m_counts;
    typename Exec::template Staging<NeighbourReport> m_reports;
};
}  // namespace cullet::psap
