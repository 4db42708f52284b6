// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Moving mode: the changes of pairs that each thread records, and how they are merged.
#include "cullet/base/trim_capacity.h"
#include "cullet/broad/grid/column_grid_backend.h"

namespace cullet
{
void ColumnGridBackend::clearThreadDeltas()
{
    for (ThreadDelta& delta : m_threadDeltas)
    {
        delta.hysteresis.clear();
        delta.held.clear();
        delta.newlyExempt.clear();
        delta.noLongerExempt.clear();
        delta.kept.clear();
    }
}

/// Records a held pair that no longer overlaps: it stays while its boxes overlap with the margin.
void ColumnGridBackend::separatePair(const ProxyView& view, RowPair pair, bool isWithinMargin,
                                     unsigned worker)
{
    if (!m_filterExempt.isEmpty() && m_filterExempt.contains(PairSet::keyOf(pair.a, pair.b)))
        m_threadDeltas[worker].noLongerExempt.push_back(PairSet::keyOf(pair.a, pair.b));
    if (isWithinMargin)
        m_threadDeltas[worker].hysteresis.push_back(pair);
    else
        m_removed[worker].push(idsOf(view, pair));
}

/// Merges the changes that the threads recorded.
void ColumnGridBackend::mergeThreadDeltas()
{
    m_hysteresisPairs.clear();
    for (ThreadDelta& delta : m_threadDeltas)
    {
        m_hysteresisPairs.insert(m_hysteresisPairs.end(), delta.hysteresis.begin(), delta.hysteresis.end());
        for (const std::uint64_t key : delta.noLongerExempt)
            m_filterExempt.erase(key);
        trimCapacity(delta.hysteresis);
        delta.held.trim();
    }
    trimCapacity(m_hysteresisPairs);
}

/// Merges the held pairs that overlap, if they were listed.
void ColumnGridBackend::mergeOverlapping(bool isListing)
{
    m_overlapping.clear();
    m_hasOverlapping = isListing;
    m_isOverlappingSorted = false;
    for (const ThreadDelta& delta : m_threadDeltas)
        m_overlapping.insert(m_overlapping.end(), delta.held.begin(), delta.held.end());
    trimCapacity(m_overlapping);
}
}  // namespace cullet
