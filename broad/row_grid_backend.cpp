// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "broad/row_grid_backend.h"

#include "broad/vector_room.h"

#include <algorithm>
#include <cmath>
#include <new>

namespace cullet
{
namespace
{
// Updates that a settled grid has to last to be worth its refill.
constexpr std::uint32_t kQuietUpdates = 4;
constexpr std::uint32_t kAnchorSample = 256;
}  // namespace

RowGridBackend::RowGridBackend(const GridOptions& options)
    : m_options(options),
      m_workers(options.threads),
      m_grid(options, m_workers),
      m_activeGrid(options, m_workers)
{
}

RowGridBackend::~RowGridBackend() = default;

void RowGridBackend::restart(const std::vector<Pair>& known)
{
    m_known = known;
    m_restarted = true;
}

Status RowGridBackend::update(const ProxyView& proxies, PairDelta& delta)
{
    delta.added.clear();
    delta.removed.clear();
    m_addedKeys.clear();
    m_removedKeys.clear();
    try
    {
        updateOrThrow(proxies);
        m_sort.write(m_addedKeys, delta.added);
        m_sort.write(m_removedKeys, delta.removed);
        trimRoom(m_addedKeys);
        trimRoom(m_removedKeys);
    }
    catch (const std::bad_alloc&)
    {
        delta.added.clear();
        delta.removed.clear();
        m_restarted = true;
        return Status::OutOfMemory;
    }
    m_stats.pairs += delta.added.size();
    m_stats.pairs -= delta.removed.size();
    return Status::Ok;
}

void RowGridBackend::updateOrThrow(const ProxyView& view)
{
    const bool filterChanged = m_hadFilter != (view.filters != nullptr);
    m_hadFilter = view.filters != nullptr;
    const bool isNewToWords = filterChanged || m_restarted;
    prepareRows(view);
    bool hasRefiltered = filterChanged;
    for (std::uint32_t i = 0; i < view.dirtyCount && !hasRefiltered; ++i)
        hasRefiltered = (view.changes[view.dirty[i]] & kRowRefiltered) != 0;

    if (m_restarted || hasRefiltered)
    {
        decide(m_restarted ? "restarted" : "filter words changed", 0, SettlePolicy::kCostOfRefill * view.size,
               0);
        rebuild(view, m_mode == Mode::Settled && !m_restarted);
    }
    else if (m_mode == Mode::Settled)
    {
        if (updateSettled(view) == SettledOutcome::Refill)
        {
            m_policy.end();
            rebuild(view, m_policy.mayBegin() || m_options.rebuildFraction >= 1.0f);
        }
    }
    else if (view.dirtyCount != 0 && shouldSettle(view))
    {
        decide("most boxes rest", 0, SettlePolicy::kCostOfSettling * view.size,
               SettlePolicy::kCostOfMoving * view.size);
        rebuild(view, true);
    }
    else
    {
        updateMoving(view);
    }
    rememberWords(view, isNewToWords || m_words.size() < view.size);
}

/// Pairs are held by the words that the last update saw.
void RowGridBackend::rememberWords(const ProxyView& view, bool all)
{
    if (view.filters == nullptr)
    {
        m_words.clear();
        return;
    }
    if (all)
    {
        m_words.assign(view.filters, view.filters + view.size);
        return;
    }
    for (std::uint32_t i = 0; i < view.dirtyCount; ++i)
    {
        const std::uint32_t row = view.dirty[i];
        if ((view.changes[row] & (kRowCreated | kRowRefiltered)) != 0)
            m_words[row] = view.filters[row];
    }
}

void RowGridBackend::prepareRows(const ProxyView& view)
{
    if (m_reference.size() < view.size)
    {
        m_reference.resize(view.size, remembered(kEmptyAabb));
        m_states.resize(view.size, RowState::Absent);
    }
    for (std::uint32_t i = 0; i < view.dirtyCount; ++i)
    {
        const std::uint32_t row = view.dirty[i];
        if ((view.changes[row] & kRowCreated) != 0)
            m_reference[row] = remembered(kEmptyAabb);
    }
}

/// Whether refilling with shells around the boxes will pay: few boxes left a shell around where they were some
/// updates ago. Told by a sample; speed alone would not do, since a resting pile jitters fast without going anywhere.
bool RowGridBackend::shouldSettle(const ProxyView& view)
{
    if (!m_options.settles || m_options.rebuildFraction == 0.0f)
        return false;
    if (m_options.rebuildFraction >= 1.0f)
        return true;
    m_policy.countMoving();
    if (!m_policy.mayBegin())
        return false;
    if (view.dirtyCount < view.size / 8)
        return true;
    const float slack = 0.5f * view.margin;
    std::uint32_t away = 0;
    for (std::size_t i = 0; i < m_anchors.size(); ++i)
    {
        const std::uint32_t row = static_cast<std::uint32_t>(i) * m_anchorStride;
        away += isInsideShell(view.boxes[row], m_anchors[i], slack) ? 0u : 1u;
    }
    ++m_anchorAge;
    const bool isQuiet = !m_anchors.empty() && away * 10 <= m_anchors.size();
    if (isQuiet)
        return m_anchorAge >= kQuietUpdates;
    m_anchorAge = 0;
    m_anchorStride = view.size / kAnchorSample + 1;
    m_anchors.clear();
    for (std::uint32_t row = 0; row < view.size; row += m_anchorStride)
        m_anchors.push_back(view.boxes[row]);
    return false;
}

void RowGridBackend::reportAdded(const ProxyView& view, IdPair pair)
{
    m_addedKeys.push_back(pairKey(makePair(view.uniqueIds[pair.a], view.uniqueIds[pair.b])));
}

void RowGridBackend::reportRemoved(const ProxyView& view, IdPair pair)
{
    m_removedKeys.push_back(pairKey(makePair(view.uniqueIds[pair.a], view.uniqueIds[pair.b])));
}

void RowGridBackend::forEachCell(const CellVisitor& visit) const
{
    m_grid.forEachCell(visit);
    if (m_mode == Mode::Settled && !m_active.empty())
        m_activeGrid.forEachCell(visit);
}

BackendStats RowGridBackend::stats() const
{
    BackendStats stats = m_stats;
    stats.candidates = m_grid.testCount();
    stats.entries = m_grid.entryCount();
    const GridPlan& plan = m_grid.plan();
    stats.levels = plan.levelCount;
    stats.decision.cellWidth = plan.width[0];
    stats.decision.planCost = plan.cost;
    stats.decision.oneLevelCost = plan.oneLevelCost;
    stats.decision.allLevelsCost = plan.allLevelsCost;
    stats.unbounded = m_grid.unbounded().size();
    stats.bytes =
        m_grid.bytes() + m_activeGrid.bytes() + m_settled.bytes() + m_separated.bytes() +
        m_reference.capacity() * sizeof(Aabb) + m_states.capacity() + m_words.capacity() * sizeof(Filter) +
        m_despite.bytes() +
        (m_apart.capacity() + m_overlapping.capacity() + m_activePairs.capacity()) * sizeof(IdPair) +
        (m_active.capacity() + m_quiet.capacity() + m_escaped.capacity()) * sizeof(std::uint32_t) +
        (m_addedKeys.capacity() + m_removedKeys.capacity() + m_foundKeys.capacity()) * sizeof(std::uint64_t);
    return stats;
}
}  // namespace cullet
