// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Updates of the moving mode in which most boxes jumped. Hardly a pair outlives them, so that comparing two sorted lists
// of pairs costs less than looking each of them up in the boxes of before and of now.
#include "broad/row_grid_backend.h"

#include <algorithm>

namespace cullet
{
namespace
{
// Pairs whose boxes are on their way from memory.
constexpr std::size_t kPrefetch = 12;

IdPair rowsOf(std::uint64_t key)
{
    return {static_cast<std::uint32_t>(key >> 32), static_cast<std::uint32_t>(key)};
}
}  // namespace

/// Lists the pairs that overlap and are held from now on, in the threads of the grid.
class RowGridBackend::JumpedSink final : public PairSink
{
public:
    struct alignas(64) List
    {
        std::vector<std::uint64_t> held;     ///< keys by row
        std::vector<std::uint64_t> despite;  ///< of those, the ones that the filter words reject
    };

    JumpedSink(const RowGridBackend& backend, const ProxyView& view, unsigned workers)
        : m_backend(backend), m_view(view), m_lists(workers)
    {
    }

    void take(unsigned worker, const PairBuffer& found) override
    {
        List& list = m_lists[worker];
        for (std::uint32_t i = 0; i < found.count; ++i)
        {
            const IdPair pair = found.pair(i);
            const std::uint64_t key = PairSet::keyOf(pair.a, pair.b);
            const bool passes = mayEnter(m_view, pair);
            if (!passes && !m_backend.m_despite.contains(key) && !m_backend.m_separated.contains(key))
                continue;
            list.held.push_back(key);
            if (!passes)
                list.despite.push_back(key);
        }
    }

    const std::vector<List>& lists() const { return m_lists; }

private:
    const RowGridBackend& m_backend;
    const ProxyView& m_view;
    std::vector<List> m_lists;
};

void RowGridBackend::takeFound(const JumpedSink& sink)
{
    m_foundKeys.clear();
    for (const JumpedSink::List& list : sink.lists())
    {
        m_foundKeys.insert(m_foundKeys.end(), list.held.begin(), list.held.end());
        for (const std::uint64_t key : list.despite)
            m_despite.insert(key);
    }
    m_sort.sort(m_foundKeys);
}

void RowGridBackend::sortOverlapping()
{
    if (m_isOverlappingSorted)
        return;
    std::vector<std::uint64_t> keys;
    keys.reserve(m_overlapping.size());
    for (const IdPair pair : m_overlapping)
        keys.push_back(PairSet::keyOf(pair.a, pair.b));
    m_sort.sort(keys);
    std::transform(keys.begin(), keys.end(), m_overlapping.begin(), rowsOf);
}

/// Merges what overlapped with what was found: tells what is new, and lists what does not overlap any more.
void RowGridBackend::findDeparted(const ProxyView& view, std::vector<IdPair>& departed)
{
    auto old = m_overlapping.begin();
    for (const std::uint64_t key : m_foundKeys)
    {
        for (; old != m_overlapping.end() && PairSet::keyOf(old->a, old->b) < key; ++old)
            departed.push_back(*old);
        if (old != m_overlapping.end() && PairSet::keyOf(old->a, old->b) == key)
            ++old;
        // Pairs that the margin kept come nearer again.
        else if (!m_separated.contains(key))
            reportAdded(view, rowsOf(key));
    }
    departed.insert(departed.end(), old, m_overlapping.end());
}

void RowGridBackend::updateJumped(const ProxyView& view)
{
    JumpedSink sink(*this, view, m_workers.threads());
    scanMoving(view, m_motion, true, sink);
    m_stats.decision.reason = "most boxes jumped";
    takeFound(sink);
    sortOverlapping();
    std::vector<IdPair> departed;
    departed.reserve(m_overlapping.size());
    findDeparted(view, departed);

    std::vector<IdPair> apart;
    for (const IdPair pair : m_apart)
        partUnlessOverlapping(view, pair, apart);
    for (std::size_t i = 0; i < departed.size(); ++i)
    {
        const IdPair ahead = departed[std::min(i + kPrefetch, departed.size() - 1)];
        __builtin_prefetch(view.boxes + ahead.a);
        __builtin_prefetch(view.boxes + ahead.b);
        partUnlessOverlapping(view, departed[i], apart);
    }
    setApart(apart);
    m_overlapping.resize(m_foundKeys.size());
    std::transform(m_foundKeys.begin(), m_foundKeys.end(), m_overlapping.begin(), rowsOf);
    m_hasOverlapping = true;
    m_isOverlappingSorted = true;
}
}  // namespace cullet
