// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/column_grid_backend.h"

#include "cullet/base/bytes_of.h"

#include <algorithm>
#include <cmath>
#include <new>

namespace cullet
{
namespace
{
// Calm updates before resting mode begins: it has to last to be worth its refill.
constexpr std::uint32_t kCalmUpdates = 4;
constexpr std::uint32_t kAnchorSample = 256;
// One box in so many may begin to move in an update. More of them would fill the resting mode with awake boxes before
// it has paid for its refill.
constexpr std::uint32_t kFreshShare = 64;
constexpr std::size_t kFewChanges = 65536;  // added and removed pairs
constexpr std::size_t kVeryFewChanges = 1024;

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
    : m_options(options),
      m_kernels(chooseColumnKernels(options.baselineSimd)),
      m_workers(options.threads),
      m_serialLoops(1),
      m_grid(options, m_workers),
      m_awakeGrid(options, m_workers),
      m_found(m_workers.threads()),
      m_threadDeltas(m_workers.threads()),
      m_added(m_workers.threads()),
      m_removed(m_workers.threads())
{
}

ColumnGridBackend::~ColumnGridBackend() = default;

void ColumnGridBackend::restart(const Pairs& known)
{
    m_known = known;
    m_restarted = true;
}

Status ColumnGridBackend::update(const ProxyView& proxies, PairDelta& delta)
{
    for (unsigned worker = 0; worker < m_workers.threads(); ++worker)
    {
        m_added[worker].clear();
        m_removed[worker].clear();
    }
    m_stats.candidates = 0;
    try
    {
        const auto work = [&]
        {
            updateOrThrow(proxies);
            writeChanges(delta);
        };
        // An upper bound; the path that is taken sets its own limit.
        const double most = proxies.dirtyCount == 0 ? 0.0 : ModePolicy::kCostOfRestingRefill * proxies.size;
        m_workers.runRegion(most, work);
        countWork();
    }
    catch (const std::bad_alloc&)
    {
        delta.clear();
        m_restarted = true;
        return Status::OutOfMemory;
    }
    m_stats.pairs += delta.added.size();
    m_stats.pairs -= delta.removed.size();
    return Status::Ok;
}

void ColumnGridBackend::countWork()
{
    const ColumnGrid::Work all = m_grid.collectWork();
    const ColumnGrid::Work awake = m_awakeGrid.collectWork();
    m_stats.candidates += all.tests + awake.tests;
    m_stats.cellsVisited = all.visits;
}

/// Where there are few changes or threads, one thread sorts the added pairs and another one the removed pairs.
void ColumnGridBackend::writeChanges(PairDelta& delta)
{
    std::size_t count = 0;
    for (unsigned worker = 0; worker < m_workers.threads(); ++worker)
        count += m_added[worker].size() + m_removed[worker].size();
    const bool isShared = m_workers.threads() > 2 && count > kFewChanges;
    ParallelLoops& pool = isShared ? m_workers : m_serialLoops;
    const unsigned tasks = isShared || m_workers.threads() == 1 || count < kVeryFewChanges ? 1u : 2u;
    m_workers.run(tasks,
                  [&](unsigned task)
                  {
                      if (task == 0)
                          m_sorts[0].write(pool, m_added, delta.added);
                      if (task == tasks - 1)
                          m_sorts[1].write(pool, m_removed, delta.removed);
                  });
    for (unsigned worker = 0; worker < m_workers.threads(); ++worker)
    {
        m_added[worker].trim();
        m_removed[worker].trim();
    }
}

void ColumnGridBackend::updateOrThrow(const ProxyView& view)
{
    const bool filterChanged = m_hadFilter != (view.filters != nullptr);
    m_hadFilter = view.filters != nullptr;
    const bool areFilterWordsNew = filterChanged || m_restarted;
    const std::uint8_t changes = changesOf(view);
    if (m_restarted)
        forgetRows();
    prepareRows(view, (changes & kRowCreated) != 0);
    const bool hasRefiltered = filterChanged || (changes & kRowRefiltered) != 0;

    if (m_restarted || hasRefiltered)
    {
        recordDecision(m_restarted ? "restarted" : "filter words changed", 0,
                       ModePolicy::kCostOfRefill * view.size, 0);
        rebuild(view, m_mode == Mode::Resting && !m_restarted);
    }
    else if (m_mode == Mode::Resting)
    {
        if (updateResting(view) == RestingOutcome::Refill)
        {
            m_policy.end();
            rebuild(view, m_policy.mayBegin() || m_options.rebuildFraction >= 1.0f);
        }
    }
    else if (view.dirtyCount != 0 && shouldBeginResting(view))
    {
        recordDecision("most boxes rest", 0, ModePolicy::kCostOfRestingRefill * view.size,
                       ModePolicy::kCostOfMoving * view.size);
        rebuild(view, true);
    }
    else
    {
        updateMoving(view);
    }
    rememberFilterWords(view, areFilterWordsNew || m_filterWords.size() < view.size);
}

/// Stores the filter words of this update, which listOverlapping() needs in a later one.
void ColumnGridBackend::rememberFilterWords(const ProxyView& view, bool all)
{
    if (view.filters == nullptr)
    {
        m_filterWords.clear();
        return;
    }
    if (all)
    {
        m_filterWords.assign(view.filters, view.filters + view.size);
        return;
    }
    for (std::uint32_t i = 0; i < view.dirtyCount; ++i)
    {
        const std::uint32_t row = view.dirty[i];
        if ((view.changes[row] & (kRowCreated | kRowRefiltered)) != 0)
            m_filterWords[row] = view.filters[row];
    }
}

/// Clears the state by row: after restart() the rows are those of any table, also of a smaller one that grows later.
/// State that rebuild() makes anew is not cleared here.
void ColumnGridBackend::forgetRows()
{
    m_reference.clear();
    m_states.clear();
    m_filterWords.clear();
    m_moverStamps.clear();
    m_anchors.clear();
    m_areMotionsUneven = false;
    m_boundOctave = kLeastBoundOctave;
    m_calmUpdates = 0;
}

void ColumnGridBackend::prepareRows(const ProxyView& view, bool hasCreated)
{
    if (m_reference.size() < view.size)
    {
        // The size that is compared grows last: either may throw.
        m_states.resize(view.size, RowState::Absent);
        m_reference.resize(view.size, nanIfEmpty(kEmptyAabb));
    }
    for (std::uint32_t i = 0; i < view.dirtyCount && hasCreated; ++i)
    {
        const std::uint32_t row = view.dirty[i];
        if ((view.changes[row] & kRowCreated) != 0)
            m_reference[row] = nanIfEmpty(kEmptyAabb);
    }
}

/// Whether a refill with skins around the boxes will pay: in a sample, few boxes left a skin around where they were
/// some updates ago. Speed is no criterion, since a resting pile jitters fast without going anywhere.
bool ColumnGridBackend::shouldBeginResting(const ProxyView& view)
{
    if (!m_options.settles || m_options.rebuildFraction == 0.0f)
        return false;
    if (m_options.rebuildFraction >= 1.0f)
        return true;
    m_policy.countMoving();
    if (!m_policy.mayBegin())
        return false;
    if (view.dirtyCount < view.size / 8)
        return countFreshMovers(view) <= view.size / kFreshShare;
    const float skin = 0.5f * view.margin;
    std::uint32_t away = 0;
    for (std::size_t i = 0; i < m_anchors.size(); ++i)
    {
        const std::uint32_t row = static_cast<std::uint32_t>(i) * m_anchorStride;
        away += isInsideSkin(view.boxes[row], m_anchors[i], skin) ? 0u : 1u;
    }
    ++m_anchorAge;
    const bool isCalm = !m_anchors.empty() && away * 10 <= m_anchors.size();
    if (isCalm)
        return m_anchorAge >= kCalmUpdates;
    m_anchorAge = 0;
    m_anchorStride = view.size / kAnchorSample + 1;
    m_anchors.clear();
    for (std::uint32_t row = 0; row < view.size; row += m_anchorStride)
        m_anchors.push_back(view.boxes[row]);
    return false;
}

/// Number of rows that changed, and had not changed in the last count.
std::uint32_t ColumnGridBackend::countFreshMovers(const ProxyView& view)
{
    m_moverStamps.resize(std::max<std::size_t>(m_moverStamps.size(), view.size), 0);
    const std::uint32_t before = m_moverStamp++;
    std::uint32_t fresh = 0;
    for (std::uint32_t i = 0; i < view.dirtyCount; ++i)
    {
        std::uint32_t& stamp = m_moverStamps[view.dirty[i]];
        fresh += stamp != before ? 1u : 0u;
        stamp = m_moverStamp;
    }
    return fresh;
}

void ColumnGridBackend::forEachCell(const CellVisitor& visit) const
{
    m_grid.forEachCell(visit);
    if (m_mode == Mode::Resting && !m_awake.empty())
        m_awakeGrid.forEachCell(visit);
}

/// Whether the columns have all rows, but for a few awake ones.
bool ColumnGridBackend::knowsPlaces() const
{
    constexpr std::size_t kFewAwake = 256;
    return !m_restarted && (m_mode == Mode::Moving || m_awake.size() <= kFewAwake);
}

/// Hands the awake rows that have boxes to the sink.
void ColumnGridBackend::takeAwake(const Aabb* boxes, RowSink& sink) const
{
    if (m_mode != Mode::Resting)
        return;
    for (const std::uint32_t row : m_awake)
    {
        if (isValid(boxes[row]))
            sink.take(&row, 1);
    }
}

std::uint32_t ColumnGridBackend::findNearRay(const RayPath& ray, const Aabb* boxes, RowSink& sink) const
{
    const std::uint32_t cost = knowsPlaces() ? m_grid.findNearRay(ray, boxes, sink) : 0;
    if (cost != 0)
        takeAwake(boxes, sink);
    return cost;
}

std::uint32_t ColumnGridBackend::findNearBox(const Aabb& box, const Aabb* boxes, RowSink& sink) const
{
    const std::uint32_t cost = knowsPlaces() ? m_grid.findNearBox(box, boxes, sink) : 0;
    if (cost != 0)
        takeAwake(boxes, sink);
    return cost;
}

BackendStats ColumnGridBackend::stats() const
{
    BackendStats stats = m_stats;
    stats.entries = m_grid.entryCount();
    const GridPlan& plan = m_grid.plan();
    stats.levels = plan.levelCount;
    stats.decision.cellWidth = plan.width[0];
    stats.decision.planCost = plan.cost;
    stats.decision.oneLevelCost = plan.oneLevelCost;
    stats.decision.allLevelsCost = plan.allLevelsCost;
    stats.unbounded = m_grid.unbounded().size();
    stats.bytes = bytes();
    return stats;
}

std::uint64_t ColumnGridBackend::bytes() const
{
    std::uint64_t sum = m_grid.bytes() + m_awakeGrid.bytes() + m_restingPairs.bytes() + m_sorts[0].bytes() +
                        m_sorts[1].bytes() + m_filterExempt.bytes() + m_oldPairs.bytes() +
                        m_awakePairs.bytes();
    sum += bytesOf(m_known, m_reference, m_states, m_filterWords, m_hysteresisPairs, m_overlapping,
                   m_nextOverlapping, m_motion.migrated, m_motions, m_awake, m_lists, m_parts,
                   m_awakePairsBoxes, m_oldKeys, m_insideSkin, m_outsideSkin, m_anchors, m_moverStamps,
                   m_found, m_added, m_removed, m_threadDeltas);
    for (const NeighbourPart& part : m_parts)
        sum += part.bytes();
    for (const std::vector<KeyList>* lists : {&m_found, &m_added, &m_removed})
    {
        for (const KeyList& list : *lists)
            sum += list.bytes();
    }
    for (const ThreadDelta& delta : m_threadDeltas)
        sum += delta.held.bytes() +
               bytesOf(delta.hysteresis, delta.newlyExempt, delta.noLongerExempt, delta.kept);
    return sum;
}
}  // namespace cullet
