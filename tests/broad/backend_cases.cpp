// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "tests/broad/backend_cases.h"

#include "broad/cell_grid_backend.h"

namespace cullet::test
{
namespace
{
BackendCase cells(const char* name, const GridOptions& options = {})
{
    return {name, [options] { return makeCellGridBackend(options); }};
}

GridOptions withBuckets(std::uint32_t count)
{
    GridOptions options;
    options.bucketCount = count;
    return options;
}

GridOptions withCellScale(float scale)
{
    GridOptions options;
    options.cellScale = scale;
    return options;
}

GridOptions withRebuildFraction(float fraction)
{
    GridOptions options;
    options.rebuildFraction = fraction;
    return options;
}
}  // namespace

const std::vector<BackendCase>& backendCases()
{
    static const std::vector<BackendCase> cases = {
        {"Brute", [] { return makeBruteForceBackend(); }},
        cells("Cells"),
        cells("CellsOneBucket", withBuckets(1)),
        cells("CellsSevenBuckets", withBuckets(7)),
        cells("CellsHalfWidth", withCellScale(0.5f)),
        cells("CellsTwentyWide", withCellScale(20)),
        cells("CellsAlwaysRebuild", withRebuildFraction(0)),
        cells("CellsNeverRebuild", withRebuildFraction(1)),
    };
    return cases;
}
}  // namespace cullet::test
