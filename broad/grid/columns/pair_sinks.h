// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/grid/columns/column_grid.h"
#include "cullet/broad/huge_vector.h"

#include <vector>

namespace cullet
{
/// Collects pairs per worker.
class CollectingSink final : public PairSink
{
public:
    explicit CollectingSink(unsigned workers) : m_lists(workers) {}

    void take(unsigned worker, const PairBuffer& found) override
    {
        for (std::uint32_t i = 0; i < found.count; ++i)
            m_lists[worker].pairs.push_back(found.pair(i));
    }

    void add(RowPair pair) { m_lists[0].pairs.push_back(pair); }

    /// Calls visit(pair) for every pair, worker by worker.
    template <class Visit>
    void forEach(Visit visit) const
    {
        for (const List& list : m_lists)
        {
            for (const RowPair pair : list.pairs)
                visit(pair);
        }
    }

private:
    struct alignas(64) List
    {
        HugeVector<RowPair> pairs;
    };

    std::vector<List> m_lists;
};
}  // namespace cullet
