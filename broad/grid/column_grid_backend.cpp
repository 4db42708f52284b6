// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/column_grid_backend.h"

#include "cullet/base/bytes_of.h"
#include "cullet/broad/pairs/restart_rows.h"

#include <algorithm>
#include <new>

namespace cullet
{
namespace
{
/// Union of the RowChange bits of all rows.
std::uint8_t changesOf(const ProxyView& view)
{
    std::uint8_t changes = 0;
    // Unchanged rows have no bits, and reading all rows in order is faster than reading many single ones.
    if (view.dirtyCount > view.size / 8)
    {
        for (std::uint32_t row = 0; row < view.size; ++row)
            changes = static_cast<std::uint8_t>(changes | view.changes[row]);
        return changes;
    }
    for (std::uint32_t i = 0; i < view.dirtyCount; ++i)
        changes = static_cast<std::uint8_t>(changes | view.changes[view.dirty[i]]);
    return changes;
}
}  // namespace

ColumnGridBackend::ColumnGridBackend(const GridOptions& options)
    : m_core(options), m_choice(options), m_sweep(m_core), m_resting(m_core, m_choice.policy())
{
}

void ColumnGridBackend::restart(const Pairs& known)
{
    m_known = known;
    m_mode = Mode::Restarted;
}

Status ColumnGridBackend::update(const ProxyView& proxies, PairDelta& delta)
{
    m_core.delta.clear();
    m_core.stats.candidates = 0;
    try
    {
        const auto work = [&]
        {
            updateOrThrow(proxies);
            m_core.delta.write(delta);
        };
        // An upper bound; the path that is taken sets its own limit.
        const double most = proxies.dirtyCount == 0 ? 0.0 : ModePolicy::kCostOfRestingRefill * proxies.size;
        m_core.workers.runRegion(most, work);
        countWork();
    }
    catch (const std::bad_alloc&)
    {
        delta.clear();
        m_mode = Mode::Restarted;
        return Status::OutOfMemory;
    }
    m_core.stats.pairs += delta.added.size();
    m_core.stats.pairs -= delta.removed.size();
    return Status::Ok;
}

void ColumnGridBackend::countWork()
{
    const ColumnGrid::Work all = m_core.grid.collectWork();
    const ColumnGrid::Work awake = m_resting.collectWork();
    m_core.stats.candidates += all.tests + awake.tests;
    m_core.stats.cellsVisited = all.visits;
}

void ColumnGridBackend::updateOrThrow(const ProxyView& view)
{
    const bool filterChanged = m_hadFilter != (view.filters != nullptr);
    m_hadFilter = view.filters != nullptr;
    const bool areFilterWordsNew = filterChanged || m_mode == Mode::Restarted;
    const std::uint8_t changes = changesOf(view);
    prepareRows(view, changes);

    if (m_mode == Mode::Restarted || filterChanged || (changes & kRowRefiltered) != 0)
    {
        m_core.recordDecision(m_mode == Mode::Restarted ? "restarted" : "filter words changed", 0,
                              ModePolicy::kCostOfRefill * view.size, 0);
        refill(view, m_mode == Mode::Resting);
    }
    else if (m_mode == Mode::Resting)
    {
        if (m_resting.update(view) == RestingMode::Outcome::Refill)
            refill(view, m_choice.endResting());
    }
    else if (view.dirtyCount != 0 && m_choice.shouldBeginResting(view))
    {
        m_core.recordDecision("most boxes rest", 0, ModePolicy::kCostOfRestingRefill * view.size,
                              ModePolicy::kCostOfMoving * view.size);
        refill(view, true);
    }
    else
    {
        m_sweep.update(view);
    }
    m_sweep.rememberFilterWords(view, areFilterWordsNew);
}

/// Gives every row a reference box. After restart() the rows are those of any table, also of a smaller one that grows
/// later. State that refill() makes anew is not cleared here.
void ColumnGridBackend::prepareRows(const ProxyView& view, std::uint8_t changes)
{
    HugeVector<Aabb>& reference = m_core.reference;
    if (m_mode == Mode::Restarted)
    {
        reference.clear();
        m_sweep.forgetRows();
        m_resting.forgetRows();
        m_choice.forgetRows();
    }
    if (reference.size() < view.size)
    {
        // The size that is compared grows last: either may throw.
        m_resting.growRows(view.size);
        reference.resize(view.size, nanIfEmpty(kEmptyAabb));
    }
    for (std::uint32_t i = 0; i < view.dirtyCount && (changes & kRowCreated) != 0; ++i)
    {
        const std::uint32_t row = view.dirty[i];
        if ((view.changes[row] & kRowCreated) != 0)
            reference[row] = nanIfEmpty(kEmptyAabb);
    }
}

/// Refills the columns from any state, with a list of the held pairs.
void ColumnGridBackend::refill(const ProxyView& view, bool rests)
{
    m_core.workers.limit((rests ? ModePolicy::kCostOfRestingRefill : ModePolicy::kCostOfRefill) * view.size);
    std::vector<RowPair> held;
    if (m_mode == Mode::Restarted)
        collectKnown(view, held);
    else
        collectHeld(held);
    m_sweep.clear();
    m_resting.clear();
    std::transform(view.boxes, view.boxes + view.size, m_core.reference.begin(), nanIfEmpty);
    m_mode = rests ? Mode::Resting : Mode::Sweep;
    if (rests)
        m_resting.begin(view, held);
    else
    {
        m_resting.trim();
        m_sweep.begin(view, held);
    }
    m_core.freeHeldBefore();
    ++m_core.stats.rebuildsTotal;
}

void ColumnGridBackend::collectHeld(std::vector<RowPair>& held)
{
    if (m_mode == Mode::Sweep)
        m_sweep.collectHeld(held);
    else
        m_resting.collectHeld(held);
}

/// Turns the pairs given to restart() into rows; pairs of destroyed proxies are removed at once.
void ColumnGridBackend::collectKnown(const ProxyView& view, std::vector<RowPair>& held)
{
    std::vector<std::uint64_t> gone;
    splitKnown(m_known, view, held, gone);
    for (const std::uint64_t key : gone)
        m_core.delta.removed(0).push(key);
    m_core.stats.pairs = m_known.size();
    m_known.clear();
    m_known.shrink_to_fit();
}

Pairs ColumnGridBackend::heldPairs(const ProxyView& view)
{
    if (m_mode == Mode::Restarted)
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

void ColumnGridBackend::forEachCell(const CellVisitor& visit) const
{
    m_core.grid.forEachCell(visit);
    if (m_mode == Mode::Resting && !m_resting.awake().rows().empty())
        m_resting.awake().forEachCell(visit);
}

/// Whether the columns have all rows, but for a few awake ones.
bool ColumnGridBackend::knowsPlaces() const
{
    constexpr std::size_t kFewAwake = 256;
    return m_mode == Mode::Sweep || (m_mode == Mode::Resting && m_resting.awake().rows().size() <= kFewAwake);
}

/// Hands the awake rows that have boxes to the sink.
void ColumnGridBackend::takeAwake(const Aabb* boxes, RowSink& sink) const
{
    if (m_mode != Mode::Resting)
        return;
    for (const std::uint32_t row : m_resting.awake().rows())
    {
        if (isValid(boxes[row]))
            sink.take(&row, 1);
    }
}

std::uint32_t ColumnGridBackend::findNearRay(const RayPath& ray, const Aabb* boxes, RowSink& sink) const
{
    const std::uint32_t cost = knowsPlaces() ? m_core.grid.findNearRay(ray, boxes, sink) : 0;
    if (cost != 0)
        takeAwake(boxes, sink);
    return cost;
}

std::uint32_t ColumnGridBackend::findNearBox(const Aabb& box, const Aabb* boxes, RowSink& sink) const
{
    const std::uint32_t cost = knowsPlaces() ? m_core.grid.findNearBox(box, boxes, sink) : 0;
    if (cost != 0)
        takeAwake(boxes, sink);
    return cost;
}

BackendStats ColumnGridBackend::stats() const
{
    BackendStats stats = m_core.stats;
    stats.entries = m_core.grid.entryCount();
    const GridPlan& plan = m_core.grid.plan();
    stats.levels = plan.levelCount;
    stats.decision.cellWidth = plan.width[0];
    stats.decision.planCost = plan.cost;
    stats.decision.oneLevelCost = plan.oneLevelCost;
    stats.decision.allLevelsCost = plan.allLevelsCost;
    stats.unbounded = m_core.grid.unbounded().size();
    stats.bytes = m_core.bytes() + m_choice.bytes() + m_sweep.bytes() + m_resting.bytes() + bytesOf(m_known);
    return stats;
}
}  // namespace cullet
