// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Rows packed by threads while an executor picks others from the table.

#include "cullet/base/threads/ordered_parts.h"
#include "cullet/broad/psap/update/upload_staging.h"
#include "cullet/broad/psap/update/upload_steps.h"
#include "cullet/comparison/backends.h"
#include "cullet/cuda/host/host_exec.h"
#include "cullet/tests/support/scattered_rows.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace cullet::test
{
namespace
{
TEST(OrderedParts, TakesPartsInOrderAsSoonAsTheyAreFinished)
{
    OrderedParts parts({100, 175}, 10, 3);
    ASSERT_EQ(parts.tasks(), 8u);
    EXPECT_EQ(parts.itemsOfTask(0).begin, 100u);
    EXPECT_EQ(parts.itemsOfTask(7).begin, 170u);
    EXPECT_EQ(parts.itemsOfTask(7).end, 175u);
    std::vector<std::pair<std::uint64_t, std::uint64_t>> taken;
    const auto deliverReady = [&]
    {
        parts.deliverReady(
            [&](OrderedParts::Range items, unsigned first, unsigned end)
            {
                EXPECT_EQ(items.begin, 100 + 10 * first);
                EXPECT_GT(end, first);
                taken.emplace_back(items.begin, items.end);
            });
        return taken.size();
    };
    for (const unsigned task : {6u, 7u, 3u, 1u, 0u})
    {
        parts.finish(task);
        EXPECT_EQ(deliverReady(), 0u) << "task " << task;
    }
    parts.finish(2);
    EXPECT_EQ(deliverReady(), 1u);
    parts.finish(5);
    EXPECT_EQ(deliverReady(), 1u);
    parts.finish(4);
    EXPECT_EQ(deliverReady(), 3u);
    const std::vector<std::pair<std::uint64_t, std::uint64_t>> all = {{100, 130}, {130, 160}, {160, 175}};
    EXPECT_EQ(taken, all);
}

TEST(OrderedParts, HasNoPartsWhenRangeIsEmpty)
{
    OrderedParts parts({5, 5}, 10, 3);
    EXPECT_EQ(parts.tasks(), 0u);
    parts.deliverReady([](OrderedParts::Range, unsigned, unsigned) { FAIL(); });
}

TEST(ScatteredRows, GivePairStreamOfGridWhenPickedOrPacked)
{
    const std::uint64_t expected = scatteredStream(*makeGridBackend(), true);
    for (const int threads : {1, 4})
    {
        for (const bool isLockable : {true, false})
        {
            PsapOptions options;
            options.threads = threads;
            EXPECT_EQ(scatteredStream(*makeHostPsapBackend(options), isLockable), expected)
                << threads << " threads, " << (isLockable ? "picked and packed" : "packed");
        }
    }
}

TEST(MotionRecorder, RecordsTheLargestMotionUnlessARowIsNewOrFilteredAnew)
{
    const std::vector<Aabb> old = {boxAt(0, 0, 0), boxAt(0, 0, 0), boxAt(0, 0, 0)};
    const auto motionWith = [&](unsigned changes)
    {
        std::uint32_t motion = 0;
        const psap::MotionRecorder recorder = {&motion, nullptr, nullptr};
        recorder.record(0, boxAt(0.5f, 0, 0), kRowMoved, old.data());
        recorder.record(1, boxAt(0, -2, 1), changes, old.data());
        recorder.record(2, boxAt(0, 0, 1), kRowMoved, old.data());
        return psap::floatOf(motion);
    };
    EXPECT_NEAR(motionWith(kRowMoved), 2, 1e-5f);
    EXPECT_EQ(motionWith(kRowCreated), kInfinity);
    EXPECT_EQ(motionWith(kRowMoved | kRowRefiltered), kInfinity);
}

TEST(UploadStaging, SumsUpWhatPartsOfTheRowsHaveInCommon)
{
    using Summary = psap::UploadStaging<psap::HostExec>::Summary;
    Summary sum;
    sum.add(Summary::ofMoved());
    sum.add(Summary::ofMoved());
    EXPECT_TRUE(sum.isUniform());
    sum.add({kRowMoved | kRowRefiltered, kRowMoved, 7});
    EXPECT_FALSE(sum.isUniform());
    EXPECT_EQ(sum.anyChanges, kRowMoved | kRowRefiltered);
    EXPECT_EQ(sum.allChanges, kRowMoved);
    EXPECT_EQ(sum.largestId, 7u);
}

TEST(UploadStaging, NeedsNoChangeBitsOfRowsThatChangedInTheSameWay)
{
    psap::HostExec exec(PsapOptions{});
    psap::UploadStaging<psap::HostExec> staging;
    staging.reserve(exec, 4, true);
    ProxyTable table;
    for (std::uint32_t id = 1; id <= 4; ++id)
        table.create(boxAt(static_cast<float>(id), 0, 0), id, kEverything);
    const auto isUniform = [&](std::uint64_t begin, std::uint64_t end)
    {
        const ProxyView view = table.beginUpdate(0, true);
        const bool ofTable = staging.stageTable(view, begin, end, true, false).isUniform();
        EXPECT_EQ(staging.stageRows(view, begin, end).isUniform(), ofTable);
        EXPECT_EQ(staging.stageRowsAndBoxes(view, begin, end).isUniform(), ofTable);
        return ofTable;
    };
    EXPECT_TRUE(isUniform(0, 4)) << "all are new";
    table.endUpdate();
    for (ProxyId row = 0; row < 4; ++row)
        table.setBox(row, boxAt(0, 0, static_cast<float>(row) + 1));
    EXPECT_TRUE(isUniform(0, 4)) << "all have moved";
    table.setFilter(2, {2, 2});
    EXPECT_TRUE(isUniform(0, 2));
    EXPECT_FALSE(isUniform(0, 4)) << "one of those that have moved has other filter words";
    EXPECT_TRUE(isUniform(2, 3));
}
}  // namespace
}  // namespace cullet::test
