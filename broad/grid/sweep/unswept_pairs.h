// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/key_table.h"
#include "cullet/broad/grid/update/grid_core.h"
#include "cullet/broad/pairs/pair_tests.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// The held pairs that boxes and filter words do not tell. In sweep mode the pair set has the pairs that overlap and
/// pass the filter, and these:
///
/// - *hysteresis pairs* overlap with the margin only;
/// - *exempt pairs* overlap, and are held although the filter words reject them by now.
///
/// Threads record what happens to these pairs in an update, until merge().
class UnsweptPairs
{
public:
    explicit UnsweptPairs(GridCore& core) : m_core(core), m_threads(core.workers.threads()) {}

    /// Forgets all pairs.
    void clear();

    const std::vector<RowPair>& hysteresisPairs() const { return m_hysteresisPairs; }
    void addHysteresis(RowPair pair) { m_hysteresisPairs.push_back(pair); }
    bool hasExempt() const { return !m_exempt.isEmpty(); }
    bool isExempt(std::uint64_t key) const { return m_exempt.contains(key); }
    void addExempt(std::uint64_t key) { m_exempt.insert(key); }

    /// Whether a pair that overlaps is held.
    bool isHeld(const ProxyView& view, RowPair pair) const
    {
        return mayEnter(view, pair) || isExempt(rowKey(pair));
    }

    /// Begins an update and tests the hysteresis pairs. The sweep will report those that overlap again as new.
    void beginUpdate(const ProxyView& view);

    /// Records a held pair that no longer overlaps: it stays while its boxes overlap with the margin.
    void separate(const ProxyView& view, RowPair pair, bool isWithinMargin, unsigned worker);
    void recordHysteresis(RowPair pair, unsigned worker) { m_threads[worker].hysteresis.push_back(pair); }
    void recordEndOfExemption(std::uint64_t key, unsigned worker)
    {
        m_threads[worker].noLongerExempt.push_back(key);
    }

    /// Merges what the threads recorded.
    void merge();

    std::uint64_t bytes() const;

private:
    struct alignas(64) ThreadDelta
    {
        std::vector<RowPair> hysteresis;
        std::vector<std::uint64_t> newlyExempt;
        std::vector<std::uint64_t> noLongerExempt;
    };

    GridCore& m_core;
    std::vector<RowPair> m_hysteresisPairs;
    KeySet m_exempt;
    std::vector<ThreadDelta> m_threads;
};
}  // namespace cullet
