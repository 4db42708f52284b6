// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/backend.h"
#include "cullet/broad/proxy_table.h"
#include "cullet/comparison/backends.h"
#include "cullet/tests/support/boxes.h"

#include <gtest/gtest.h>

#include <string>

namespace cullet::test
{
namespace
{
std::string stagesOf(Backend& backend, ProxyTable& table)
{
    PairDelta delta;
    EXPECT_EQ(backend.update(table.beginUpdate(0, true), delta), Status::Ok);
    table.endUpdate();
    std::string names;
    for (const StageTime& stage : backend.stats().stages)
    {
        EXPECT_GE(stage.milliseconds, 0);
        names += std::string(stage.name) + " ";
    }
    return names;
}

/// Bodies in a row, each touching the next one.
void addRow(ProxyTable& table)
{
    for (std::uint32_t body = 0; body < 100; ++body)
        table.create(cube(static_cast<float>(body), static_cast<float>(body) + 1.5f), body + 1, kEverything);
}

TEST(PsapStats, ReportStageTimesOnlyWhenEnabled)
{
    ProxyTable table;
    addRow(table);
    PsapOptions options;
    const auto untimed = makeHostPsapBackend(options);
    options.timeStages = true;
    const auto timed = makeHostPsapBackend(options);
    EXPECT_EQ(stagesOf(*untimed, table), "");
    timed->restart({});
    table.setBox(0, cube(0, 1));
    EXPECT_EQ(stagesOf(*timed, table), "upload sort settle search deltas ");
    EXPECT_EQ(stagesOf(*timed, table), "") << "nothing changed, nothing was done";
}

TEST(PsapStats, CountRetriesOnlyWhenListIsTooShort)
{
    ProxyTable table;
    addRow(table);
    PsapOptions options;
    const auto roomy = makeHostPsapBackend(options);
    options.initialCapacity = 1;
    const auto narrow = makeHostPsapBackend(options);
    stagesOf(*roomy, table);
    EXPECT_EQ(roomy->stats().retriesTotal, 0u);
    stagesOf(*narrow, table);
    const std::uint64_t retries = narrow->stats().retriesTotal;
    EXPECT_GT(retries, 0u);
    table.setBox(0, cube(0, 1.6f));
    stagesOf(*narrow, table);
    EXPECT_EQ(narrow->stats().retriesTotal, retries) << "as much room as the update before needed";
}
}  // namespace
}  // namespace cullet::test
