// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Moving mode: the changes of pairs that each thread records, and how they are merged.
#include "cullet/base/trim_capacity.h"
#include "cullet/broad/grid/column_grid_backend.h"

namespace cullet
{
void ColumnGridBackend::clearNews()
{
    for (PairNews& news : m_news)
    {
        news.apart.clear();
        news.held.clear();
        news.despite.clear();
        news.lifted.clear();
        news.kept.clear();
    }
}

/// Records a held pair that no longer overlaps: it stays while its boxes overlap with the margin.
void ColumnGridBackend::part(const ProxyView& view, RowPair pair, bool isNear, unsigned worker)
{
    if (!m_despite.isEmpty() && m_despite.contains(PairSet::keyOf(pair.a, pair.b)))
        m_news[worker].lifted.push_back(PairSet::keyOf(pair.a, pair.b));
    if (isNear)
        m_news[worker].apart.push_back(pair);
    else
        m_removed[worker].push(idsOf(view, pair));
}

/// Merges the changes that the threads recorded.
void ColumnGridBackend::takeNews()
{
    m_apart.clear();
    for (PairNews& news : m_news)
    {
        m_apart.insert(m_apart.end(), news.apart.begin(), news.apart.end());
        for (const std::uint64_t key : news.lifted)
            m_despite.erase(key);
        trimRoom(news.apart);
        news.held.trim();
    }
    trimRoom(m_apart);
}

/// Merges the held pairs that overlap, if they were listed.
void ColumnGridBackend::takeHeld(bool isListing)
{
    m_overlapping.clear();
    m_hasOverlapping = isListing;
    m_isOverlappingSorted = false;
    for (const PairNews& news : m_news)
        m_overlapping.insert(m_overlapping.end(), news.held.begin(), news.held.end());
    trimRoom(m_overlapping);
}
}  // namespace cullet
