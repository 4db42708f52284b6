// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/proxy_table.h"
#include "cullet/broad/queries/query_index.h"
#include "cullet/tests/support/threads.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <random>

namespace cullet::test
{
namespace
{
constexpr int kThreads = 8;
constexpr std::uint32_t kRows = 3000;

Aabb cubeOnLine(float x)
{
    return {{x - 1.0f, -1.0f, -1.0f}, {x + 1.0f, 1.0f, 1.0f}};
}

/// Boxes at a spacing of two on a line, so that each touches both neighbours.
void fill(ProxyTable& table)
{
    for (std::uint32_t i = 0; i < kRows; ++i)
        table.create(cubeOnLine(2.0f * i), i + 1, {1, -1});
}

/// Queries the neighbours of the neighbours of `row`, the inner queries from inside the outer visit; returns the number
/// of wrong answers.
int askNested(const ProxyTable& table, const QueryIndex& index, ProxyId row, bool byRay)
{
    int outer = 0;
    int inner = 0;
    const auto visit = [&](ProxyId found)
    {
        ++outer;
        index.forEachOverlap(table.box(found), [&](ProxyId) { ++inner; });
    };
    if (byRay)
    {
        const RaySegment ray = {{2.0 * row, -5, 0}, {1e18, 1, 1e18}, 10, {-1.5, 0, 0}, {1.5, 0, 0}};
        index.forEachOnRay(ray, visit);
    }
    else
    {
        index.forEachOverlap(table.box(row), visit);
    }
    return (outer == 3 ? 0 : 1) + (inner == 9 ? 0 : 1);
}

TEST(QueryIndexThreads, GetCorrectNestedAnswersWhileChangesArePending)
{
    for (const QueryMode mode : {QueryMode::Automatic, QueryMode::Tree, QueryMode::Scan})
    {
        ProxyTable table;
        const QueryIndex index(table, {mode, false});
        fill(table);
        std::atomic<int> wrong{0};
        for (int round = 0; round < 30; ++round)
        {
            SCOPED_TRACE(round);
            // All rows, a few, and none change, for every update path of the trees.
            const std::uint32_t stride = round % 3 == 0 ? 1 : round % 3 == 1 ? 400 : kRows;
            for (ProxyId row = 0; row < kRows; row += stride)
                table.setBox(row, cubeOnLine(2.0f * row));
            onThreads(kThreads,
                      [&](int t)
                      {
                          std::mt19937 engine(static_cast<unsigned>(100 * round + t));
                          for (int i = 0; i < 20; ++i)
                              wrong += askNested(table, index, 2 + engine() % (kRows - 4), i % 2 == 0);
                      });
            ASSERT_EQ(wrong, 0);
        }
        EXPECT_EQ(index.syncsTotal() > 5, mode != QueryMode::Scan);
    }
}

TEST(QueryIndexThreads, BuildTreeOfTeleportedRowsWhileOthersReadList)
{
    ProxyTable table;
    const QueryIndex index(table);
    fill(table);
    constexpr std::uint32_t kJumpers = 60;
    std::atomic<int> wrong{0};
    std::uint64_t quietBuilds = 0;
    for (std::uint32_t round = 0; round < 40; ++round)
    {
        // Two rows swap positions, so that both leave their leaves, and every position still has a box.
        for (ProxyId row = 0; row < kJumpers; ++row)
        {
            const Aabb box = table.box(row);
            table.setBox(row, table.box(kRows - 1 - row));
            table.setBox(kRows - 1 - row, box);
            index.forEachOverlap(box, [](ProxyId) {});  // many at once would get a tree at once
        }
        const std::uint64_t built = index.builtRowsTotal(), syncs = index.syncsTotal();
        onThreads(kThreads,
                  [&](int t)
                  {
                      std::mt19937 engine(static_cast<unsigned>(100 * round + t));
                      for (int i = 0; i < 100; ++i)
                          wrong += askNested(table, index, 2 + engine() % (kRows - 4), false);
                  });
        ASSERT_EQ(wrong, 0) << "round " << round;
        quietBuilds += index.builtRowsTotal() != built && index.syncsTotal() == syncs ? 1 : 0;
    }
    EXPECT_GT(quietBuilds, 5u);
}

TEST(QueryIndexThreads, SeeSingleChangeWithoutScanOfAllRows)
{
    ProxyTable table;
    const QueryIndex index(table);
    fill(table);
    for (int i = 0; i < 200; ++i)
        index.forEachOverlap(table.box(0), [](ProxyId) {});
    const std::uint64_t scanned = index.scannedRowsTotal();
    std::atomic<int> wrong{0};
    constexpr std::uint32_t kRounds = 50;
    for (std::uint32_t round = 0; round < kRounds; ++round)
    {
        table.setBox(7, cubeOnLine(-100.0f - 10.0f * round));
        onThreads(kThreads,
                  [&](int)
                  {
                      int found = 0;
                      index.forEachOverlap(cubeOnLine(-100.0f - 10.0f * round), [&](ProxyId) { ++found; });
                      wrong += found == 1 ? 0 : 1;
                  });
    }
    EXPECT_EQ(wrong, 0);
    EXPECT_LT(index.scannedRowsTotal() - scanned, kRounds * kThreads * 10u);
}

TEST(QueryIndexThreads, SetBoxesThatNextQueryFinds)
{
    ProxyTable table;
    const QueryIndex index(table, {QueryMode::Tree, false});
    fill(table);
    for (int round = 0; round < 10; ++round)
    {
        onThreads(kThreads,
                  [&](int t)
                  {
                      for (ProxyId row = static_cast<ProxyId>(t); row < kRows; row += kThreads)
                          table.setBox(row, cubeOnLine(2.0f * row + 0.25f * round));
                  });
        int found = 0;
        index.forEachOverlap({{0, 0, 0}, {1e6f, 0, 0}}, [&](ProxyId) { ++found; });
        EXPECT_EQ(found, static_cast<int>(kRows));
        found = 0;
        index.forEachOverlap({{-10, 0, 0}, {-0.99f + 0.25f * round, 0, 0}}, [&](ProxyId) { ++found; });
        EXPECT_EQ(found, 1);
    }
}
}  // namespace
}  // namespace cullet::test
