// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Moving mode: updates in which most boxes teleported. Hardly a pair outlives them, so that comparing two sorted
// lists of pairs costs less than testing the previous and the current boxes of each pair.
#include "cullet/broad/grid/column_grid_backend.h"

#include <algorithm>
#include <utility>

namespace cullet
{
namespace
{
// The boxes of pairs are prefetched so many iterations early.
constexpr std::ptrdiff_t kPrefetch = 64;
constexpr std::size_t kCompareGrain = 4096;

/// The sorted keys whose lower row is in [firstRow, lastRow).
std::pair<const std::uint64_t*, const std::uint64_t*> keysOfRows(const std::vector<std::uint64_t>& keys,
                                                                 std::uint32_t firstRow,
                                                                 std::uint32_t lastRow)
{
    const std::uint64_t* const end = keys.data() + keys.size();
    const std::uint64_t* const from = std::lower_bound(keys.data(), end, std::uint64_t{firstRow} << 32);
    return {from, std::lower_bound(from, end, std::uint64_t{lastRow} << 32)};
}
}  // namespace

/// Lists the pairs that overlap and are held from now on, in the threads of the grid.
class ColumnGridBackend::TeleportedSink final : public PairSink
{
public:
    TeleportedSink(ColumnGridBackend& backend, const ProxyView& view) : m_backend(backend), m_view(view) {}

    void take(unsigned worker, const PairBuffer& found) override
    {
        KeyList& list = m_backend.m_found[worker];
        KeyList::Writer writer(list, found.count);
        for (std::uint32_t i = 0; i < found.count; ++i)
        {
            const RowPair pair = found.pair(i);
            const std::uint64_t key = PairSet::keyOf(pair.a, pair.b);
            // examineHysteresisPairs() has recorded the exempt pairs that overlap again.
            writer.pushIf(key, mayEnter(m_view, pair) || m_backend.m_filterExempt.contains(key));
        }
    }

private:
    ColumnGridBackend& m_backend;
    const ProxyView& m_view;
};

void ColumnGridBackend::sortOverlapping()
{
    if (m_isOverlappingSorted)
        return;
    for (const std::uint64_t key : m_overlapping)
        m_found[0].push(key);
    m_sorts[0].sort(m_workers, m_found, m_overlapping);
    m_found[0].clear();
}

/// First row of a task. Tasks get equal numbers of pairs, not of rows: three of four have their lower row in the
/// first half.
std::uint32_t ColumnGridBackend::firstRowOf(const ProxyView& view, unsigned task, unsigned tasks) const
{
    if (task == 0 || task == tasks)
        return task == 0 ? 0 : view.size;
    return rowsOf(m_nextOverlapping[m_nextOverlapping.size() * task / tasks]).a;
}

/// Records the changes of the pairs whose lower row is in [begin, end), from the sorted lists of those found and of
/// those that overlapped before.
void ColumnGridBackend::compareLists(const ProxyView& view, std::uint32_t begin, std::uint32_t end,
                                     unsigned worker)
{
    const auto [old, oldEnd] = keysOfRows(m_overlapping, begin, end);
    separateOldPairs(view, old, oldEnd, worker);
    const auto [found, foundEnd] = keysOfRows(m_nextOverlapping, begin, end);
    const std::vector<std::uint64_t>& kept = m_threadDeltas[worker].kept;
    auto nextKept = kept.begin();
    {
        KeyList::Writer added(m_added[worker], static_cast<std::size_t>(foundEnd - found));
        for (const std::uint64_t* key = found; key != foundEnd; ++key)
        {
            const bool isKept = nextKept != kept.end() && *nextKept == *key;
            nextKept += isKept ? 1 : 0;
            added.pushIf(idsOf(view, rowsOf(*key)), !isKept && mayEnter(view, rowsOf(*key)));
        }
    }
    m_added[worker].measure();
}

/// Removes the sorted pairs that no longer overlap with the margin, and records the few others.
void ColumnGridBackend::separateOldPairs(const ProxyView& view, const std::uint64_t* old,
                                         const std::uint64_t* end, unsigned worker)
{
    const bool hasExempt = !m_filterExempt.isEmpty();
    {
        KeyList::Writer removed(m_removed[worker], static_cast<std::size_t>(end - old));
        for (const std::uint64_t* key = old; key != end; ++key)
        {
            const RowPair pair = rowsOf(*key);
            const std::uint32_t ahead = rowsOf(key[std::min(kPrefetch, end - key - 1)]).b;
            prefetchBox(view.boxes + ahead);
            __builtin_prefetch(view.uniqueIds + ahead);
            // areFarApart() decides nearly all pairs, at half the cost of isWithinMargin().
            const bool stays = !areFarApart(view.boxes[pair.a], view.boxes[pair.b], view.margin) &&
                               isWithinMargin(view, pair);
            removed.pushIf(idsOf(view, pair), !stays);
            if (stays || hasExempt)
                recordOldPair(view, *key, stays, m_threadDeltas[worker]);
        }
    }
    m_removed[worker].measure();
}

/// Records a pair that overlapped before: as kept if it still overlaps, as a hysteresis pair if the margin keeps it.
void ColumnGridBackend::recordOldPair(const ProxyView& view, std::uint64_t key, bool isWithinMargin,
                                      ThreadDelta& delta)
{
    if (isWithinMargin && isOverlapping(view, rowsOf(key)))
    {
        delta.kept.push_back(key);
        return;
    }
    if (m_filterExempt.contains(key))
        delta.noLongerExempt.push_back(key);
    if (isWithinMargin)
        delta.hysteresis.push_back(rowsOf(key));
}

/// @param isComparisonSkipped whether the boxes were not compared one by one, so that the migrated ones are unknown
void ColumnGridBackend::updateTeleported(const ProxyView& view, bool isComparisonSkipped)
{
    for (KeyList& list : m_found)
        list.clear();
    sortOverlapping();
    TeleportedSink sink(*this, view);
    if (isComparisonSkipped)
    {
        const double refilling = ModePolicy::kCostOfRefill * view.size;
        recordDecision("", view.dirtyCount, refilling,
                       refilling + ModePolicy::kCostOfMigrated * view.dirtyCount);
    }
    m_hasTeleported = scanMoving(view, true, !isComparisonSkipped, sink);
    m_stats.decision.reason = "most boxes jumped";
    m_sorts[0].sortRows(m_workers, m_found, view.size, m_nextOverlapping);
    const unsigned tasks = m_workers.tasksFor(m_nextOverlapping.size(), kCompareGrain);
    m_workers.run(
        tasks, [&](unsigned task)
        { compareLists(view, firstRowOf(view, task, tasks), firstRowOf(view, task + 1, tasks), task); });
    mergeThreadDeltas();
    // m_nextOverlapping keeps its length for the next list, which is about as long.
    m_overlapping.swap(m_nextOverlapping);
    m_hasOverlapping = true;
    m_isOverlappingSorted = true;
    for (KeyList& list : m_found)
        list.trim();
}
}  // namespace cullet
