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
constexpr double kAwakeShare = 0.22;
// Where more than one row in so many changed, all boxes and all changeable pairs are tested.
constexpr std::uint32_t kManyShare = 4;
// Boxes or pairs per call of a kernel.
constexpr std::uint32_t kBlock = 512;
}  // namespace

ColumnGridBackend::RestingOutcome ColumnGridBackend::updateResting(const ProxyView& view)
{
    // Persistent pairs were classified by the margin.
    const double moving = ModePolicy::kCostOfMoving * view.size;
    const double restingRefill = ModePolicy::kCostOfRestingRefill * view.size;
    if (view.margin != m_restingMargin)
    {
        recordDecision("the margin changed", 0, restingRefill, moving);
        return RestingOutcome::Refill;
    }
    if (view.dirtyCount == 0)
    {
        m_stats.path = "idle";
        recordDecision("nothing changed", m_awake.size(), 0, moving);
        return RestingOutcome::Done;
    }
    classifyChangedBoxes(view);
    const double share = m_options.rebuildFraction >= 0 ? m_options.rebuildFraction : kAwakeShare;
    const std::size_t awake = m_awake.size() + m_outsideSkin.size();
    const double resting = ModePolicy::costOfPhase(awake, m_insideSkinCount);
    if (static_cast<double>(awake) > share * view.size + 8)
    {
        recordDecision("too many boxes left their shells", awake, moving, resting);
        return RestingOutcome::Refill;
    }
    // Too much work on awake boxes at rest is worth a refill.
    if (m_wasted > restingRefill && m_options.rebuildFraction < 0)
    {
        recordDecision("boxes outside of their shells came to rest", awake, restingRefill, resting);
        return RestingOutcome::Refill;
    }
    recordDecision("most boxes rest", awake, resting, moving);
    m_policy.count(awake, m_insideSkinCount);
    m_workers.limit(resting);
    for (const std::uint32_t row : m_outsideSkin)
        wakeBox(row);
    m_stats.path = m_awake.empty() ? "watch" : "incremental";
    updateRestingPairs(view);
    if (!m_awake.empty())
        updateAwake(view);
    return RestingOutcome::Done;
}

/// Divides the changed rows into those inside their skin and those that become awake.
void ColumnGridBackend::classifyChangedBoxes(const ProxyView& view)
{
    m_insideSkin.clear();
    m_outsideSkin.clear();
    // In an infinite skin everything is inside, destroyed boxes too, so that the kernel finds none.
    m_hasFewChanges = view.dirtyCount <= view.size / kManyShare || !std::isfinite(m_skin);
    const std::uint32_t awakeMoves = m_hasFewChanges ? classifyFewChangedBoxes(view) : classifyAllBoxes(view);
    m_insideSkinCount = view.dirtyCount - awakeMoves - m_outsideSkin.size();
    m_wasted += ModePolicy::kCostOfAwakeAtRest * static_cast<double>(m_awake.size() - awakeMoves);
}

/// @return number of changed rows that are awake
std::uint32_t ColumnGridBackend::classifyFewChangedBoxes(const ProxyView& view)
{
    std::uint32_t awakeMoves = 0;
    for (std::uint32_t i = 0; i < view.dirtyCount; ++i)
    {
        const std::uint32_t row = view.dirty[i];
        if (m_states[row] == RowState::Awake)
            ++awakeMoves;
        else if (m_states[row] == RowState::Absent ||
                 (view.changes[row] & (kRowCreated | kRowDestroyed)) != 0 ||
                 !isInsideSkin(view.boxes[row], m_reference[row], m_skin))
            m_outsideSkin.push_back(row);
        else
            m_insideSkin.push_back(row);
    }
    return awakeMoves;
}

/// Variant for many changed rows: comparing all boxes in order, changed or not, takes less time than visiting the
/// changed ones. Created and destroyed boxes are outside of any skin.
std::uint32_t ColumnGridBackend::classifyAllBoxes(const ProxyView& view)
{
    const SkinSource source = {view.boxes, m_reference.data(), m_skin};
    std::array<std::uint32_t, kBlock> outside;
    for (std::uint32_t begin = 0; begin < view.size; begin += kBlock)
    {
        const std::uint32_t end = std::min(begin + kBlock, view.size);
        const std::uint32_t count = m_kernels.findBoxesOutsideSkin(source, begin, end, outside.data());
        for (std::uint32_t i = 0; i < count; ++i)
        {
            const std::uint32_t row = outside[i];
            if (view.changes[row] != kRowUnchanged && m_states[row] != RowState::Awake)
                m_outsideSkin.push_back(row);
        }
    }
    return static_cast<std::uint32_t>(std::count_if(m_awake.begin(), m_awake.end(),
                                                    [&](std::uint32_t row)
                                                    { return view.changes[row] != kRowUnchanged; }));
}

void ColumnGridBackend::wakeBox(std::uint32_t row)
{
    beginList(row);
    m_states[row] = RowState::Awake;
    m_awake.push_back(row);
}

/// Whether a held pair with these reference boxes stays held while both boxes are inside their skins.
bool ColumnGridBackend::isPersistent(const VerletPairs& pairs, const Aabb& a, const Aabb& b) const
{
    return &pairs == &m_restingPairs && gapOf(a, b) <= m_persistentGap;
}

/// Updates the state of a changeable pair by its boxes, and reports a change of the pair set.
void ColumnGridBackend::updatePairState(const ProxyView& view, VerletPairs& pairs, std::size_t index,
                                        unsigned worker)
{
    const VerletPairs::State state = pairs.state(index);
    const RowPair pair = pairs.pair(index);
    const Aabb& a = view.boxes[pair.a];
    const Aabb& b = view.boxes[pair.b];
    const bool overlap = overlapsBranchless(a, b);
    // A candidate may be a former pair that the filter words reject by now, hence mayEnter().
    if (state == VerletPairs::State::Candidate && overlap && mayEnter(view, pair))
    {
        const bool stays = isPersistent(pairs, m_reference[pair.a], m_reference[pair.b]);
        pairs.setState(index, stays ? VerletPairs::State::Persistent : VerletPairs::State::Overlapping);
        m_added[worker].push(idsOf(view, pair));
    }
    else if (state == VerletPairs::State::Overlapping && !overlap && !overlapsWithMargin(a, b, view.margin))
    {
        pairs.setState(index, VerletPairs::State::Candidate);
        m_removed[worker].push(idsOf(view, pair));
    }
}

void ColumnGridBackend::updateRestingPairs(const ProxyView& view)
{
    // Testing all pairs in order is faster per pair than box by box.
    if (!m_hasFewChanges)
    {
        m_stats.candidates += m_restingPairs.changeableCount();
        updateChangeablePairs(view, m_restingPairs, 0);
        return;
    }
    for (const std::uint32_t row : m_insideSkin)
    {
        m_restingPairs.forEachOf(row,
                                 [&](std::size_t index)
                                 {
                                     if (!m_restingPairs.isChangeable(index))
                                         return;
                                     ++m_stats.candidates;
                                     updatePairState(view, m_restingPairs, index, 0);
                                 });
    }
}

/// Tests all changeable pairs without branches: hardly any changes, and which one cannot be predicted.
void ColumnGridBackend::updateChangeablePairs(const ProxyView& view, VerletPairs& pairs, unsigned worker)
{
    const PairStateSource source = pairs.pairStateSource(view.boxes, view.margin);
    std::array<std::uint32_t, kBlock> changed;
    const auto first = static_cast<std::uint32_t>(pairs.firstChangeable());
    const auto size = static_cast<std::uint32_t>(pairs.size());
    for (std::uint32_t begin = first; begin < size; begin += kBlock)
    {
        const std::uint32_t end = std::min(begin + kBlock, size);
        const std::uint32_t count = m_kernels.findChangedPairs(source, begin, end, changed.data());
        for (std::uint32_t i = 0; i < count; ++i)
            updatePairState(view, pairs, changed[i], worker);
    }
}
}  // namespace cullet
