// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/verlet/pair_list_update.h"
#include "cullet/broad/row_pair.h"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace cullet::psap
{
/// The held pairs of a PsapBackend in an executor's memory: those before an update, and those that it keeps.
template <class Exec>
class HeldPairs
{
public:
    /// @param initial least room of a list
    explicit HeldPairs(std::uint64_t initial) : m_initial(initial) {}

    void clear()
    {
        m_count = 0;
        m_state = State::Listed;
    }

    /// Holds other pairs. Waits for the executor.
    void upload(Exec& exec, const std::vector<RowPair>& pairs)
    {
        m_count = pairs.size();
        exec.reserve(m_before, std::max(m_count, m_initial));
        exec.uploadAndWait(m_before.data(), pairs.data(), pairs.size());
        exec.reserve(m_depthsBefore, m_before.size());
        m_state = State::Listed;
    }

    /// Reserves the list of the pairs that the next update keeps.
    void prepare(Exec& exec)
    {
        exec.reserve(m_listedCounts, 2);
        exec.reserve(m_kept, std::max(m_count + m_count / 8, m_initial));
        exec.reserve(m_keptDepths, m_kept.size());
    }

    std::uint64_t count() const { return m_count; }
    RowPair* pairs() const { return m_before.data(); }
    /// As DepthList's depths, of pairs(); null: unknown.
    const float* depths() const
    {
        return m_state == State::ListedWithDepths ? m_depthsBefore.data() : nullptr;
    }
    PairListView before() const { return {m_before.data(), m_count, nullptr}; }

    std::uint64_t keptRoom() const { return m_kept.size(); }
    RowPair* kept() const { return m_kept.data(); }
    float* keptDepths() const { return m_keptDepths.data(); }
    /// The pairs that listAlsoKept() has listed.
    PairListView listedKept() const { return {m_kept.data(), m_kept.size(), m_listedCounts.data() + 1}; }

    /// Lists the pairs before the update in pairs(), where only the neighbour list stores them.
    void list(Exec& exec, PairListUpdate<Exec>& neighbours)
    {
        if (m_state == State::InNeighbourList)
            list(exec, neighbours, nullptr);
    }

    /// The same, and lists the pairs held after the update, which follows the neighbour list, in kept().
    void listAlsoKept(Exec& exec, PairListUpdate<Exec>& neighbours)
    {
        const PairList kept = {m_kept.data(), m_kept.size(), m_listedCounts.data() + 1};
        list(exec, neighbours, &kept);
    }

    /// Makes room in kept() for `countAfter` pairs.
    ///
    /// @return whether it was too short, so that its contents may be incomplete
    bool makeRoom(Exec& exec, std::uint64_t kept, std::uint64_t countAfter)
    {
        if (countAfter <= m_kept.size())
            return false;
        exec.reserveKeeping(m_kept, countAfter, kept);
        exec.reserveKeeping(m_keptDepths, m_kept.size(), kept);
        return true;
    }

    /// Ends an update that has searched: kept() has all pairs, with their depths.
    void adoptSearched(std::uint64_t countAfter) { adopt(countAfter, State::ListedWithDepths); }
    /// Ends an update that has followed the neighbour list.
    ///
    /// @param isReplaced whether listAlsoKept() has listed the pairs in kept(), since another list was begun
    void adoptFollowed(std::uint64_t countAfter, bool isReplaced)
    {
        adopt(countAfter, isReplaced ? State::Listed : State::InNeighbourList);
    }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    /// Where the held pairs of the last update are:
    ///
    ///                 update that is searched
    ///   Listed -----------------------------------> ListedWithDepths <-.
    ///    ^  |  update that follows the list            |           |   | searched
    ///    |  '------------> InNeighbourList <-----------'           '---'
    ///    |    list(), list replaced     |
    ///    '------------------------------'
    enum class State : std::uint8_t
    {
        InNeighbourList,  ///< as flags of the neighbour list only
        Listed,           ///< in m_before
        ListedWithDepths  ///< and their depths in m_depthsBefore
    };

    void list(Exec& exec, PairListUpdate<Exec>& neighbours, const PairList* kept)
    {
        const bool isListed = m_state != State::InNeighbourList;
        exec.reserve(m_before, m_count);
        exec.clear(m_listedCounts.data(), 2);
        const PairList before = {m_before.data(), m_before.size(), m_listedCounts.data()};
        neighbours.listHeld(exec, isListed ? nullptr : &before, kept);
        if (!isListed)
            m_state = State::Listed;
    }

    void adopt(std::uint64_t countAfter, State state)
    {
        m_count = countAfter;
        m_state = state;
        if (state == State::InNeighbourList)
            return;
        std::swap(m_before, m_kept);
        std::swap(m_depthsBefore, m_keptDepths);
    }

    std::uint64_t m_initial;
    std::uint64_t m_count = 0;
    State m_state = State::Listed;
    Buffer<std::uint64_t> m_listedCounts;  ///< numbers of pairs that list() has listed, before and after
    Buffer<RowPair> m_before, m_kept;
    Buffer<float> m_depthsBefore, m_keptDepths;  ///< as in DepthList
};
}  // namespace cullet::psap
