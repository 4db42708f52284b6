// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/broad/conformance/backend_cases.h"
#include "cullet/tests/support/search_options.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace cullet::test
{
/// The variants and options of the sweep-and-prune backends, named by `prefix` and the option.
/// @param withComparators also the options that serve for comparison
inline std::vector<BackendCase> psapCases(
    const std::string& prefix, const std::function<std::unique_ptr<Backend>(const SearchOptions&)>& make,
    bool withComparators = true)
{
    std::vector<BackendCase> cases;
    const auto add = [&](const char* name, const std::function<void(SearchOptions&)>& change)
    {
        SearchOptions options;
        change(options);
        cases.push_back({prefix + name, [make, options] { return make(options); }});
    };
    add("Rows", [](SearchOptions&) {});
    add("RowsCapacityOne", [](SearchOptions& options) { options.initialCapacity = 1; });
    const auto addOrdered = [&](const char* name, PsapOrder order,
                                std::uint32_t capacity = SearchOptions{}.initialCapacity,
                                PsapRowSearch search = PsapRowSearch::Automatic)
    {
        add(name,
            [&](SearchOptions& options)
            {
                options.order = order;
                options.initialCapacity = capacity;
                options.rowSearch = search;
            });
    };
    addOrdered("RowsCounting", PsapOrder::Counting);
    addOrdered("RowsGrouped", PsapOrder::Counting, SearchOptions{}.initialCapacity, PsapRowSearch::Grouped);
    addOrdered("RowsGroupedCapacityOne", PsapOrder::Counting, 1, PsapRowSearch::Grouped);
    addOrdered("RowsBins", PsapOrder::Bins);
    addOrdered("RowsBinsCapacityOne", PsapOrder::Bins, 1);
    addOrdered("RowsTiles", PsapOrder::Tiles);
    addOrdered("RowsTilesCapacityOne", PsapOrder::Tiles, 1);
    const auto addPlannedOften =
        [&](const char* name, PsapOrder order, std::uint32_t capacity = SearchOptions{}.initialCapacity)
    {
        add(name,
            [&](SearchOptions& options)
            {
                options.order = order;
                options.updatesPerPlan = 1;
                options.initialCapacity = capacity;
            });
    };
    addPlannedOften("RowsCountingPlannedOften", PsapOrder::Counting);
    addPlannedOften("RowsCountingPlannedOftenCapacityOne", PsapOrder::Counting, 1);
    addPlannedOften("RowsBinsPlannedOften", PsapOrder::Bins);
    addPlannedOften("RowsTilesPlannedOften", PsapOrder::Tiles);
    const auto addNear = [&](const char* name, const std::function<void(SearchOptions&)>& change)
    {
        add(name,
            [&](SearchOptions& options)
            {
                options.nearPairs = PsapNearPairs::Always;
                change(options);
            });
    };
    addNear("RowsNear", [](SearchOptions&) {});
    addNear("RowsNearCapacityOne", [](SearchOptions& options) { options.initialCapacity = 1; });
    addNear("RowsNearTilesPlannedOften",
            [](SearchOptions& options)
            {
                options.order = PsapOrder::Tiles;
                options.updatesPerPlan = 1;
            });
    addNear("LiteralNear", [](SearchOptions& options) { options.isThesis = true; });
    add("RowsAxisX", [](SearchOptions& options) { options.axis = PsapAxis::X; });
    add("RowsAxisY", [](SearchOptions& options) { options.axis = PsapAxis::Y; });
    add("RowsAxisZ", [](SearchOptions& options) { options.axis = PsapAxis::Z; });
    add("RowsAxisRandom",
        [](SearchOptions& options)
        {
            options.axis = PsapAxis::Random;
            options.seed = 7;
        });
    add("RowsSmallCells",
        [](SearchOptions& options)
        {
            options.cellScale = 0.3f;
            options.binScale = 0.1f;
        });
    add("RowsLargeCells",
        [](SearchOptions& options)
        {
            options.cellScale = 20;
            options.binScale = 20;
        });
    add("RowsSmallCellsLongBins",
        [](SearchOptions& options)
        {
            options.cellScale = 0.05f;
            options.binScale = 20;
        });
    add("Literal", [](SearchOptions& options) { options.isThesis = true; });
    add("LiteralCapacityOne",
        [](SearchOptions& options)
        {
            options.isThesis = true;
            options.initialCapacity = 1;
        });
    add("LiteralThesisCells",
        [](SearchOptions& options)
        {
            options.isThesis = true;
            options.cells = ThesisCells::Thesis;
            options.axis = PsapAxis::Y;
        });
    add("LiteralManyCells",
        [](SearchOptions& options)
        {
            options.isThesis = true;
            options.cells = ThesisCells::FixedCount;
            options.cellCount = 5000;
            options.axis = PsapAxis::Z;
        });
    if (!withComparators)
        return cases;
    const auto addLiteral = [&](const char* name, const std::function<void(SearchOptions&)>& change)
    {
        add(name,
            [&](SearchOptions& options)
            {
                options.isThesis = true;
                change(options);
            });
    };
    addLiteral("LiteralAxisX", [](SearchOptions& options) { options.axis = PsapAxis::X; });
    addLiteral("LiteralAxisRandom",
               [](SearchOptions& options)
               {
                   options.axis = PsapAxis::Random;
                   options.seed = 9;
               });
    addLiteral("LiteralPrincipal", [](SearchOptions& options) { options.isAxisPrincipal = true; });
    addLiteral("LiteralBitStrings", [](SearchOptions& options) { options.bitStrings = true; });
    addLiteral("LiteralSplitWork",
               [](SearchOptions& options)
               {
                   options.splitWork = true;
                   options.cells = ThesisCells::Thesis;
               });
    addLiteral("LiteralEverything",
               [](SearchOptions& options)
               {
                   options.isAxisPrincipal = true;
                   options.bitStrings = options.splitWork = true;
                   options.cells = ThesisCells::FixedCount;
                   options.cellCount = 20;
               });
    addLiteral("Shifted",
               [](SearchOptions& options)
               {
                   options.isThesis = options.isShifted = true;
                   options.cells = ThesisCells::FixedCount;
                   options.cellCount = 1000;
               });
    return cases;
}
}  // namespace cullet::test
