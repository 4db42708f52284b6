// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/broad/pairs/pair_sort.h"
#include "cullet/broad/pairs/pair_tests.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// The changes of the pair set in one update of the grid, as keys of unique ids that each thread records.
///
/// A pair that is held by the margin and overlaps again is recorded as added twice, which cancels.
class GridDelta
{
public:
    explicit GridDelta(ParallelLoops& workers);

    void clear();

    KeyList& added(unsigned worker) { return m_added[worker]; }
    KeyList& removed(unsigned worker) { return m_removed[worker]; }
    void add(const ProxyView& view, RowPair pair, unsigned worker = 0)
    {
        m_added[worker].push(idsOf(view, pair));
    }
    void remove(const ProxyView& view, RowPair pair, unsigned worker = 0)
    {
        m_removed[worker].push(idsOf(view, pair));
    }

    /// For VerletPairs: records in the lists of a thread which pairs enter and leave the pair set.
    auto reporter(const ProxyView& view, unsigned worker = 0)
    {
        return [this, &view, worker](RowPair pair, bool isHeld)
        { isHeld ? add(view, pair, worker) : remove(view, pair, worker); };
    }

    /// Sorts the changes into `delta`. Where there are few of them or few threads, one thread sorts the added pairs and
    /// another one the removed pairs.
    void write(PairDelta& delta);

    /// Sorts other keys with the same memory, before write().
    PairSort& sorter() { return m_sorts[0]; }

    std::uint64_t bytes() const;

private:
    ParallelLoops& m_workers;
    ParallelLoops m_serialLoops;              ///< a single thread
    std::vector<KeyList> m_added, m_removed;  ///< [threads]
    PairSort m_sorts[2];
};
}  // namespace cullet
