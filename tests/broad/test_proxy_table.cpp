// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/proxy_table.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/random.h"
#include "cullet/tests/support/threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <vector>

namespace cullet::test
{
namespace
{
Array<ProxyId> dirtyRows(const ProxyView& view)
{
    return {view.dirty, view.dirty + view.dirtyCount};
}

/// Consumes the changes so far, so that the next view has later changes only.
void settle(ProxyTable& table)
{
    table.beginUpdate(0, true);
    table.endUpdate();
}

TEST(ProxyTable, IsEmptyAtFirst)
{
    ProxyTable table;
    const ProxyView view = table.beginUpdate(0.5f, false);
    EXPECT_EQ(view.size, 0u);
    EXPECT_EQ(view.dirtyCount, 0u);
    EXPECT_EQ(view.margin, 0.5f);
    EXPECT_FALSE(table.hasQueryChanges());
}

TEST(ProxyTable, StoresWhatCreateIsGiven)
{
    ProxyTable table;
    const ProxyId row = table.create(cube(1, 2), 77, {4, 8});
    EXPECT_EQ(table.box(row), cube(1, 2));
    EXPECT_EQ(table.uniqueId(row), 77u);
    EXPECT_EQ(table.filter(row).group, 4);
    EXPECT_EQ(table.filter(row).mask, 8);
    EXPECT_EQ(table.liveCount(), 1u);
    const ProxyView view = table.beginUpdate(0, true);
    EXPECT_EQ(dirtyRows(view), Array<ProxyId>{row});
    EXPECT_EQ(view.changes[row], kRowCreated);
    EXPECT_EQ(view.filters[row].mask, 8);
    EXPECT_EQ(view.uniqueIds[row], 77u);
}

TEST(ProxyTable, HidesFilterWordsOnRequest)
{
    ProxyTable table;
    table.create(cube(1, 2), 1, kEverything);
    EXPECT_EQ(table.beginUpdate(0, false).filters, nullptr);
    EXPECT_NE(table.beginUpdate(0, true).filters, nullptr);
}

TEST(ProxyTable, StoresEmptyBoxWhenBoxIsInvertedOrNan)
{
    ProxyTable table;
    const ProxyId row = table.create(cube(2, 1), 1, kEverything);
    EXPECT_EQ(table.box(row), kEmptyAabb);
    table.setBox(row, cube(0, 1));
    EXPECT_EQ(table.box(row), cube(0, 1));
    Aabb poisoned = cube(0, 1);
    poisoned.max[2] = kNan;
    table.setBox(row, poisoned);
    EXPECT_EQ(table.box(row), kEmptyAabb);
}

TEST(ProxyTable, SetsManyBoxesAndMarksThoseThatDiffer)
{
    ProxyTable table;
    std::vector<Aabb> boxes;
    Array<ProxyId> rows;
    for (std::uint32_t row = 0; row < 300; ++row)
    {
        boxes.push_back(cube(0, static_cast<float>(row)));
        table.create(boxes.back(), row + 1, kEverything);
        if (row % 3 != 0)
            rows.push_back(row);
    }
    settle(table);
    Array<ProxyId> queried;
    table.collectQueryChanges(queried);
    boxes[0] = cube(5, 6);  // not requested
    boxes[1].max[2] = 7;
    boxes[200].min[0] = -1;
    boxes[202] = cube(2, 1);
    boxes[299].max[1] = kNan;
    table.setBoxes(boxes.data(), rows.data(), rows.size());
    const Array<ProxyId> expected = {1, 200, 202, 299};
    EXPECT_EQ(dirtyRows(table.beginUpdate(0, true)), expected);
    table.collectQueryChanges(queried);
    EXPECT_EQ(queried, expected);
    EXPECT_EQ(table.changes(200), kRowMoved);
    EXPECT_EQ(table.box(0), cube(0, 0));
    EXPECT_EQ(table.box(1), boxes[1]);
    EXPECT_EQ(table.box(200), boxes[200]);
    EXPECT_EQ(table.box(202), kEmptyAabb);
    EXPECT_EQ(table.box(299), kEmptyAabb);
}

TEST(ProxyTable, QuarantinesDestroyedRowUntilUpdateEnds)
{
    ProxyTable table;
    const ProxyId row = table.create(cube(0, 1), 1, kEverything);
    settle(table);
    table.destroy(row);
    EXPECT_EQ(table.liveCount(), 0u);
    EXPECT_EQ(table.uniqueId(row), 1u);
    const ProxyId second = table.create(cube(0, 1), 2, kEverything);
    EXPECT_NE(second, row);
    const ProxyView view = table.beginUpdate(0, true);
    EXPECT_EQ(view.changes[row], kRowDestroyed);
    EXPECT_EQ(view.uniqueIds[row], 1u);
    EXPECT_EQ(view.boxes[row], kEmptyAabb);
    EXPECT_NE(table.create(cube(0, 1), 3, kEverything), row) << "the update is not over";
    table.endUpdate();
    EXPECT_EQ(table.uniqueId(row), 0u);
    EXPECT_EQ(table.create(cube(0, 1), 4, kEverything), row);
    EXPECT_EQ(table.changes(row), kRowCreated);
}

TEST(ProxyTable, AccumulatesChangesOfRowUntilUpdateEnds)
{
    ProxyTable table;
    const ProxyId row = table.create(cube(0, 1), 1, kEverything);
    table.setBox(row, cube(1, 2));
    table.setFilter(row, {2, 2});
    EXPECT_EQ(table.changes(row), kRowCreated | kRowMoved | kRowRefiltered);
    table.destroy(row);
    EXPECT_EQ(table.changes(row), kRowCreated | kRowMoved | kRowRefiltered | kRowDestroyed);
    settle(table);
    EXPECT_EQ(table.changes(row), kRowUnchanged);
}

TEST(ProxyTable, MarksRowRefilteredOnlyWhenFilterWordsDiffer)
{
    ProxyTable table;
    const ProxyId row = table.create(cube(0, 1), 1, {1, 2});
    settle(table);
    table.setFilter(row, {1, 2});
    EXPECT_EQ(table.changes(row), kRowUnchanged);
    table.setFilter(row, {1, 3});
    EXPECT_EQ(table.changes(row), kRowRefiltered);
}

TEST(ProxyTable, ListsEachDirtyRowOnceInAscendingOrder)
{
    // 20,000 rows: five blocks of 4,096, the last one not full.
    ProxyTable table;
    for (std::uint32_t i = 0; i < 20000; ++i)
        table.create(boxAt(0, 0, 0), i + 1, kEverything);
    settle(table);
    EXPECT_EQ(table.beginUpdate(0, true).dirtyCount, 0u);
    Random random(1);
    for (int round = 0; round < 20; ++round)
    {
        std::set<ProxyId> expected;
        for (std::uint32_t i = 0; i < 300; ++i)
        {
            const ProxyId edges[] = {0, 7, 8, 4095, 4096, 12287, 12288, 19999};
            const ProxyId row = i < 20 ? edges[random.below(8)] : random.below(20000);
            table.setBox(row, boxAt(1, 0, 0));
            expected.insert(row);
        }
        const ProxyView view = table.beginUpdate(0, true);
        EXPECT_EQ(dirtyRows(view), Array<ProxyId>(expected.begin(), expected.end()));
        for (const ProxyId row : expected)
            ASSERT_EQ(view.changes[row], kRowMoved);
        table.endUpdate();
    }
}

TEST(ProxyTable, ReportsUnionOfChangesOverAllRows)
{
    ProxyTable table;
    constexpr std::uint32_t kRows = 500;  // the last group of rows is incomplete
    for (std::uint32_t row = 0; row < kRows; ++row)
        table.create(cube(0, 1), row + 1, kEverything);
    EXPECT_EQ(table.beginUpdate(0, true).anyChanges, kRowCreated);
    table.endUpdate();
    EXPECT_EQ(table.beginUpdate(0, true).anyChanges, 0);
    table.endUpdate();
    for (std::uint32_t row = 0; row < kRows; ++row)
    {
        table.setBox(row, cube(1, 2));
        EXPECT_EQ(table.beginUpdate(0, true).anyChanges, kRowMoved) << row;
        table.setBox((row + 77) % kRows, cube(1, 3));
        table.setFilter(row, {2, 2});
        EXPECT_EQ(table.beginUpdate(0, true).anyChanges, kRowMoved | kRowRefiltered) << row;
        table.setFilter(row, {1, static_cast<std::int32_t>(row)});
        table.endUpdate();
        table.setFilter(row, {4, 4});
        EXPECT_EQ(table.beginUpdate(0, true).anyChanges, kRowRefiltered) << row;
        table.endUpdate();
    }
    table.destroy(499);
    table.setBox(3, cube(4, 5));
    EXPECT_EQ(table.beginUpdate(0, true).anyChanges, kRowMoved | kRowDestroyed);
}

TEST(ProxyTable, TracksChangesForQueriesIndependentlyOfUpdates)
{
    ProxyTable table;
    const ProxyId first = table.create(cube(0, 1), 1, kEverything);
    const ProxyId second = table.create(cube(0, 1), 2, kEverything);
    settle(table);
    EXPECT_TRUE(table.hasQueryChanges()) << "ending an update is not reading the changes";
    Array<ProxyId> rows = {9, 9, 9};
    table.collectQueryChanges(rows);
    EXPECT_EQ(rows, (Array<ProxyId>{first, second}));
    EXPECT_FALSE(table.hasQueryChanges());
    table.setBox(second, cube(1, 2));
    EXPECT_TRUE(table.hasQueryChanges());
    table.collectQueryChanges(rows);
    EXPECT_EQ(rows, Array<ProxyId>{second});
    EXPECT_EQ(table.beginUpdate(0, true).dirtyCount, 1u)
        << "a query does not take the change from the backend";
    table.collectQueryChanges(rows);
    EXPECT_TRUE(rows.empty());
}

TEST(ProxyTable, CollectsQueryChangesFromAnyNumberOfBlocks)
{
    constexpr std::uint32_t kBlock = 128;
    ProxyTable table;
    for (std::uint32_t i = 0; i < 100 * kBlock; ++i)
        table.create(cube(0, 1), i + 1, kEverything);
    Array<ProxyId> rows;
    table.collectQueryChanges(rows);
    EXPECT_EQ(rows.size(), table.size());
    for (const std::uint32_t blocks : {1u, 2u, 63u, 64u, 65u, 66u, 100u})
    {
        Array<ProxyId> expected;
        for (std::uint32_t i = 0; i < blocks; ++i)
            expected.push_back((99 - i) * kBlock + i);
        for (int again = 0; again < 3; ++again)
        {
            for (const ProxyId row : expected)
                table.setBox(row, cube(1, 2));
            settle(table);  // so that the blocks are marked again for the update
        }
        table.collectQueryChanges(rows);
        std::reverse(expected.begin(), expected.end());
        EXPECT_EQ(rows, expected) << blocks << " blocks";
        table.collectQueryChanges(rows);
        EXPECT_TRUE(rows.empty());
    }
}

TEST(ProxyTable, ForgetsEverythingWhenCleared)
{
    ProxyTable table;
    for (std::uint32_t i = 0; i < 5000; ++i)
        table.create(cube(0, 1), i + 1, kEverything);
    table.destroy(17);
    table.clear();
    EXPECT_EQ(table.size(), 0u);
    EXPECT_EQ(table.liveCount(), 0u);
    EXPECT_FALSE(table.hasQueryChanges());
    EXPECT_EQ(table.beginUpdate(0, true).dirtyCount, 0u);
    table.endUpdate();
    EXPECT_EQ(table.create(cube(0, 1), 1, kEverything), 0u);
    EXPECT_EQ(table.beginUpdate(0, true).dirtyCount, 1u);
}

TEST(ProxyTable, CountsItsMemory)
{
    ProxyTable table;
    for (std::uint32_t i = 0; i < 10000; ++i)
        table.create(cube(0, 1), i + 1, kEverything);
    EXPECT_GE(table.bytes(), 10000 * (sizeof(Aabb) + sizeof(Filter) + sizeof(std::uint32_t) + 2));
    EXPECT_LE(table.bytes(), 10000 * 100);
}

TEST(ProxyTable, NeedsNoMoreMemoryWhenClearedAndFilledAgain)
{
    ProxyTable table;
    std::uint64_t bytes = 0;
    for (int round = 0; round < 20; ++round)
    {
        for (std::uint32_t i = 0; i < 3000; ++i)
            table.create(cube(0, 1), i + 1, kEverything);
        settle(table);
        bytes = round == 0 ? table.bytes() : bytes;
        EXPECT_EQ(table.bytes(), bytes) << round;
        table.clear();
    }
    EXPECT_GT(bytes, 3000 * sizeof(Aabb));
}

TEST(ProxyTable, MatchesMapUnderRandomOperations)
{
    SCOPED_TRACE("seed 2");
    Random random(2);
    ProxyTable table;
    std::map<std::uint32_t, std::pair<ProxyId, Aabb>> model;  // by id
    std::uint32_t nextId = 1;
    std::uint64_t reuses = 0;
    for (int step = 0; step < 300; ++step)
    {
        for (std::uint32_t i = 0; i < 40; ++i)
        {
            const std::uint32_t kind = random.below(model.empty() ? 1 : 4);
            const auto victim = [&]
            { return std::next(model.begin(), random.below(static_cast<std::uint32_t>(model.size()))); };
            if (kind == 0)
            {
                const Aabb box = boxAt(random.unit(), 0, 0);
                const std::uint32_t before = table.size();
                const ProxyId row = table.create(box, nextId, kEverything);
                reuses += row < before ? 1 : 0;
                model[nextId++] = {row, box};
            }
            else if (kind == 1)
            {
                const auto gone = victim();
                table.destroy(gone->second.first);
                model.erase(gone);
            }
            else
            {
                const auto moved = victim();
                moved->second.second = boxAt(random.unit(), 1, 0);
                table.setBox(moved->second.first, moved->second.second);
            }
        }
        ASSERT_EQ(table.liveCount(), model.size());
        for (const auto& [id, proxy] : model)
        {
            ASSERT_EQ(table.uniqueId(proxy.first), id);
            ASSERT_EQ(table.box(proxy.first), proxy.second);
        }
        if (step % 3 == 0)
            settle(table);
    }
    EXPECT_GT(reuses, 500u);
    EXPECT_LT(table.size(), nextId / 2);
}

TEST(ProxyTable, TakesBoxesOfDifferentRowsFromSeveralThreads)
{
    constexpr std::uint32_t kCount = 40000;
    constexpr std::uint32_t kThreads = 4;
    ProxyTable table;
    for (std::uint32_t i = 0; i < kCount; ++i)
        table.create(cube(0, 1), i + 1, kEverything);
    Array<ProxyId> rows;
    settle(table);
    table.collectQueryChanges(rows);
    for (int round = 1; round <= 5; ++round)
    {
        onThreads(kThreads,
                  [&table, round](std::uint32_t thread)
                  {
                      // Neighbouring rows belong to different threads; every third row of a thread is kept.
                      Array<ProxyId> own;
                      std::vector<Aabb> boxes(kCount);
                      for (std::uint32_t row = thread; row < kCount; row += kThreads)
                      {
                          if (row % 3 == 0)
                              continue;
                          own.push_back(row);
                          boxes[row] = boxAt(static_cast<float>(row), static_cast<float>(round), 0);
                      }
                      if (round % 2 == 0)
                          table.setBoxes(boxes.data(), own.data(), own.size());
                      for (std::size_t i = 0; round % 2 != 0 && i < own.size(); ++i)
                          table.setBox(own[i], boxes[own[i]]);
                  });
        EXPECT_TRUE(table.hasQueryChanges());
        const ProxyView view = table.beginUpdate(0, true);
        Array<ProxyId> expected;
        for (std::uint32_t row = 0; row < kCount; ++row)
        {
            if (row % 3 == 0)
                continue;
            expected.push_back(row);
            ASSERT_EQ(view.boxes[row], boxAt(static_cast<float>(row), static_cast<float>(round), 0));
        }
        EXPECT_EQ(dirtyRows(view), expected);
        table.endUpdate();
        table.collectQueryChanges(rows);
        EXPECT_EQ(rows, expected);
    }
}
}  // namespace
}  // namespace cullet::test
