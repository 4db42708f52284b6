// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/broad/conformance/backend_cases.h"

#include "cullet/comparison/backends.h"

namespace cullet::test
{
namespace
{
/// The column grid, for scenes of any size.
BackendCase grid(const char* name, GridOptions options = {})
{
    options.flatLimit = 0;
    return {name, [options] { return makeGridBackend(options); }};
}

/// Flat arrays up to `limit` rows, then the column grid.
BackendCase flat(const char* name, std::uint32_t limit, bool baselineSimd = false)
{
    GridOptions options;
    options.flatLimit = limit;
    options.baselineSimd = baselineSimd;
    return {name, [options] { return makeGridBackend(options); }};
}

/// The lecture's grid.
BackendCase cells(const char* name, const CellsOptions& options = {})
{
    return {name, [options] { return makeCellGridBackend(options); }};
}

GridOptions withThreads(int count)
{
    GridOptions options;
    options.threads = count;
    return options;
}

GridOptions withBaselineSimd()
{
    GridOptions options;
    options.baselineSimd = true;
    return options;
}

template <class Options = GridOptions>
Options withBuckets(std::uint32_t count)
{
    Options options;
    options.bucketCount = count;
    return options;
}

template <class Options = GridOptions>
Options withCellScale(float scale)
{
    Options options;
    options.cellScale = scale;
    return options;
}

template <class Options = GridOptions>
Options withRebuildFraction(float fraction)
{
    Options options;
    options.rebuildFraction = fraction;
    return options;
}

GridOptions withLevels(std::uint32_t levels)
{
    GridOptions options;
    options.levels = levels;
    return options;
}

GridOptions withoutSettling()
{
    GridOptions options;
    options.settles = false;
    return options;
}

CellsOptions withPlacement(GridPlacement placement)
{
    CellsOptions options;
    options.placement = placement;
    return options;
}

CellsOptions withOneGrid(float rebuildFraction, float cellScale = 0)
{
    CellsOptions options = withPlacement(GridPlacement::OneGrid);
    options.rebuildFraction = rebuildFraction;
    options.cellScale = cellScale;
    return options;
}

CellsOptions withStorage(GridStorage storage, std::uint32_t bucketCount = 0)
{
    CellsOptions options = withBuckets<CellsOptions>(bucketCount);
    options.storage = storage;
    return options;
}

CellsOptions withCountedPairs(float rebuildFraction)
{
    CellsOptions options = withRebuildFraction<CellsOptions>(rebuildFraction);
    options.countsPairs = true;
    return options;
}

CellsOptions withSimpleUpdate()
{
    CellsOptions options = withRebuildFraction<CellsOptions>(1);
    options.updatesByRemoveAndAdd = true;
    return options;
}
}  // namespace

const std::vector<BackendCase>& backendCases()
{
    static const std::vector<BackendCase> cases = {
        {"Brute", [] { return makeBruteForceBackend(); }},
        grid("Grid"),
        grid("GridOneThread", withThreads(1)),
        grid("GridTwoThreads", withThreads(2)),
        grid("GridFourThreads", withThreads(4)),
        grid("GridOneBucket", withBuckets(1)),
        grid("GridSevenBuckets", withBuckets(7)),
        grid("GridCellScaleOne", withCellScale(1)),
        grid("GridCellScaleTwenty", withCellScale(20)),
        grid("GridAlwaysRebuild", withRebuildFraction(0)),
        grid("GridRebuildAtThirty", withRebuildFraction(0.3f)),
        grid("GridNeverRebuild", withRebuildFraction(1)),
        grid("GridNeverSettles", withoutSettling()),
        grid("GridOneLevel", withLevels(1)),
        grid("GridThreeLevels", withLevels(3)),
        grid("GridBaselineSimd", withBaselineSimd()),
        flat("Default", GridOptions::kMeasured),
        flat("DefaultBaselineSimd", GridOptions::kMeasured, true),
        flat("FlatBaselineSimd", 1u << 20, true),
        flat("FlatUntilForty", 40),
        cells("Cells"),
        cells("CellsOneBucket", withBuckets<CellsOptions>(1)),
        cells("CellsSevenBuckets", withBuckets<CellsOptions>(7)),
        cells("CellsHalfWidth", withCellScale<CellsOptions>(0.5f)),
        cells("CellsTwentyWide", withCellScale<CellsOptions>(20)),
        cells("CellsAlwaysRebuild", withRebuildFraction<CellsOptions>(0)),
        cells("CellsNeverRebuild", withRebuildFraction<CellsOptions>(1)),
        cells("CellsSimpleUpdate", withSimpleUpdate()),
        cells("CellsOpenAddressing", withStorage(GridStorage::OpenAddressing)),
        cells("CellsArray", withStorage(GridStorage::Array)),
        cells("CellsArrayOfSixtyFour", withStorage(GridStorage::Array, 64)),
        cells("CellsOwnLevel", withPlacement(GridPlacement::OwnLevel)),
        cells("CellsOnePoint", withPlacement(GridPlacement::OnePoint)),
        cells("UniformGrid", withOneGrid(1)),
        cells("UniformGridAlwaysRebuild", withOneGrid(0, 0.5f)),
        cells("CellsCountedPairs", withCountedPairs(-1)),
        cells("CellsCountedPairsNeverRebuild", withCountedPairs(1)),
        {"LeGrand", [] { return makeLeGrandBackend(); }},
        {"Sap", [] { return makeSapBackend(); }},
        {"Psap", [] { return makeHostPsapBackend(); }},
    };
    return cases;
}
}  // namespace cullet::test
