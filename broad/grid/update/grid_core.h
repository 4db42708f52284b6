// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/broad/backend.h"
#include "cullet/broad/grid/columns/column_grid.h"
#include "cullet/broad/grid/update/grid_delta.h"
#include "cullet/broad/huge_vector.h"
#include "cullet/broad/pairs/sorted_pairs.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// What sweep mode and resting mode have in common: the columns, a reference box of each row, and the output.
struct GridCore
{
    explicit GridCore(const GridOptions& gridOptions)
        : options(gridOptions),
          kernels(chooseColumnKernels(gridOptions.baselineSimd)),
          workers(gridOptions.threads),
          grid(gridOptions, workers),
          delta(workers),
          found(workers.threads())
    {
    }

    void recordDecision(const char* reason, std::size_t strays, double cost, double otherCost)
    {
        stats.decision.reason = reason;
        stats.decision.strays = static_cast<std::uint32_t>(strays);
        stats.decision.cost = cost;
        stats.decision.otherCost = otherCost;
    }

    /// Sets heldBefore.
    void sortHeldBefore(const std::vector<RowPair>& pairs);
    /// Frees heldBefore, which may have had all pairs.
    void freeHeldBefore();

    std::uint64_t bytes() const;

    const GridOptions options;
    const ColumnKernels& kernels;
    ParallelLoops workers;
    ColumnGrid grid;  ///< all boxes (sweep mode), or the resting ones (resting mode)
    /// [rows] boxes of the last update (sweep mode), or centres of the skins (resting mode); NaN without a box
    HugeVector<Aabb> reference;
    GridDelta delta;
    SortedPairs heldBefore;      ///< while pairs are classified anew: those held so far, by rows
    std::vector<KeyList> found;  ///< [threads] keys of rows that are to be sorted
    BackendStats stats;

private:
    PairKeys m_keys;  // memory for the next heldBefore
};
}  // namespace cullet
