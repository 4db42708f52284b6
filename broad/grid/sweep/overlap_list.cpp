// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/sweep/overlap_list.h"

#include "cullet/base/bytes_of.h"
#include "cullet/base/trim_capacity.h"
#include "cullet/broad/boxes/prefetch_box.h"
#include "cullet/broad/grid/sweep/pair_loop.h"

#include <algorithm>
#include <utility>

namespace cullet
{
namespace
{
// The boxes of pairs are prefetched so many iterations early.
constexpr std::ptrdiff_t kKeysAhead = 64;
constexpr std::size_t kCompareGrain = 4096;

/// The sorted keys whose lower row is in [firstRow, lastRow).
std::pair<const std::uint64_t*, const std::uint64_t*> keysOfRows(const PairKeys& keys, std::uint32_t firstRow,
                                                                 std::uint32_t lastRow)
{
    const std::uint64_t* const end = keys.data() + keys.size();
    const std::uint64_t* const from = std::lower_bound(keys.data(), end, std::uint64_t{firstRow} << 32);
    return {from, std::lower_bound(from, end, std::uint64_t{lastRow} << 32)};
}
}  // namespace

void OverlapList::beginUpdate()
{
    for (ThreadPairs& pairs : m_threads)
    {
        pairs.held.clear();
        pairs.kept.clear();
    }
}

void OverlapList::separate(const ProxyView& view)
{
    forEachPair(
        m_core.workers, view.boxes, m_pairs.size(), [&](std::size_t i) { return rowsOf(m_pairs[i]); },
        [&](RowPair pair, unsigned worker)
        {
            if (!isOverlapping(view, pair))
                m_unswept.separate(view, pair, isWithinMargin(view, pair), worker);
        });
}

void OverlapList::merge(bool isListing)
{
    setPairs(isListing ? State::Unsorted : State::None);
    for (ThreadPairs& pairs : m_threads)
    {
        pairs.held.trim();
        m_pairs.insert(m_pairs.end(), pairs.held.begin(), pairs.held.end());
    }
    trimCapacity(m_pairs);
}

void OverlapList::sort()
{
    if (m_state == State::Sorted)
        return;
    {
        KeyList::Writer writer(m_core.found[0], m_pairs.size());
        for (const std::uint64_t key : m_pairs)
            writer.pushIf(key, true);
    }
    m_core.delta.sorter().sort(m_core.workers, m_core.found, m_pairs);
    m_core.found[0].clear();
    m_core.found[0].trim();
}

void OverlapList::replace(const ProxyView& view)
{
    m_core.delta.sorter().sortRows(m_core.workers, m_core.found, view.size, m_next);
    const unsigned tasks = m_core.workers.tasksFor(m_next.size(), kCompareGrain);
    m_core.workers.run(
        tasks, [&](unsigned task)
        { compareLists(view, firstRowOf(view, task, tasks), firstRowOf(view, task + 1, tasks), task); });
    for (ThreadPairs& pairs : m_threads)
        pairs.held.trim();
    // m_next keeps its length for the next list, which is about as long.
    m_pairs.swap(m_next);
    m_state = State::Sorted;
}

/// First row of a task. Tasks get equal numbers of pairs, not of rows: three of four have their lower row in the
/// first half.
std::uint32_t OverlapList::firstRowOf(const ProxyView& view, unsigned task, unsigned tasks) const
{
    if (task == 0 || task == tasks)
        return task == 0 ? 0 : view.size;
    return rowsOf(m_next[m_next.size() * task / tasks]).a;
}

/// Records the changes of the pairs whose lower row is in [begin, end), from the sorted lists of those found and of
/// those that overlapped before.
void OverlapList::compareLists(const ProxyView& view, std::uint32_t begin, std::uint32_t end, unsigned worker)
{
    const auto [old, oldEnd] = keysOfRows(m_pairs, begin, end);
    separateOldPairs(view, old, oldEnd, worker);
    const auto [found, foundEnd] = keysOfRows(m_next, begin, end);
    const std::vector<std::uint64_t>& kept = m_threads[worker].kept;
    auto nextKept = kept.begin();
    {
        KeyList::Writer added(m_core.delta.added(worker), static_cast<std::size_t>(foundEnd - found));
        for (const std::uint64_t* key = found; key != foundEnd; ++key)
        {
            const bool isKept = nextKept != kept.end() && *nextKept == *key;
            nextKept += isKept ? 1 : 0;
            added.pushIf(idsOf(view, rowsOf(*key)), !isKept && mayEnter(view, rowsOf(*key)));
        }
    }
    m_core.delta.added(worker).measure();
}

/// Removes the sorted pairs that no longer overlap with the margin, and records the few others.
void OverlapList::separateOldPairs(const ProxyView& view, const std::uint64_t* old, const std::uint64_t* end,
                                   unsigned worker)
{
    const bool hasExempt = m_unswept.hasExempt();
    {
        KeyList::Writer removed(m_core.delta.removed(worker), static_cast<std::size_t>(end - old));
        for (const std::uint64_t* key = old; key != end; ++key)
        {
            const RowPair pair = rowsOf(*key);
            const std::uint32_t ahead = rowsOf(key[std::min(kKeysAhead, end - key - 1)]).b;
            prefetchBox(view.boxes + ahead);
            __builtin_prefetch(view.uniqueIds + ahead);
            // areFarApart() decides nearly all pairs, at half the cost of isWithinMargin().
            const bool stays = !areFarApart(view.boxes[pair.a], view.boxes[pair.b], view.margin) &&
                               isWithinMargin(view, pair);
            removed.pushIf(idsOf(view, pair), !stays);
            if (stays || hasExempt)
                recordOldPair(view, *key, stays, worker);
        }
    }
    m_core.delta.removed(worker).measure();
}

/// Records a pair that overlapped before: as kept if it still overlaps, as a hysteresis pair if the margin keeps it.
void OverlapList::recordOldPair(const ProxyView& view, std::uint64_t key, bool isWithinMargin,
                                unsigned worker)
{
    if (isWithinMargin && isOverlapping(view, rowsOf(key)))
    {
        m_threads[worker].kept.push_back(key);
        return;
    }
    if (m_unswept.isExempt(key))
        m_unswept.recordEndOfExemption(key, worker);
    if (isWithinMargin)
        m_unswept.recordHysteresis(rowsOf(key), worker);
}

std::uint64_t OverlapList::bytes() const
{
    std::uint64_t sum = bytesOf(m_pairs, m_next, m_threads);
    for (const ThreadPairs& pairs : m_threads)
        sum += pairs.held.bytes() + bytesOf(pairs.kept);
    return sum;
}
}  // namespace cullet
