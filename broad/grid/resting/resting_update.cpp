// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Resting mode: boxes inside their skins, and those of their pairs that may change.
#include "cullet/broad/grid/column_grid_backend.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace cullet
{
namespace
{
// Share of awake boxes from which a refill of the whole grid is cheaper than queries for the awake boxes.
constexpr double kActiveShare = 0.22;
// Where more than one row in so many changed, all boxes and all changeable pairs are tested.
constexpr std::uint32_t kManyShare = 4;
// Boxes or pairs per call of a kernel.
constexpr std::uint32_t kBlock = 512;
}  // namespace

ColumnGridBackend::SettledOutcome ColumnGridBackend::updateSettled(const ProxyView& view)
{
    // Persistent pairs were classified by the margin.
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
    // Too much work on awake boxes at rest is worth a refill.
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

/// Divides the changed rows into those inside their skin and those that become awake.
void ColumnGridBackend::findEscaped(const ProxyView& view)
{
    m_quiet.clear();
    m_escaped.clear();
    // In an infinite skin everything is inside, destroyed boxes too, so that the kernel finds none.
    m_haveFewChanged = view.dirtyCount <= view.size / kManyShare || !std::isfinite(m_slack);
    const std::uint32_t activeMoves = m_haveFewChanged ? findEscapedOfFew(view) : findEscapedOfAll(view);
    m_quietCount = view.dirtyCount - activeMoves - m_escaped.size();
    m_wasted += ModePolicy::kCostOfStranded * static_cast<double>(m_active.size() - activeMoves);
}

/// @return number of changed rows that are awake
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

/// Variant for many changed rows: comparing all boxes in order, changed or not, takes less time than visiting the
/// changed ones. Created and destroyed boxes are outside of any skin.
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

/// Whether a held pair with these reference boxes stays held while both boxes are inside their skins.
bool ColumnGridBackend::isSure(const VerletPairs& pairs, const Aabb& a, const Aabb& b) const
{
    return &pairs == &m_settled && gapOf(a, b) <= m_sureGap;
}

/// Updates the state of a changeable pair by its boxes, and reports a change of the pair set.
void ColumnGridBackend::changeWatchedPair(const ProxyView& view, VerletPairs& pairs, std::size_t index,
                                          unsigned worker)
{
    const VerletPairs::State state = pairs.state(index);
    const RowPair pair = pairs.pair(index);
    const Aabb& a = view.boxes[pair.a];
    const Aabb& b = view.boxes[pair.b];
    const bool overlap = overlapsBranchless(a, b);
    // A candidate may be a former pair that the filter words reject by now, hence mayEnter().
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
    // Testing all pairs in order is faster per pair than box by box.
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

/// Tests all changeable pairs without branches: hardly any changes, and which one cannot be predicted.
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
