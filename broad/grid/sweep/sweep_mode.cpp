// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/sweep/sweep_mode.h"

#include "cullet/base/bytes_of.h"
#include "cullet/broad/grid/columns/pair_sinks.h"
#include "cullet/broad/grid/sweep/pair_loop.h"
#include "cullet/broad/grid/update/mode_policy.h"

#include <algorithm>

namespace cullet
{
namespace
{
// Where more than one box in so many teleported, all pairs are found anew.
constexpr std::uint32_t kMostTeleportedShare = 2;
constexpr std::uint32_t kTeleportSample = 256;
constexpr std::size_t kCopyGrain = 16384;
// The boxes of pairs are prefetched so many iterations early.
constexpr std::uint32_t kPairsAhead = 32;

std::uint32_t sampleStride(std::uint32_t rows)
{
    return rows / kTeleportSample + 1;
}
}  // namespace

/// Finds the pairs that begin or cease to overlap among those that the grid reports, in the threads of the grid.
///
/// The previous and the current boxes are compared: no list of all pairs is kept, unless some boxes teleport.
class SweepMode::SweepSink final : public PairSink
{
public:
    SweepSink(SweepMode& mode, const ProxyView& view, bool isListing)
        : m_mode(mode), m_view(view), m_isListing(isListing)
    {
    }

    void take(unsigned worker, const PairBuffer& found) override
    {
        const Aabb* const before = m_mode.m_core.reference.data();
        if (m_isListing)
            m_mode.m_overlapping.found(worker).makeRoom(found.count);
        for (std::uint32_t i = 0; i < found.count; ++i)
        {
            prefetchPair(before, found.pair(std::min(i + kPairsAhead, found.count - 1)));
            const RowPair pair = found.pair(i);
            const bool overlapped = overlapsBranchless(before[pair.a], before[pair.b]);
            const bool overlaps = found.gap[i] <= 0.0f;
            // UnsweptPairs has recorded the exempt pairs that overlap again.
            if (m_isListing)
                m_mode.m_overlapping.found(worker).pushIf(rowKey(pair),
                                                          m_mode.m_unswept.isHeld(m_view, pair));
            if (overlapped != overlaps)
                examine(worker, pair, found.gap[i]);
        }
    }

private:
    void examine(unsigned worker, RowPair pair, float gap)
    {
        if (gap > 0.0f)
        {
            if (m_mode.m_unswept.isHeld(m_view, pair))
                m_mode.m_unswept.separate(m_view, pair, gap <= 2.0f * m_view.margin, worker);
        }
        else if (mayEnter(m_view, pair))
        {
            m_mode.m_core.delta.add(m_view, pair, worker);
        }
    }

    SweepMode& m_mode;
    const ProxyView& m_view;
    const bool m_isListing;
};

/// Lists the pairs that overlap and are held from now on, in the threads of the grid.
class SweepMode::TeleportSink final : public PairSink
{
public:
    TeleportSink(SweepMode& mode, const ProxyView& view) : m_mode(mode), m_view(view) {}

    void take(unsigned worker, const PairBuffer& found) override
    {
        KeyList::Writer writer(m_mode.m_core.found[worker], found.count);
        for (std::uint32_t i = 0; i < found.count; ++i)
        {
            const RowPair pair = found.pair(i);
            // UnsweptPairs has recorded the exempt pairs that overlap again.
            writer.pushIf(rowKey(pair), m_mode.m_unswept.isHeld(m_view, pair));
        }
    }

private:
    SweepMode& m_mode;
    const ProxyView& m_view;
};

void SweepMode::begin(const ProxyView& view, const std::vector<RowPair>& held)
{
    m_core.stats.path = "rebuild";
    m_core.sortHeldBefore(held);

    CollectingSink sink(m_core.workers.threads());
    GridInput input;
    input.boxes = view.boxes;
    input.count = view.size;
    m_core.grid.scan(input, sink, ColumnUse::Follow);
    m_scannedRows = view.size;
    sink.forEach(
        [&](RowPair pair)
        {
            const std::uint64_t key = rowKey(pair);
            const bool passes = mayEnter(view, pair);
            const bool wasHeld = m_core.heldBefore.contains(key);
            if (wasHeld && !passes)
                m_unswept.addExempt(key);
            if (!wasHeld && passes)
                m_core.delta.add(view, pair);
        });
    for (const RowPair pair : held)
    {
        const Aabb& a = view.boxes[pair.a];
        const Aabb& b = view.boxes[pair.b];
        const bool valid = isValid(a) && isValid(b);
        if (valid && overlaps(a, b))
            continue;
        if (valid && overlapsWithMargin(a, b, view.margin))
            m_unswept.addHysteresis(pair);
        else
            m_core.delta.remove(view, pair);
    }
}

void SweepMode::update(const ProxyView& view)
{
    // The margin alone may have changed, so that hysteresis pairs are tested even when no box moved.
    if (view.dirtyCount == 0 && m_unswept.hysteresisPairs().empty())
    {
        m_core.stats.path = "idle";
        m_core.recordDecision("nothing changed", 0, 0, 0);
        return;
    }
    const bool wasCoherent = m_motion == Motion::Coherent;
    const bool hasOldReference = m_motion == Motion::Teleporting;
    const double costOfBox =
        wasCoherent ? ModePolicy::kCostOfMoving : ModePolicy::kCostOfRefill + ModePolicy::kCostOfMigrated;
    m_core.workers.limit(costOfBox * view.size);
    // After an update with teleports, some work for one thread precedes the first loop.
    if (!wasCoherent)
        m_core.workers.prewake(m_core.workers.tasksFor(view.dirtyCount, ColumnGrid::kTaskGrain));
    const bool areTeleporting = areStillTeleporting(view);
    const bool isCompared = !areTeleporting && !hasOldReference;
    if (isCompared)
        m_bound.compare(view);
    const std::uint32_t teleported = m_bound.teleportedCount();
    const bool isListing = teleported != 0;
    if (isListing && !m_overlapping.isListed())
        listOverlapping();
    m_overlapping.beginUpdate();
    m_unswept.beginUpdate(view);
    if (!isCompared || teleported > view.size / kMostTeleportedShare)
    {
        updateTeleported(view, isCompared);
    }
    else
    {
        if (isListing)
            m_overlapping.separate(view);
        SweepSink sink(*this, view, isListing);
        scan(view, isListing, true, sink);
        m_unswept.merge();
        m_overlapping.merge(isListing);
        m_motion = Motion::Coherent;
    }
    m_bound.finish(view.size, isListing);
    if (areTeleporting)
        rememberSample(view);
    else
        rememberBoxes(view, hasOldReference);
}

/// Whether, by a sample, most boxes teleport as in the last update: then they need not be compared one by one.
bool SweepMode::areStillTeleporting(const ProxyView& view)
{
    if (m_motion == Motion::Coherent || view.dirtyCount <= view.size / kMostTeleportedShare)
        return false;
    const std::uint32_t stride = sampleStride(view.size);
    std::vector<std::uint32_t> sample;
    for (std::uint32_t row = 0; row < view.size; row += stride)
    {
        if (view.changes[row] != kRowUnchanged)
            sample.push_back(row);
    }
    return m_bound.areTeleporting(view, sample, view.size / stride / kMostTeleportedShare);
}

/// Lists the held pairs that overlapped in the last update, by the boxes and filter words of that update.
void SweepMode::listOverlapping()
{
    m_overlapping.clear();
    CollectingSink sink(m_core.workers.threads());
    GridInput input;
    input.boxes = m_core.reference.data();
    input.count = m_scannedRows;
    m_core.grid.scanAgain(input, sink);
    sink.forEach(
        [&](RowPair pair)
        {
            const std::uint64_t key = rowKey(pair);
            if (m_filterWords.empty() || passesFilter(m_filterWords[pair.a], m_filterWords[pair.b]) ||
                m_unswept.isExempt(key))
                m_overlapping.add(key);
        });
}

/// @param isCompared whether the boxes were compared one by one; otherwise the migrated ones are unknown
void SweepMode::updateTeleported(const ProxyView& view, bool isCompared)
{
    for (KeyList& list : m_core.found)
        list.clear();
    m_overlapping.sort();
    TeleportSink sink(*this, view);
    if (!isCompared)
    {
        const double refilling = ModePolicy::kCostOfRefill * view.size;
        m_core.recordDecision("", view.dirtyCount, refilling,
                              refilling + ModePolicy::kCostOfMigrated * view.dirtyCount);
    }
    const bool isRefilled = scan(view, true, isCompared, sink);
    m_motion = isRefilled ? Motion::Teleported : Motion::Coherent;
    m_core.stats.decision.reason = "most boxes jumped";
    m_overlapping.replace(view);
    m_unswept.merge();
    for (KeyList& list : m_core.found)
        list.trim();
}

/// @param mayFollow whether m_bound has all boxes that migrated to other cells
/// @return whether the grid was refilled
bool SweepMode::scan(const ProxyView& view, bool isListing, bool mayFollow, PairSink& sink)
{
    GridInput input;
    input.boxes = view.boxes;
    input.count = view.size;
    m_bound.setCellSkin(input);
    if (!isListing)
        m_bound.setGaps(input);
    m_scannedRows = view.size;
    if (mayFollow && follow(view, input))
    {
        m_core.stats.path = "follow";
        m_core.grid.scanFollowed(input, sink);
        return false;
    }
    m_core.stats.path = "rebuild";
    ++m_core.stats.rebuildsTotal;
    m_core.grid.scan(input, sink, ColumnUse::Follow);
    return true;
}

/// Updates the columns if that is possible and expected to cost less than a refill.
bool SweepMode::follow(const ProxyView& view, const GridInput& input)
{
    const std::size_t migrated = m_bound.migrated().size();
    const double following = ModePolicy::kCostOfMoving * view.size + ModePolicy::kCostOfMigrated * migrated;
    const double refilling = ModePolicy::kCostOfRefill * view.size;
    if (following > refilling || m_core.options.rebuildFraction == 0.0f)
    {
        m_core.recordDecision("many boxes came into other cells", migrated, refilling, following);
        return false;
    }
    if (!m_core.grid.follow(input, m_core.reference.data(), m_bound.migrated()))
    {
        m_core.recordDecision("the rows could not be kept", migrated, refilling, following);
        return false;
    }
    m_core.recordDecision("few boxes came into other cells", migrated, following, refilling);
    return true;
}

/// While most boxes teleport, only areStillTeleporting() reads the previous boxes, and only those of the sample.
void SweepMode::rememberSample(const ProxyView& view)
{
    for (std::uint32_t row = 0; row < view.size; row += sampleStride(view.size))
        m_core.reference[row] = nanIfEmpty(view.boxes[row]);
    m_motion = Motion::Teleporting;
}

/// @param areAll all boxes, or only those that changed
void SweepMode::rememberBoxes(const ProxyView& view, bool areAll)
{
    const std::uint32_t count = areAll ? view.size : view.dirtyCount;
    const unsigned tasks = m_core.workers.tasksFor(count, kCopyGrain);
    m_core.workers.run(tasks,
                       [&](unsigned task)
                       {
                           const TaskRange range(count, task, tasks);
                           for (std::uint32_t i = range.begin; i < range.end; ++i)
                           {
                               const std::uint32_t row = areAll ? i : view.dirty[i];
                               m_core.reference[row] = nanIfEmpty(view.boxes[row]);
                           }
                       });
}

void SweepMode::collectHeld(std::vector<RowPair>& held)
{
    if (!m_overlapping.isListed())
        listOverlapping();
    held = m_unswept.hysteresisPairs();
    for (const std::uint64_t key : m_overlapping.pairs())
        held.push_back(rowsOf(key));
}

void SweepMode::clear()
{
    m_overlapping.clear();
    m_unswept.clear();
    m_motion = Motion::Coherent;
}

void SweepMode::rememberFilterWords(const ProxyView& view, bool all)
{
    if (view.filters == nullptr)
    {
        m_filterWords.clear();
        return;
    }
    if (all || m_filterWords.size() < view.size)
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

void SweepMode::forgetRows()
{
    m_filterWords.clear();
    m_bound.forget();
}

std::uint64_t SweepMode::bytes() const
{
    return m_bound.bytes() + m_unswept.bytes() + m_overlapping.bytes() + bytesOf(m_filterWords);
}
}  // namespace cullet
