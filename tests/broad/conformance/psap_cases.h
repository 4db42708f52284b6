// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/broad/conformance/backend_cases.h"

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
    const std::string& prefix, const std::function<std::unique_ptr<Backend>(const PsapOptions&)>& make,
    bool withComparators = true)
{
    std::vector<BackendCase> cases;
    const auto add = [&](const char* name, const std::function<void(PsapOptions&)>& change)
    {
        PsapOptions options;
        change(options);
        cases.push_back({prefix + name, [make, options] { return make(options); }});
    };
    add("Rows", [](PsapOptions&) {});
    add("RowsCapacityOne", [](PsapOptions& options) { options.initialCapacity = 1; });
    const auto addOrdered = [&](const char* name, PsapOrder order,
                                std::uint32_t capacity = PsapOptions{}.initialCapacity,
                                PsapRowSearch search = PsapRowSearch::Automatic)
    {
        add(name,
            [&](PsapOptions& options)
            {
                options.order = order;
                options.initialCapacity = capacity;
                options.rowSearch = search;
            });
    };
    addOrdered("RowsRadix", PsapOrder::Radix);
    addOrdered("RowsCounting", PsapOrder::Counting);
    addOrdered("RowsGrouped", PsapOrder::Counting, PsapOptions{}.initialCapacity, PsapRowSearch::Grouped);
    addOrdered("RowsGroupedRadixCapacityOne", PsapOrder::Radix, 1, PsapRowSearch::Grouped);
    addOrdered("RowsBins", PsapOrder::Bins);
    addOrdered("RowsBinsCapacityOne", PsapOrder::Bins, 1);
    addOrdered("RowsTiles", PsapOrder::Tiles);
    addOrdered("RowsTilesCapacityOne", PsapOrder::Tiles, 1);
    const auto addPlannedOften =
        [&](const char* name, PsapOrder order, std::uint32_t capacity = PsapOptions{}.initialCapacity)
    {
        add(name,
            [&](PsapOptions& options)
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
    const auto addNear = [&](const char* name, const std::function<void(PsapOptions&)>& change)
    {
        add(name,
            [&](PsapOptions& options)
            {
                options.nearPairs = PsapNearPairs::Always;
                change(options);
            });
    };
    addNear("RowsNear", [](PsapOptions&) {});
    addNear("RowsNearCapacityOne", [](PsapOptions& options) { options.initialCapacity = 1; });
    addNear("RowsNearTilesPlannedOften",
            [](PsapOptions& options)
            {
                options.order = PsapOrder::Tiles;
                options.updatesPerPlan = 1;
            });
    addNear("LiteralNear", [](PsapOptions& options) { options.variant = PsapVariant::Literal; });
    add("RowsAxisX", [](PsapOptions& options) { options.axis = PsapAxis::X; });
    add("RowsAxisY", [](PsapOptions& options) { options.axis = PsapAxis::Y; });
    add("RowsAxisZ", [](PsapOptions& options) { options.axis = PsapAxis::Z; });
    add("RowsAxisRandom",
        [](PsapOptions& options)
        {
            options.axis = PsapAxis::Random;
            options.seed = 7;
        });
    add("RowsSmallCells",
        [](PsapOptions& options)
        {
            options.cellScale = 0.3f;
            options.binScale = 0.1f;
        });
    add("RowsLargeCells",
        [](PsapOptions& options)
        {
            options.cellScale = 20;
            options.binScale = 20;
        });
    add("RowsSmallCellsLongBins",
        [](PsapOptions& options)
        {
            options.cellScale = 0.05f;
            options.binScale = 20;
        });
    add("Literal", [](PsapOptions& options) { options.variant = PsapVariant::Literal; });
    add("LiteralCapacityOne",
        [](PsapOptions& options)
        {
            options.variant = PsapVariant::Literal;
            options.initialCapacity = 1;
        });
    add("LiteralThesisCells",
        [](PsapOptions& options)
        {
            options.variant = PsapVariant::Literal;
            options.cells = PsapCells::Thesis;
            options.axis = PsapAxis::Y;
        });
    add("LiteralManyCells",
        [](PsapOptions& options)
        {
            options.variant = PsapVariant::Literal;
            options.cells = PsapCells::FixedCount;
            options.cellCount = 5000;
            options.axis = PsapAxis::Z;
        });
    if (!withComparators)
        return cases;
    const auto addLiteral = [&](const char* name, const std::function<void(PsapOptions&)>& change)
    {
        add(name,
            [&](PsapOptions& options)
            {
                options.variant = PsapVariant::Literal;
                change(options);
            });
    };
    addLiteral("LiteralAxisX", [](PsapOptions& options) { options.axis = PsapAxis::X; });
    addLiteral("LiteralAxisRandom",
               [](PsapOptions& options)
               {
                   options.axis = PsapAxis::Random;
                   options.seed = 9;
               });
    addLiteral("LiteralPrincipal", [](PsapOptions& options) { options.axis = PsapAxis::Principal; });
    addLiteral("LiteralBitStrings", [](PsapOptions& options) { options.bitStrings = true; });
    addLiteral("LiteralSplitWork",
               [](PsapOptions& options)
               {
                   options.splitWork = true;
                   options.cells = PsapCells::Thesis;
               });
    addLiteral("LiteralEverything",
               [](PsapOptions& options)
               {
                   options.axis = PsapAxis::Principal;
                   options.bitStrings = options.splitWork = true;
                   options.cells = PsapCells::FixedCount;
                   options.cellCount = 20;
               });
    addLiteral("Shifted",
               [](PsapOptions& options)
               {
                   options.variant = PsapVariant::Shifted;
                   options.cells = PsapCells::FixedCount;
                   options.cellCount = 1000;
               });
    return cases;
}
}  // namespace cullet::test
