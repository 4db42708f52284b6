// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/column_grid_backend.h"
#include "cullet/broad/grid/columns/motion_histogram.h"
#include "cullet/broad/grid/columns/pair_sinks.h"

#include <algorithm>

namespace cullet
{
namespace
{
// Gaps and motions are rounded differences; the factors cover the roundings many times over. A pair that overlapped
// before its boxes moved by d each has a gap of at most 2 d, and shares a cell when both boxes are enlarged by d.
constexpr float kGapFactor = 2.0625f;
constexpr float kCellSkinFactor = 1.0625f;
// Mean motion as a share of the largest, below which each box has a motion bound of its own.
constexpr double kUneven = 0.375;
// Where more than one box in so many teleported, all pairs are found anew.
constexpr std::uint32_t kMostTeleportedShare = 2;
constexpr std::uint32_t kTeleportSample = 256;
constexpr std::size_t kCopyGrain = 16384;
// The boxes of pairs are prefetched so many iterations early.
constexpr std::uint32_t kPrefetch = 32;
constexpr std::size_t kPairGrain = 2048;

std::uint32_t sampleStride(std::uint32_t rows)
{
    return rows / kTeleportSample + 1;
}

void prefetch(const Aabb* boxes, RowPair pair)
{
    prefetchBox(boxes + pair.a);
    prefetchBox(boxes + pair.b);
}
}  // namespace

/// Finds the pairs that begin or cease to overlap among those that the grid reports, in the threads of the grid.
///
/// The previous and the current boxes are compared: no list of all pairs is kept, unless some boxes teleport.
class ColumnGridBackend::MovingSink final : public PairSink
{
public:
    MovingSink(ColumnGridBackend& backend, const ProxyView& view, bool isListing)
        : m_backend(backend), m_view(view), m_isListing(isListing)
    {
    }

    void take(unsigned worker, const PairBuffer& found) override
    {
        const Aabb* const before = m_backend.m_reference.data();
        if (m_isListing)
            m_backend.m_threadDeltas[worker].held.makeRoom(found.count);
        for (std::uint32_t i = 0; i < found.count; ++i)
        {
            prefetch(before, found.pair(std::min(i + kPrefetch, found.count - 1)));
            const RowPair pair = found.pair(i);
            const bool overlapped = overlapsBranchless(before[pair.a], before[pair.b]);
            const bool overlaps = found.gap[i] <= 0.0f;
            if (m_isListing)
                list(m_backend.m_threadDeltas[worker].held, pair);
            if (overlapped != overlaps)
                examine(worker, pair, found.gap[i]);
        }
    }

private:
    // examineHysteresisPairs() has recorded the exempt pairs that overlap again.
    bool isHeld(RowPair pair) const
    {
        return mayEnter(m_view, pair) || m_backend.m_filterExempt.contains(PairSet::keyOf(pair.a, pair.b));
    }

    void list(KeyList& held, RowPair pair) const
    {
        held.pushIf(PairSet::keyOf(pair.a, pair.b), isHeld(pair));
    }

    void examine(unsigned worker, RowPair pair, float gap)
    {
        if (gap > 0.0f)
        {
            if (isHeld(pair))
                m_backend.separatePair(m_view, pair, gap <= 2.0f * m_view.margin, worker);
        }
        else if (mayEnter(m_view, pair))
        {
            m_backend.m_added[worker].push(idsOf(m_view, pair));
        }
    }

    ColumnGridBackend& m_backend;
    const ProxyView& m_view;
    const bool m_isListing;
};

/// Lists the held pairs that overlapped in the last update, by the boxes and filter words of that update.
void ColumnGridBackend::listOverlapping(std::vector<std::uint64_t>& held)
{
    held.clear();
    CollectingSink sink(m_workers.threads());
    GridInput input;
    input.boxes = m_reference.data();
    input.count = m_scannedRows;
    m_grid.scanAgain(input, sink);
    sink.forEach(
        [&](RowPair pair)
        {
            const std::uint64_t key = PairSet::keyOf(pair.a, pair.b);
            if (m_filterWords.empty() || passesFilter(m_filterWords[pair.a], m_filterWords[pair.b]) ||
                m_filterExempt.contains(key))
                held.push_back(key);
        });
}

/// @param mayFollow whether m_motion has all boxes that migrated to other cells
/// @return whether the grid was refilled
bool ColumnGridBackend::scanMoving(const ProxyView& view, bool isListing, bool mayFollow, PairSink& sink)
{
    GridInput input;
    input.boxes = view.boxes;
    input.count = view.size;
    input.cellSkin = kCellSkinFactor * motionBoundOf(m_boundOctave);
    if (!isListing)
    {
        // The boxes may have been compared with a smaller motion bound than the one chosen now.
        const bool isSame = m_comparedOctave == m_boundOctave;
        input.maxGap = kGapFactor * (isSame ? m_motion.largest : motionBoundOf(m_boundOctave));
        input.minGap = -input.maxGap;
        input.motions = m_areMotionsUneven ? m_motions.data() : nullptr;
        input.motionFactor = 0.5f * kGapFactor;
    }
    m_scannedRows = view.size;
    if (mayFollow && follow(view, input))
    {
        m_stats.path = "follow";
        m_grid.scanFollowed(input, sink);
        return false;
    }
    m_stats.path = "rebuild";
    ++m_stats.rebuildsTotal;
    m_grid.scan(input, sink, ColumnUse::Follow);
    return true;
}

/// Updates the columns if that is possible and expected to cost less than a refill.
bool ColumnGridBackend::follow(const ProxyView& view, const GridInput& input)
{
    const std::size_t migrated = m_motion.migrated.size();
    const double following = ModePolicy::kCostOfMoving * view.size + ModePolicy::kCostOfMigrated * migrated;
    const double refilling = ModePolicy::kCostOfRefill * view.size;
    if (following > refilling || m_options.rebuildFraction == 0.0f)
    {
        recordDecision("many boxes came into other cells", migrated, refilling, following);
        return false;
    }
    if (!m_grid.follow(input, m_reference.data(), m_motion.migrated))
    {
        recordDecision("the rows could not be kept", migrated, refilling, following);
        return false;
    }
    recordDecision("few boxes came into other cells", migrated, following, refilling);
    return true;
}

/// Measures how far the changed boxes moved, and chooses the next motion bound.
void ColumnGridBackend::compareBoxes(const ProxyView& view)
{
    m_comparedOctave = m_boundOctave;
    m_grid.compare(view.boxes, m_reference.data(), view.dirty, view.dirtyCount, motionBoundOf(m_boundOctave),
                   m_motion, prepareMotions(view));
    chooseMotionBound(m_motion, view.size);
}

void ColumnGridBackend::updateMoving(const ProxyView& view)
{
    // The margin alone may have changed, so that hysteresis pairs are tested even when no box moved.
    if (view.dirtyCount == 0 && m_hysteresisPairs.empty())
    {
        m_stats.path = "idle";
        recordDecision("nothing changed", 0, 0, 0);
        return;
    }
    const double costOfBox =
        m_hasTeleported ? ModePolicy::kCostOfRefill + ModePolicy::kCostOfMigrated : ModePolicy::kCostOfMoving;
    m_workers.limit(costOfBox * view.size);
    // After an update with teleports, some work for one thread precedes the first loop.
    if (m_hasTeleported)
        m_workers.prewake(m_workers.tasksFor(view.dirtyCount, ColumnGrid::kTaskGrain));
    const bool areTeleporting = areStillTeleporting(view);
    const bool isComparisonSkipped = areTeleporting || m_isReferenceOld;
    if (!isComparisonSkipped)
        compareBoxes(view);
    const std::uint32_t teleported = countFrom(m_motion, m_boundOctave);
    const bool isListing = teleported != 0;
    if (isListing && !m_hasOverlapping)
        listOverlapping(m_overlapping);
    clearThreadDeltas();
    examineHysteresisPairs(view);
    m_hasTeleported = false;
    if (isComparisonSkipped || teleported > view.size / kMostTeleportedShare)
    {
        updateTeleported(view, isComparisonSkipped);
    }
    else
    {
        if (isListing)
            examineOverlapping(view);
        MovingSink sink(*this, view, isListing);
        scanMoving(view, isListing, true, sink);
        mergeThreadDeltas();
        mergeOverlapping(isListing);
    }
    m_areMotionsUneven = !isListing && evenness(m_motion, view.size) < kUneven;
    if (areTeleporting)
        rememberSample(view);
    else
        rememberBoxes(view);
}

/// Whether, by a sample, most boxes teleport as in the last update: then they need not be compared one by one.
bool ColumnGridBackend::areStillTeleporting(const ProxyView& view)
{
    if (!m_hasTeleported || view.dirtyCount <= view.size / kMostTeleportedShare)
        return false;
    std::vector<std::uint32_t> sample;
    for (std::uint32_t row = 0; row < view.size; row += sampleStride(view.size))
    {
        if (view.changes[row] != kRowUnchanged)
            sample.push_back(row);
    }
    const auto count = static_cast<std::uint32_t>(sample.size());
    m_grid.compare(view.boxes, m_reference.data(), sample.data(), count, motionBoundOf(m_boundOctave),
                   m_motion);
    // Where a motion bound can cover the motions, comparing all boxes is worth its cost.
    if (isBoundAllowed(octaveAbove(m_motion, count / kFewTeleportedShare)))
        return false;
    return countFrom(m_motion, m_boundOctave) > view.size / sampleStride(view.size) / kMostTeleportedShare;
}

/// While most boxes teleport, only areStillTeleporting() reads the previous boxes, and only those of the sample.
void ColumnGridBackend::rememberSample(const ProxyView& view)
{
    for (std::uint32_t row = 0; row < view.size; row += sampleStride(view.size))
        m_reference[row] = nanIfEmpty(view.boxes[row]);
    m_isReferenceOld = true;
}

void ColumnGridBackend::rememberBoxes(const ProxyView& view)
{
    const bool areAll = m_isReferenceOld;
    const std::uint32_t count = areAll ? view.size : view.dirtyCount;
    const unsigned tasks = m_workers.tasksFor(count, kCopyGrain);
    m_workers.run(tasks,
                  [&](unsigned task)
                  {
                      const TaskRange range(count, task, tasks);
                      for (std::uint32_t i = range.begin; i < range.end; ++i)
                      {
                          const std::uint32_t row = areAll ? i : view.dirty[i];
                          m_reference[row] = nanIfEmpty(view.boxes[row]);
                      }
                  });
    m_isReferenceOld = false;
}

/// Tests the hysteresis pairs. The scan will report those that overlap again as new.
void ColumnGridBackend::examineHysteresisPairs(const ProxyView& view)
{
    const unsigned tasks = m_workers.tasksFor(m_hysteresisPairs.size(), kPairGrain);
    m_workers.run(tasks,
                  [&](unsigned task)
                  {
                      const TaskRange range(m_hysteresisPairs.size(), task, tasks);
                      for (std::uint32_t i = range.begin; i < range.end; ++i)
                      {
                          prefetch(view.boxes, m_hysteresisPairs[std::min(i + kPrefetch, range.end - 1)]);
                          const RowPair pair = m_hysteresisPairs[i];
                          if (!isOverlapping(view, pair))
                              separatePair(view, pair, isWithinMargin(view, pair), task);
                          else if (mayEnter(view, pair))
                              m_added[task].push(idsOf(view, pair));
                          else
                              m_threadDeltas[task].newlyExempt.push_back(PairSet::keyOf(pair.a, pair.b));
                      }
                  });
    for (const ThreadDelta& delta : m_threadDeltas)
    {
        for (const std::uint64_t key : delta.newlyExempt)
            m_filterExempt.insert(key);
    }
}

/// Finds the pairs that cease to overlap where boxes teleported, so that the scan alone would miss them.
void ColumnGridBackend::examineOverlapping(const ProxyView& view)
{
    const unsigned tasks = m_workers.tasksFor(m_overlapping.size(), kPairGrain);
    m_workers.run(tasks,
                  [&](unsigned task)
                  {
                      const TaskRange range(m_overlapping.size(), task, tasks);
                      for (std::uint32_t i = range.begin; i < range.end; ++i)
                      {
                          prefetch(view.boxes, rowsOf(m_overlapping[std::min(i + kPrefetch, range.end - 1)]));
                          const RowPair pair = rowsOf(m_overlapping[i]);
                          if (!isOverlapping(view, pair))
                              separatePair(view, pair, isWithinMargin(view, pair), task);
                      }
                  });
}
}  // namespace cullet
