// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Settled mode: boxes in their shells, and the pairs of them that may change.
#include "cullet/broad/grid/column_grid_backend.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace cullet
{
namespace
{
// Share of active boxes from which a refill of everything is cheaper than queries of the active ones.
constexpr double kActiveShare = 0.22;
// Share of changed rows, one in so many, from which all boxes and all watched pairs are looked at.
constexpr std::uint32_t kManyShare = 4;
// Boxes or pairs that a kernel looks at in one call.
constexpr std::uint32_t kBlock = 512;
}  // namespace

ColumnGridBackend::SettledOutcome ColumnGridBackend::updateSettled(const ProxyView& view)
{
    // What is sure was judged by the margin.
    const double moving = ModePolicy::kCostOfMoving * view.size;
    const double settling = ModePolicy::kCostOfSettling * view.size;
    if (view.margin != m_settledMargin)
    {
        decide("the margin changed", 0, settling, moving);
        return SettledOutcome::Refill;
    }
    if (view.dirtyCount == 0)
    {
        m_stats.path = "idle";
        decide("nothing changed", m_active.size(), 0, moving);
        return SettledOutcome::Done;
    }
    findEscaped(view);
    const double share = m_options.rebuildFraction >= 0 ? m_options.rebuildFraction : kActiveShare;
    const std::size_t active = m_active.size() + m_escaped.size();
    const double watching = ModePolicy::costOfPhase(active, m_quietCount);
    if (static_cast<double>(active) > share * view.size + 8)
    {
        decide("too many boxes left their shells", active, moving, watching);
        return SettledOutcome::Refill;
    }
    // Active boxes that came to rest are worth a refill.
    if (m_wasted > settling && m_options.rebuildFraction < 0)
    {
        decide("boxes outside of their shells came to rest", active, settling, watching);
        return SettledOutcome::Refill;
    }
    decide("most boxes rest", active, watching, moving);
    m_policy.count(active, m_quietCount);
    m_workers.limit(watching);
    for (const std::uint32_t row : m_escaped)
        activate(row);
    m_stats.path = m_active.empty() ? "watch" : "incremental";
    updateWatched(view);
    if (!m_active.empty())
        updateActive(view);
    return SettledOutcome::Done;
}

/// Sorts the changed rows into those inside their shell and those that must become active.
void ColumnGridBackend::findEscaped(const ProxyView& view)
{
    m_quiet.clear();
    m_escaped.clear();
    // In a shell without end everything is inside, what went too.
    m_haveFewChanged = view.dirtyCount <= view.size / kManyShare || !std::isfinite(m_slack);
    const std::uint32_t activeMoves = m_haveFewChanged ? findEscapedOfFew(view) : findEscapedOfAll(view);
    m_quietCount = view.dirtyCount - activeMoves - m_escaped.size();
    m_wasted += ModePolicy::kCostOfStranded * static_cast<double>(m_active.size() - activeMoves);
}

/// @return changed rows that are active
std::uint32_t ColumnGridBackend::findEscapedOfFew(const ProxyView& view)
{
    std::uint32_t activeMoves = 0;
    for (std::uint32_t i = 0; i < view.dirtyCount; ++i)
    {
        const std::uint32_t row = view.dirty[i];
        if (m_states[row] == RowState::Active)
            ++activeMoves;
        else if (m_states[row] == RowState::Absent ||
                 (view.changes[row] & (kRowCreated | kRowDestroyed)) != 0 ||
                 !isInsideShell(view.boxes[row], m_reference[row], m_slack))
            m_escaped.push_back(row);
        else
            m_quiet.push_back(row);
    }
    return activeMoves;
}

/// The same where many rows changed: all boxes in a row, changed or not, are compared in less time than those that changed.
/// New boxes, and those that went, are outside of any shell.
std::uint32_t ColumnGridBackend::findEscapedOfAll(const ProxyView& view)
{
    const ShellSource source = {view.boxes, m_reference.data(), m_slack};
    std::array<std::uint32_t, kBlock> outside;
    for (std::uint32_t begin = 0; begin < view.size; begin += kBlock)
    {
        const std::uint32_t end = std::min(begin + kBlock, view.size);
        const std::uint32_t count = m_kernels.findOutside(source, begin, end, outside.data());
        for (std::uint32_t i = 0; i < count; ++i)
        {
            const std::uint32_t row = outside[i];
            if (view.changes[row] != kRowUnchanged && m_states[row] != RowState::Active)
                m_escaped.push_back(row);
        }
    }
    return static_cast<std::uint32_t>(std::count_if(m_active.begin(), m_active.end(),
                                                    [&](std::uint32_t row)
                                                    { return view.changes[row] != kRowUnchanged; }));
}

void ColumnGridBackend::activate(std::uint32_t row)
{
    beginList(row);
    m_states[row] = RowState::Active;
    m_active.push_back(row);
}

/// Whether a held pair of boxes as they are in their references stays so inside their shells.
bool ColumnGridBackend::isSure(const VerletPairs& pairs, const Aabb& a, const Aabb& b) const
{
    return &pairs == &m_settled && gapOf(a, b) <= m_sureGap;
}

/// Only open and held pairs can change.
void ColumnGridBackend::changeWatchedPair(const ProxyView& view, VerletPairs& pairs, std::size_t index,
                                          unsigned worker)
{
    const VerletPairs::State state = pairs.state(index);
    const RowPair pair = pairs.pair(index);
    const Aabb& a = view.boxes[pair.a];
    const Aabb& b = view.boxes[pair.b];
    const bool overlap = overlapsBranchless(a, b);
    // An open pair may be one that was held although its filter words had come to reject it: hence the question.
    if (state == VerletPairs::State::Open && overlap && mayEnter(view, pair))
    {
        const bool stays = isSure(pairs, m_reference[pair.a], m_reference[pair.b]);
        pairs.setState(index, stays ? VerletPairs::State::Sure : VerletPairs::State::Held);
        m_added[worker].push(idsOf(view, pair));
    }
    else if (state == VerletPairs::State::Held && !overlap && !overlapsWithMargin(a, b, view.margin))
    {
        pairs.setState(index, VerletPairs::State::Open);
        m_removed[worker].push(idsOf(view, pair));
    }
}

void ColumnGridBackend::updateWatched(const ProxyView& view)
{
    // All in a row is faster per pair than box by box.
    if (!m_haveFewChanged)
    {
        m_stats.candidates += m_settled.changeableCount();
        updateAllWatched(view, m_settled, 0);
        return;
    }
    for (const std::uint32_t row : m_quiet)
    {
        m_settled.forEachOf(row,
                            [&](std::size_t index)
                            {
                                if (!m_settled.isChangeable(index))
                                    return;
                                ++m_stats.candidates;
                                changeWatchedPair(view, m_settled, index, 0);
                            });
    }
}

/// Hardly any of them changes, and which one nobody can predict.
void ColumnGridBackend::updateAllWatched(const ProxyView& view, VerletPairs& pairs, unsigned worker)
{
    const WatchSource source = pairs.watchSource(view.boxes, view.margin);
    std::array<std::uint32_t, kBlock> stirred;
    const auto first = static_cast<std::uint32_t>(pairs.firstWatched());
    const auto size = static_cast<std::uint32_t>(pairs.size());
    for (std::uint32_t begin = first; begin < size; begin += kBlock)
    {
        const std::uint32_t end = std::min(begin + kBlock, size);
        const std::uint32_t count = m_kernels.findStirred(source, begin, end, stirred.data());
        for (std::uint32_t i = 0; i < count; ++i)
            changeWatchedPair(view, pairs, stirred[i], worker);
    }
}
}  // namespace cullet
