// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/resting/resting_mode.h"

#include "cullet/base/bytes_of.h"
#include "cullet/broad/grid/resting/classify_pairs.h"

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
// Boxes per call of a kernel.
constexpr std::uint32_t kRestingBlock = 512;
}  // namespace

void RestingMode::begin(const ProxyView& view, const std::vector<RowPair>& held)
{
    m_core.stats.path = "settle";
    m_skin = Skin::ofMargin(view.margin);
    m_margin = view.margin;
    m_pairs.setPersistentGap(m_skin.persistentGap(view.margin));
    m_policy.begin(view.size);
    m_wasted = 0;
    for (std::uint32_t row = 0; row < view.size; ++row)
        m_states[row] = isValid(view.boxes[row]) ? RowState::Resting : RowState::Absent;
    CollectingSink sink(m_core.workers.threads());
    GridInput input;
    input.boxes = view.boxes;
    input.count = view.size;
    input.grow = m_skin.growth();
    m_core.grid.scan(input, sink, ColumnUse::Query);
    classifyPairs(m_core, view, sink, held, m_pairs);
    m_pairs.finish(view.size);
}

RestingMode::Outcome RestingMode::update(const ProxyView& view)
{
    const double moving = ModePolicy::kCostOfMoving * view.size;
    // Persistent pairs were classified by the margin.
    if (view.margin != m_margin)
    {
        m_core.recordDecision("the margin changed", 0, ModePolicy::kCostOfRestingRefill * view.size, moving);
        return Outcome::Refill;
    }
    if (view.dirtyCount == 0)
    {
        m_core.stats.path = "idle";
        m_core.recordDecision("nothing changed", m_awake.rows().size(), 0, moving);
        return Outcome::Done;
    }
    classifyChangedBoxes(view);
    if (shouldRefill(view))
        return Outcome::Refill;
    const std::size_t awake = m_awake.rows().size() + m_changes.outside.size();
    const double resting = ModePolicy::costOfPhase(awake, m_changes.insideCount);
    m_core.recordDecision("most boxes rest", awake, resting, moving);
    m_policy.count(awake, m_changes.insideCount);
    m_core.workers.limit(resting);
    for (const std::uint32_t row : m_changes.outside)
    {
        m_awake.add(row, m_pairs);
        m_states[row] = RowState::Awake;
    }
    m_core.stats.path = m_awake.rows().empty() ? "watch" : "incremental";
    updatePairs(view);
    if (!m_awake.rows().empty())
        m_awake.update(view, m_skin, !m_changes.outside.empty());
    return Outcome::Done;
}

/// Whether too many boxes are awake, or too much work was spent on awake boxes at rest.
bool RestingMode::shouldRefill(const ProxyView& view)
{
    const float fraction = m_core.options.rebuildFraction;
    const double share = fraction >= 0 ? fraction : kAwakeShare;
    const std::size_t awake = m_awake.rows().size() + m_changes.outside.size();
    const double resting = ModePolicy::costOfPhase(awake, m_changes.insideCount);
    if (static_cast<double>(awake) > share * view.size + 8)
    {
        m_core.recordDecision("too many boxes left their shells", awake,
                              ModePolicy::kCostOfMoving * view.size, resting);
        return true;
    }
    const double restingRefill = ModePolicy::kCostOfRestingRefill * view.size;
    if (m_wasted > restingRefill && fraction < 0)
    {
        m_core.recordDecision("boxes outside of their shells came to rest", awake, restingRefill, resting);
        return true;
    }
    return false;
}

/// Divides the changed rows into those inside their skin and those that become awake.
void RestingMode::classifyChangedBoxes(const ProxyView& view)
{
    m_changes.inside.clear();
    m_changes.outside.clear();
    // In an infinite skin everything is inside, empty boxes too, so that the kernel finds none.
    m_changes.areFew = view.dirtyCount <= view.size / kManyShare || !std::isfinite(m_skin.thickness);
    const std::uint32_t awakeMoves =
        m_changes.areFew ? classifyFewChangedBoxes(view) : classifyAllBoxes(view);
    m_changes.insideCount = view.dirtyCount - awakeMoves - m_changes.outside.size();
    m_wasted += ModePolicy::kCostOfAwakeAtRest * static_cast<double>(m_awake.rows().size() - awakeMoves);
}

/// @return number of changed rows that are awake
std::uint32_t RestingMode::classifyFewChangedBoxes(const ProxyView& view)
{
    std::uint32_t awakeMoves = 0;
    for (std::uint32_t i = 0; i < view.dirtyCount; ++i)
    {
        const std::uint32_t row = view.dirty[i];
        if (m_states[row] == RowState::Awake)
            ++awakeMoves;
        else if (m_states[row] == RowState::Absent ||
                 (view.changes[row] & (kRowCreated | kRowDestroyed)) != 0 || !isValid(view.boxes[row]) ||
                 !m_skin.contains(view.boxes[row], m_core.reference[row]))
            m_changes.outside.push_back(row);
        else
            m_changes.inside.push_back(row);
    }
    return awakeMoves;
}

/// Variant for many changed rows: comparing all boxes in order, changed or not, takes less time than visiting the
/// changed ones. Created and destroyed boxes are outside of any skin.
std::uint32_t RestingMode::classifyAllBoxes(const ProxyView& view)
{
    const SkinSource source = {view.boxes, m_core.reference.data(), m_skin.thickness};
    std::array<std::uint32_t, kRestingBlock> outside;
    for (std::uint32_t begin = 0; begin < view.size; begin += kRestingBlock)
    {
        const std::uint32_t end = std::min(begin + kRestingBlock, view.size);
        const std::uint32_t count = m_core.kernels.findBoxesOutsideSkin(source, begin, end, outside.data());
        for (std::uint32_t i = 0; i < count; ++i)
        {
            const std::uint32_t row = outside[i];
            if (view.changes[row] != kRowUnchanged && m_states[row] != RowState::Awake)
                m_changes.outside.push_back(row);
        }
    }
    return static_cast<std::uint32_t>(std::count_if(m_awake.rows().begin(), m_awake.rows().end(),
                                                    [&](std::uint32_t row)
                                                    { return view.changes[row] != kRowUnchanged; }));
}

/// Updates the pairs of resting boxes.
void RestingMode::updatePairs(const ProxyView& view)
{
    // Testing all pairs in order is faster per pair than box by box.
    if (!m_changes.areFew)
    {
        m_core.stats.candidates += m_pairs.changeableCount();
        m_pairs.updateChangeable(m_core.kernels, view, m_core.reference.data(), m_core.delta.reporter(view));
        return;
    }
    for (const std::uint32_t row : m_changes.inside)
    {
        m_pairs.forEachOf(row,
                          [&](std::size_t index)
                          {
                              if (!m_pairs.isChangeable(index))
                                  return;
                              ++m_core.stats.candidates;
                              m_pairs.update(index, view, m_core.reference.data(),
                                             m_core.delta.reporter(view));
                          });
    }
}

void RestingMode::collectHeld(std::vector<RowPair>& held) const
{
    const auto keep = [&](RowPair pair) { held.push_back(pair); };
    m_pairs.forEachHeld(keep);
    m_awake.forEachHeld(keep);
}

void RestingMode::clear()
{
    m_pairs.clear();
    m_awake.clear();
}

std::uint64_t RestingMode::bytes() const
{
    return m_pairs.bytes() + m_awake.bytes() + bytesOf(m_states, m_changes.inside, m_changes.outside);
}
}  // namespace cullet
