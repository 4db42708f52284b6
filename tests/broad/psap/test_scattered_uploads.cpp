// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Rows packed by threads while an executor picks others from the table.

#include "cullet/base/threads/ordered_parts.h"
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
}  // namespace
}  // namespace cullet::test
