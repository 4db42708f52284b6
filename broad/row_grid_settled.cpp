// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "broad/row_grid_backend.h"
#include "broad/row_grid_sinks.h"

#include <cmath>

namespace cullet
{
namespace
{
// Share of active boxes from which a refill of everything is cheaper than queries of the active ones.
constexpr double kActiveShare = 0.22;
constexpr std::size_t kQueryGrain = 1024;
}  // namespace

RowGridBackend::SettledOutcome RowGridBackend::updateSettled(const ProxyView& view)
{
    // What is sure was judged by the margin.
    const double moving = SettlePolicy::kCostOfMoving * view.size;
    const double settling = SettlePolicy::kCostOfSettling * view.size;
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
    const double watching = SettlePolicy::costOfPhase(active, m_quiet.size());
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
    m_policy.count(active, m_quiet.size());
    for (const std::uint32_t row : m_escaped)
        activate(row);
    m_stats.path = m_active.empty() ? "watch" : "incremental";
    updateWatched(view);
    if (!m_active.empty())
        updateActive(view);
    return SettledOutcome::Done;
}

/// Sorts the changed rows into those inside their shell and those that must become active.
void RowGridBackend::findEscaped(const ProxyView& view)
{
    m_quiet.clear();
    m_escaped.clear();
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
    m_wasted += SettlePolicy::kCostOfActive * static_cast<double>(m_active.size() - activeMoves);
}

void RowGridBackend::activate(std::uint32_t row)
{
    m_settled.forEachOf(row,
                        [&](std::size_t index)
                        {
                            if (m_settled.state(index) != SettledPairs::State::Open)
                                m_activePairs.push_back(m_settled.pair(index));
                            m_settled.setState(index, SettledPairs::State::Gone);
                        });
    m_states[row] = RowState::Active;
    m_active.push_back(row);
}

void RowGridBackend::updateWatchedPair(const ProxyView& view, std::size_t index)
{
    const SettledPairs::State state = m_settled.state(index);
    if (state != SettledPairs::State::Open && state != SettledPairs::State::Held)
        return;
    const IdPair pair = m_settled.pair(index);
    const Aabb& a = view.boxes[pair.a];
    const Aabb& b = view.boxes[pair.b];
    const bool overlap = overlapsBranchless(a, b);
    // An open pair may be one that was held although its filter words had come to reject it: hence the question.
    if (state == SettledPairs::State::Open && overlap && mayEnter(view, pair))
    {
        const bool isSure = gapOf(m_reference[pair.a], m_reference[pair.b]) <= m_sureGap;
        m_settled.setState(index, isSure ? SettledPairs::State::Sure : SettledPairs::State::Held);
        reportAdded(view, pair);
    }
    else if (state == SettledPairs::State::Held && !overlap && !overlapsWithMargin(a, b, view.margin))
    {
        m_settled.setState(index, SettledPairs::State::Open);
        reportRemoved(view, pair);
    }
}

void RowGridBackend::updateWatched(const ProxyView& view)
{
    // All in a row is faster per pair than box by box.
    if (m_quiet.size() * 4 > view.size)
    {
        for (std::size_t i = m_settled.firstWatched(); i < m_settled.size(); ++i)
            updateWatchedPair(view, i);
        return;
    }
    for (const std::uint32_t row : m_quiet)
        m_settled.forEachOf(row, [&](std::size_t index) { updateWatchedPair(view, index); });
}

void RowGridBackend::findPairsWithSettled(const ProxyView& view, std::vector<IdPair>& found)
{
    CollectingSink sink(m_workers.threads());
    const unsigned tasks = m_workers.tasksFor(m_active.size(), kQueryGrain);
    m_workers.run(tasks,
                  [&](unsigned task)
                  {
                      const unsigned worker =
                          tasks == 1 ? 0u
                                     : static_cast<unsigned>(tbb::this_task_arena::current_thread_index());
                      const TaskRange range(m_active.size(), task, tasks);
                      for (std::uint32_t i = range.begin; i < range.end; ++i)
                      {
                          const std::uint32_t row = m_active[i];
                          if (isValid(view.boxes[row]))
                              m_grid.query(view.boxes[row], row, worker, sink);
                      }
                  });
    sink.forEach(
        [&](IdPair pair)
        {
            if (m_states[pair.b] == RowState::Settled && overlaps(view.boxes[pair.a], view.boxes[pair.b]))
                found.push_back(pair);
        });
    for (const std::uint32_t large : m_grid.unbounded())
    {
        if (m_states[large] != RowState::Settled)
            continue;
        for (const std::uint32_t row : m_active)
        {
            if (isValid(view.boxes[row]) && overlaps(view.boxes[row], view.boxes[large]))
                found.push_back({row, large});
        }
    }
}

void RowGridBackend::findActivePairs(const ProxyView& view, std::vector<IdPair>& found)
{
    CollectingSink sink(m_workers.threads());
    GridInput input;
    input.boxes = view.boxes;
    input.ids = m_active.data();
    input.count = static_cast<std::uint32_t>(m_active.size());
    m_activeGrid.scan(input, sink, RowUse::Once);
    sink.forEach([&](IdPair pair) { found.push_back(pair); });
    findPairsWithSettled(view, found);
}

void RowGridBackend::updateActive(const ProxyView& view)
{
    std::vector<IdPair> found;
    findActivePairs(view, found);
    PairSet old;
    old.reset(m_activePairs.size());
    for (const IdPair pair : m_activePairs)
        old.insert(PairSet::keyOf(pair.a, pair.b));

    std::vector<IdPair> next;
    next.reserve(found.size());
    for (const IdPair pair : found)
    {
        const bool wasHeld = old.erase(PairSet::keyOf(pair.a, pair.b));
        if (!wasHeld && !mayEnter(view, pair))
            continue;
        if (!wasHeld)
            reportAdded(view, pair);
        next.push_back(pair);
    }
    for (const IdPair pair : m_activePairs)
    {
        if (!old.contains(PairSet::keyOf(pair.a, pair.b)))
            continue;
        const bool valid = isValid(view.boxes[pair.a]) && isValid(view.boxes[pair.b]);
        if (valid && overlapsWithMargin(view.boxes[pair.a], view.boxes[pair.b], view.margin))
            next.push_back(pair);
        else
            reportRemoved(view, pair);
    }
    m_activePairs.swap(next);
}
}  // namespace cullet
