// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_sync/ghost_neighbours.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr Aabb kReach = {{0, 0, 0}, {1, 1, 1}};

/// The rows that are tested when the ghost moves, each once.
std::map<std::uint32_t, int> testedRows(const GhostNeighbours& neighbours, std::uint32_t ghost)
{
    std::map<std::uint32_t, int> rows;
    neighbours.forEachUnpaired(ghost, [&](std::uint32_t row) { ++rows[row]; });
    return rows;
}

TEST(GhostNeighbours, TestOnlyRowsWhosePairIsNotInCache)
{
    GhostNeighbours neighbours;
    ASSERT_TRUE(neighbours.begin(3, kReach));
    for (const std::uint32_t row : {10u, 20u, 30u, 40u})
        neighbours.add(3, row);
    EXPECT_EQ(testedRows(neighbours, 3).size(), 4u);
    neighbours.setPaired(20, 3, true);
    neighbours.setPaired(3, 40, true);
    EXPECT_EQ(testedRows(neighbours, 3), (std::map<std::uint32_t, int>{{10, 1}, {30, 1}}));
    neighbours.setPaired(3, 20, false);
    EXPECT_EQ(testedRows(neighbours, 3), (std::map<std::uint32_t, int>{{10, 1}, {20, 1}, {30, 1}}));
    neighbours.add(3, 40);
    EXPECT_EQ(testedRows(neighbours, 3).count(40), 1u) << "a row that is added again";
    neighbours.setPaired(3, 10, true);
    neighbours.forgetPaired();
    EXPECT_EQ(testedRows(neighbours, 3).size(), 4u);
}

TEST(GhostNeighbours, ArePairedAsSetWhateverTheOrderOfCalls)
{
    const std::uint32_t seed = 40;
    Random random(seed);
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    GhostNeighbours neighbours;
    std::map<std::uint32_t, int> tested;  ///< 0: paired
    ASSERT_TRUE(neighbours.begin(0, kReach));
    int pairedSum = 0;
    for (int call = 0; call < 2000; ++call)
    {
        const std::uint32_t row = 1 + random.below(40);
        const std::uint32_t kind = random.below(4);
        if (kind == 0)
        {
            neighbours.add(0, row);
            tested[row] = 1;
        }
        else
        {
            neighbours.setPaired(0, row, kind == 1);
            if (tested.count(row) != 0)
                tested[row] = kind == 1 ? 0 : 1;
        }
        std::map<std::uint32_t, int> expected;
        for (const auto& [listed, isTested] : tested)
        {
            if (isTested != 0)
                expected[listed] = 1;
            pairedSum += 1 - isTested;
        }
        ASSERT_EQ(testedRows(neighbours, 0), expected);
    }
    EXPECT_EQ(tested.size(), 40u);
    EXPECT_GT(pairedSum, 10000);
}
}  // namespace
}  // namespace cullet::test
