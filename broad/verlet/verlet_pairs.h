// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/boxes/aabb_simd.h"
#include "cullet/broad/grid/columns/column_soa.h"
#include "cullet/broad/pairs/pair_tests.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace cullet
{
/// The pairs among boxes that stay near a reference position: a Verlet list with a skin, as in molecular dynamics,
/// made exact.
///
/// A *persistent* pair is held (in the pair set) and stays so wherever its two boxes are within their skins around
/// the reference boxes. A *changeable* pair may enter or leave the pair set: it is an *overlapping* pair, which is
/// held, or a *candidate*, which is not. Pairs that are not held and cannot overlap within the skins are not listed.
class VerletPairs
{
public:
    enum class State : std::uint8_t
    {
        Persistent,
        Overlapping,
        Candidate,
        Expired  ///< one of the boxes left its skin; the pair has left this list
    };

    void clear();
    /// Frees what a former list needed, if this one is much smaller.
    void trim();

    /// Held pairs whose reference boxes have at most this gap are persistent. Before the first call none are.
    void setPersistentGap(float gap) { m_persistentGap = gap; }
    bool isPersistent(const Aabb& a, const Aabb& b) const
    {
        return m_persistentGap && gapOf(a, b) <= *m_persistentGap;
    }

    /// Adds a pair; all persistent pairs come first. A list that is used for changeable pairs only may leave them out.
    void add(RowPair pair, State state);

    /// Builds the index of forEachOf(), after the last pair. O(rows + pairs).
    void finish(std::uint32_t rowCount);

    std::size_t size() const { return m_pairs.size(); }
    std::size_t firstChangeable() const { return m_firstChangeable; }
    RowPair pair(std::size_t index) const { return m_pairs[index]; }
    State state(std::size_t index) const { return m_states[index]; }
    void setState(std::size_t index, State state) { m_states[index] = state; }

    /// Whether a pair may enter or leave the pair set while its boxes are within their skins.
    bool isChangeable(std::size_t index) const { return isChangeable(m_states[index]); }
    std::size_t changeableCount() const;

    /// Input of the kernel that finds the pairs that do so.
    PairStateSource pairStateSource(const Aabb* boxes, float margin) const;

    /// Updates the state of a pair by its boxes.
    ///
    /// @param references by row: boxes for which setPersistentGap() holds
    /// @param report     called as report(pair, isHeld) if the pair enters or leaves the pair set
    template <class Report>
    void update(std::size_t index, const ProxyView& view, const Aabb* references, Report report);

    /// Updates all changeable pairs without branches: hardly any changes, and which one cannot be predicted.
    template <class Report>
    void updateChangeable(const ColumnKernels& kernels, const ProxyView& view, const Aabb* references,
                          Report report);

    /// Expires the pairs for which isOver(pair) is true.
    template <class IsOver>
    void expireIf(IsOver isOver)
    {
        for (std::size_t i = 0; i < m_pairs.size(); ++i)
        {
            if (isOver(m_pairs[i]))
                m_states[i] = State::Expired;
        }
    }

    /// Calls visit(index) for every pair of a row that has not expired.
    template <class Visit>
    void forEachOf(std::uint32_t row, Visit visit) const
    {
        if (row + 1 >= m_offsets.size())
            return;
        for (std::uint32_t i = m_offsets[row]; i < m_offsets[row + 1]; ++i)
        {
            if (m_states[m_items[i]] != State::Expired)
                visit(m_items[i]);
        }
    }

    /// Calls visit(pair) for every pair that is in the pair set.
    template <class Visit>
    void forEachHeld(Visit visit) const
    {
        for (std::size_t i = 0; i < m_pairs.size(); ++i)
        {
            if (m_states[i] == State::Persistent || m_states[i] == State::Overlapping)
                visit(m_pairs[i]);
        }
    }

    std::uint64_t bytes() const;

private:
    static bool isChangeable(State state) { return state == State::Candidate || state == State::Overlapping; }

    std::vector<RowPair> m_pairs;
    std::vector<State> m_states;
    std::size_t m_firstChangeable = 0;
    std::optional<float> m_persistentGap;
    std::vector<std::uint32_t> m_offsets;  // [rows + 1] into m_items
    std::vector<std::uint32_t> m_items;    // pair indices, each twice
};

template <class Report>
void VerletPairs::update(std::size_t index, const ProxyView& view, const Aabb* references, Report report)
{
    const State state = m_states[index];
    const RowPair pair = m_pairs[index];
    const Aabb& a = view.boxes[pair.a];
    const Aabb& b = view.boxes[pair.b];
    const bool overlap = overlapsBranchless(a, b);
    // A candidate may be a former pair that the filter words reject by now, hence mayEnter().
    if (state == State::Candidate && overlap && mayEnter(view, pair))
    {
        const bool stays = isPersistent(references[pair.a], references[pair.b]);
        m_states[index] = stays ? State::Persistent : State::Overlapping;
        report(pair, true);
    }
    else if (state == State::Overlapping && !overlap && !overlapsWithMargin(a, b, view.margin))
    {
        m_states[index] = State::Candidate;
        report(pair, false);
    }
}

template <class Report>
void VerletPairs::updateChangeable(const ColumnKernels& kernels, const ProxyView& view,
                                   const Aabb* references, Report report)
{
    constexpr std::uint32_t kBlock = 512;  // pairs per call of the kernel
    const PairStateSource source = pairStateSource(view.boxes, view.margin);
    std::array<std::uint32_t, kBlock> changed;
    const auto count = static_cast<std::uint32_t>(m_pairs.size());
    for (auto begin = static_cast<std::uint32_t>(m_firstChangeable); begin < count; begin += kBlock)
    {
        const std::uint32_t end = std::min(begin + kBlock, count);
        const std::uint32_t found = kernels.findChangedPairs(source, begin, end, changed.data());
        for (std::uint32_t i = 0; i < found; ++i)
            update(changed[i], view, references, report);
    }
}
}  // namespace cullet
