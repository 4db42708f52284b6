// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/comparison/device_finders.h"
#include "cullet/cuda/device_pairs.h"
#include "cullet/tests/support/search_options.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

namespace cullet::test
{
/// Options of a search on the device, under a name made of letters.
struct NamedOptions
{
    std::string name;
    SearchOptions options;
};

inline void PrintTo(const NamedOptions& value, std::ostream* stream)
{
    *stream << value.name;
}

inline std::string nameOf(const testing::TestParamInfo<NamedOptions>& info)
{
    return info.param.name;
}

inline SearchOptions rowOptions(PsapOrder order, PsapRowSearch search = PsapRowSearch::Automatic)
{
    SearchOptions options;
    options.order = order;
    options.rowSearch = search;
    return options;
}

inline std::unique_ptr<DevicePairFinder> makeFinder(const SearchOptions& options)
{
    return options.isThesis ? makeThesisPairFinder(options, nullptr, nullptr)
                            : makeDevicePairFinder(options, nullptr, nullptr);
}

/// A new plan begins as soon as the last one is complete.
inline SearchOptions plannedOften(PsapOrder order)
{
    SearchOptions options = rowOptions(order);
    options.updatesPerPlan = 1;
    return options;
}

/// Neighbour lists are used for few boxes, too.
inline SearchOptions keepingNear()
{
    SearchOptions options;
    options.nearPairs = PsapNearPairs::Always;
    return options;
}

/// The number of frames, at least as many as are needed for one asynchronous plan, or to use a neighbour list.
inline int framesWithPlan(const SearchOptions& options, int frames)
{
    constexpr int kStepsToPlan = 13, kStepsToFollow = 8;
    if (options.updatesPerPlan == 1)
        return kStepsToPlan;
    return options.nearPairs == PsapNearPairs::Always ? std::max(frames, kStepsToFollow) : frames;
}

/// Every sorting and search method of the rows variant.
inline std::vector<NamedOptions> rowVariants()
{
    return {{"Automatic", {}},
            {"Counting", rowOptions(PsapOrder::Counting)},
            {"Bins", rowOptions(PsapOrder::Bins)},
            {"Tiles", rowOptions(PsapOrder::Tiles)},
            {"Grouped", rowOptions(PsapOrder::Counting, PsapRowSearch::Grouped)},
            {"BinsPlannedOften", plannedOften(PsapOrder::Bins)},
            {"TilesPlannedOften", plannedOften(PsapOrder::Tiles)}};
}

/// rowVariants() and the thesis's search.
inline std::vector<NamedOptions> allOrders()
{
    std::vector<NamedOptions> all = rowVariants();
    all.push_back({"Literal", thesisSearch()});
    return all;
}

/// allOrders() and each single option of the thesis's search.
inline std::vector<NamedOptions> allVariants()
{
    std::vector<NamedOptions> all = allOrders();
    SearchOptions options = thesisSearch();
    options.bitStrings = true;
    all.push_back({"BitStrings", options});
    options = thesisSearch();
    options.splitWork = true;
    all.push_back({"SplitWork", options});
    options = thesisSearch();
    options.isAxisPrincipal = true;
    all.push_back({"Principal", options});
    return all;
}
}  // namespace cullet::test
