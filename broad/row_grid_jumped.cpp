// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Updates of the moving mode in which most boxes jumped. Hardly a pair outlives them, so that comparing two sorted lists
// of pairs costs less than looking each of them up in the boxes of before and of now.
#include "broad/row_grid_backend.h"

#include <algorithm>
#include <utility>

namespace cullet
{
namespace
{
// Pairs whose boxes are on their way from memory.
constexpr std::ptrdiff_t kPrefetch = 12;
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

/// One of 32 bits by the upper row.
std::uint32_t maskOf(std::uint64_t key)
{
    return 1u << (static_cast<std::uint32_t>(key) * 2654435769u >> 27);
}
}  // namespace

/// Lists the pairs that overlap and are held from now on, in the threads of the grid.
class RowGridBackend::JumpedSink final : public PairSink
{
public:
    JumpedSink(RowGridBackend& backend, const ProxyView& view) : m_backend(backend), m_view(view) {}

    void take(unsigned worker, const PairBuffer& found) override
    {
        KeyList& list = m_backend.m_found[worker];
        list.makeRoom(found.count);
        for (std::uint32_t i = 0; i < found.count; ++i)
        {
            const IdPair pair = found.pair(i);
            const std::uint64_t key = PairSet::keyOf(pair.a, pair.b);
            // Pairs that come back have been looked at by examineApart().
            list.pushIf(key, mayEnter(m_view, pair) || m_backend.m_despite.contains(key));
        }
        list.measure();
    }

private:
    RowGridBackend& m_backend;
    const ProxyView& m_view;
};

void RowGridBackend::sortOverlapping()
{
    if (m_isOverlappingSorted)
        return;
    for (const std::uint64_t key : m_overlapping)
        m_found[0].push(key);
    m_sorts[0].sort(m_workers, m_found, m_overlapping);
    m_found[0].clear();
}

/// Rows are shared out by their found pairs: three of four have their lower row in the first half.
std::uint32_t RowGridBackend::firstRowOf(const ProxyView& view, unsigned task, unsigned tasks) const
{
    if (task == 0 || task == tasks)
        return task == 0 ? 0 : view.size;
    return rowsOf(m_sorted[m_sorted.size() * task / tasks]).a;
}

/// Compares what was found with what overlapped before, both sorted, for the lower rows [begin, end).
///
/// Hardly a pair is in both. Which may be is told by masks, 32 bits for each row, instead of a merge, whose branches nobody
/// could predict.
void RowGridBackend::compareLists(const ProxyView& view, std::uint32_t begin, std::uint32_t end,
                                  unsigned worker)
{
    const auto [old, oldEnd] = keysOfRows(m_overlapping, begin, end);
    const auto [found, foundEnd] = keysOfRows(m_sorted, begin, end);
    std::fill(m_masks.begin() + begin, m_masks.begin() + end, 0u);
    for (const std::uint64_t* key = old; key != oldEnd; ++key)
        m_masks[*key >> 32] |= maskOf(*key);
    m_added[worker].makeRoom(static_cast<std::size_t>(foundEnd - found));
    std::vector<std::uint64_t>& kept = m_news[worker].kept;
    for (const std::uint64_t* key = found; key != foundEnd; ++key)
    {
        const bool isKept =
            (m_masks[*key >> 32] & maskOf(*key)) != 0 && std::binary_search(old, oldEnd, *key);
        if (isKept)
            kept.push_back(*key);
        m_added[worker].pushIf(idsOf(view, rowsOf(*key)), !isKept && mayEnter(view, rowsOf(*key)));
    }
    m_added[worker].measure();
    partDeparted(view, old, oldEnd, worker);
    m_removed[worker].measure();
}

/// Lets all of the sorted pairs part that are not kept.
void RowGridBackend::partDeparted(const ProxyView& view, const std::uint64_t* old, const std::uint64_t* end,
                                  unsigned worker)
{
    const std::vector<std::uint64_t>& kept = m_news[worker].kept;
    const bool mayLift = !m_despite.isEmpty();
    m_removed[worker].makeRoom(static_cast<std::size_t>(end - old));
    auto nextKept = kept.begin();
    for (const std::uint64_t* key = old; key != end; ++key)
    {
        const IdPair pair = rowsOf(*key);
        prefetchBox(view.boxes + rowsOf(key[std::min(kPrefetch, end - key - 1)]).b);
        if (nextKept != kept.end() && *nextKept == *key)
            ++nextKept;
        else if (mayLift || isNear(view, pair))
            part(view, pair, isNear(view, pair), worker);
        else
            m_removed[worker].pushIf(idsOf(view, pair), true);
    }
}

/// @param isSure whether that was told by a sample, so that strays are not known
void RowGridBackend::updateJumped(const ProxyView& view, bool isSure)
{
    for (KeyList& list : m_found)
        list.clear();
    sortOverlapping();
    JumpedSink sink(*this, view);
    if (isSure)
    {
        const double refilling = SettlePolicy::kCostOfRefill * view.size;
        decide("", view.dirtyCount, refilling, refilling + SettlePolicy::kCostOfStray * view.dirtyCount);
    }
    m_hasJumped = scanMoving(view, true, !isSure, sink);
    m_stats.decision.reason = "most boxes jumped";
    m_sorts[0].sort(m_workers, m_found, m_sorted);
    m_masks.resize(view.size);
    const unsigned tasks = m_workers.tasksFor(m_sorted.size(), kCompareGrain);
    m_workers.run(
        tasks, [&](unsigned task)
        { compareLists(view, firstRowOf(view, task, tasks), firstRowOf(view, task + 1, tasks), task); });
    takeNews(true);
    m_overlapping.swap(m_sorted);
    m_isOverlappingSorted = true;
    for (KeyList& list : m_found)
        list.trim();
}
}  // namespace cullet
