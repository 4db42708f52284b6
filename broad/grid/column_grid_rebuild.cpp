// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/column_grid_backend.h"
#include "cullet/broad/grid/columns/pair_sinks.h"
#include "cullet/broad/pairs/restart_rows.h"

#include <algorithm>

namespace cullet
{
void ColumnGridBackend::collectHeld(std::vector<RowPair>& held)
{
    if (m_mode == Mode::Moving)
    {
        if (!m_hasOverlapping)
            listOverlapping(m_overlapping);
        held = m_hysteresisPairs;
        for (const std::uint64_t key : m_overlapping)
            held.push_back(rowsOf(key));
        return;
    }
    m_restingPairs.forEachHeld([&](RowPair pair) { held.push_back(pair); });
    m_awakePairs.forEachHeld([&](RowPair pair) { held.push_back(pair); });
    for (const NeighbourPart& part : m_parts)
        part.pairs.forEachHeld([&](RowPair pair) { held.push_back(pair); });
}

Pairs ColumnGridBackend::heldPairs(const ProxyView& view)
{
    if (m_restarted)
        return m_known;
    std::vector<RowPair> held;
    collectHeld(held);
    Pairs pairs;
    pairs.reserve(held.size());
    for (const RowPair pair : held)
        pairs.push_back(makePair(view.uniqueIds[pair.a], view.uniqueIds[pair.b]));
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

/// Turns the pairs given to restart() into rows; pairs of destroyed proxies are removed at once.
void ColumnGridBackend::collectKnown(const ProxyView& view, std::vector<RowPair>& held)
{
    std::vector<std::uint64_t> gone;
    splitKnown(m_known, view, held, gone);
    for (const std::uint64_t key : gone)
        m_removed[0].push(key);
    m_stats.pairs = m_known.size();
    m_known.clear();
    m_known.shrink_to_fit();
}

void ColumnGridBackend::sortOldPairs(const std::vector<RowPair>& pairs)
{
    for (KeyList& list : m_found)
        list.clear();
    m_found[0].makeRoom(pairs.size());
    for (const RowPair pair : pairs)
        m_found[0].pushIf(PairSet::keyOf(pair.a, pair.b), true);
    m_sorts[0].sort(m_workers, m_found, m_oldKeys);
    m_found[0].clear();
    m_found[0].trim();
    m_oldPairs.take(m_oldKeys);
}

void ColumnGridBackend::rebuild(const ProxyView& view, bool settle)
{
    m_workers.limit((settle ? ModePolicy::kCostOfRestingRefill : ModePolicy::kCostOfRefill) * view.size);
    std::vector<RowPair> held;
    if (m_restarted)
        collectKnown(view, held);
    else
        collectHeld(held);
    m_restarted = false;
    m_overlapping.clear();
    m_hasOverlapping = false;
    m_isOverlappingSorted = false;
    m_hasTeleported = false;
    m_isReferenceOld = false;
    m_filterExempt.reset(0);
    m_hysteresisPairs.clear();
    m_awakePairs.clear();
    m_awakePairsBoxes.clear();
    m_awake.clear();
    m_lists.clear();
    m_parts.resize(1);
    m_parts[0].clear();
    m_orderedCount = 0;
    m_awakePairsSkin = 0;
    m_restingPairs.clear();
    std::transform(view.boxes, view.boxes + view.size, m_reference.begin(), nanIfEmpty);
    if (settle)
        rebuildResting(view, held);
    else
        rebuildMoving(view, held);
    ++m_stats.rebuildsTotal;
}

void ColumnGridBackend::rebuildMoving(const ProxyView& view, const std::vector<RowPair>& held)
{
    m_mode = Mode::Moving;
    m_stats.path = "rebuild";
    sortOldPairs(held);

    CollectingSink sink(m_workers.threads());
    GridInput input;
    input.boxes = view.boxes;
    input.count = view.size;
    m_grid.scan(input, sink, ColumnUse::Follow);
    m_scannedRows = view.size;
    sink.forEach(
        [&](RowPair pair)
        {
            const std::uint64_t key = PairSet::keyOf(pair.a, pair.b);
            const bool passes = mayEnter(view, pair);
            const bool wasHeld = m_oldPairs.contains(key);
            if (wasHeld && !passes)
                m_filterExempt.insert(key);
            if (!wasHeld && passes)
                reportAdded(view, pair);
        });
    for (const RowPair pair : held)
    {
        const Aabb& a = view.boxes[pair.a];
        const Aabb& b = view.boxes[pair.b];
        const bool valid = isValid(a) && isValid(b);
        if (valid && overlaps(a, b))
            continue;
        if (!valid || !overlapsWithMargin(a, b, view.margin))
        {
            reportRemoved(view, pair);
            continue;
        }
        m_hysteresisPairs.push_back(pair);
    }
}

void ColumnGridBackend::rebuildResting(const ProxyView& view, const std::vector<RowPair>& held)
{
    m_mode = Mode::Resting;
    m_stats.path = "settle";
    m_skin = 0.5f * view.margin;
    m_restingMargin = view.margin;
    m_persistentGap = persistentGapOf(view.margin, m_skin);
    m_policy.begin(view.size);
    m_wasted = 0;
    for (std::uint32_t row = 0; row < view.size; ++row)
        m_states[row] = isValid(view.boxes[row]) ? RowState::Resting : RowState::Absent;
    CollectingSink sink(m_workers.threads());
    GridInput input;
    input.boxes = view.boxes;
    input.count = view.size;
    input.grow = kGrowFactor * m_skin;
    m_grid.scan(input, sink, ColumnUse::Query);
    classifyPairs(view, sink, held, m_restingPairs);
    m_restingPairs.finish(view.size);
}

/// Classifies pairs by their current boxes.
///
/// @param candidates all pairs that may come to overlap
/// @param held       held pairs so far; those that are no candidates are hysteresis pairs with a gap beyond the skins
/// @param pairs      [out] all pairs that may change or are held; persistent ones only of resting boxes
void ColumnGridBackend::classifyPairs(const ProxyView& view, const CollectingSink& candidates,
                                      const std::vector<RowPair>& held, VerletPairs& pairs)
{
    sortOldPairs(held);
    std::vector<std::pair<RowPair, VerletPairs::State>> changeable;
    candidates.forEach(
        [&](RowPair pair)
        {
            const std::uint64_t key = PairSet::keyOf(pair.a, pair.b);
            const bool wasHeld = m_oldPairs.erase(key);
            const bool passes = mayEnter(view, pair);
            if (!passes && !wasHeld)
                return;
            const Aabb& a = view.boxes[pair.a];
            const Aabb& b = view.boxes[pair.b];
            const bool isHeld = overlaps(a, b) || (wasHeld && overlapsWithMargin(a, b, view.margin));
            if (isHeld && isPersistent(pairs, a, b))
                pairs.add(pair, VerletPairs::State::Persistent);
            else
                changeable.push_back(
                    {pair, isHeld ? VerletPairs::State::Overlapping : VerletPairs::State::Candidate});
            if (isHeld && !wasHeld)
                reportAdded(view, pair);
            if (!isHeld && wasHeld)
                reportRemoved(view, pair);
        });
    m_oldPairs.forEach(
        [&](std::uint64_t key)
        {
            const RowPair pair = rowsOf(key);
            const bool valid = isValid(view.boxes[pair.a]) && isValid(view.boxes[pair.b]);
            if (valid && overlapsWithMargin(view.boxes[pair.a], view.boxes[pair.b], view.margin))
                changeable.push_back({pair, VerletPairs::State::Overlapping});
            else
                reportRemoved(view, pair);
        });
    for (const auto& [pair, state] : changeable)
        pairs.add(pair, state);
}
}  // namespace cullet
