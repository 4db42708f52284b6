// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_sync/ghost_boxes.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <set>
#include <vector>

namespace cullet::test
{
namespace
{
/// Compares with a test of each ghost, while up to `most` ghosts are inserted, moved and erased in a cube.
void compareWithAll(std::uint32_t most, float cube, int steps)
{
    constexpr std::uint32_t kSeed = 31;
    Random random(kSeed);
    const auto anyBox = [&] { return boxAt(random.point(0, cube)); };
    GhostBoxes ghosts;
    std::map<std::uint32_t, Aabb> expected;
    int hits = 0, nearMisses = 0;
    for (int step = 0; step < steps; ++step)
    {
        const auto row = random.below(most);
        ASSERT_EQ(ghosts.contains(row), expected.count(row) == 1);
        if (expected.count(row) == 0)
            ghosts.insert(row, expected[row] = anyBox());
        else if (random.chance(0.4f))
            ghosts.set(row, expected[row] = anyBox());
        else
        {
            ghosts.erase(row);
            expected.erase(row);
        }
        if (random.chance(0.1f))
            ghosts.tighten();
        // An infinite box overlaps the lanes without a ghost, too.
        const Aabb box = step % 50 == 0
                             ? Aabb{{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity}}
                             : anyBox();
        std::multiset<std::uint32_t> visited, overlapping;
        ghosts.forEachOverlap(box, [&](std::uint32_t found) { visited.insert(found); });
        for (const auto& [ghost, ghostBox] : expected)
        {
            int axes = 0;
            for (int axis = 0; axis < 3; ++axis)
                axes += box.min[axis] <= ghostBox.max[axis] && ghostBox.min[axis] <= box.max[axis];
            if (axes == 3)
                overlapping.insert(ghost);
            nearMisses += axes == 2;
        }
        ASSERT_EQ(visited, overlapping) << "seed " << kSeed << ", step " << step;
        ASSERT_EQ(ghosts.size(), expected.size());
        hits += static_cast<int>(overlapping.size());
    }
    EXPECT_GT(hits, 200);
    EXPECT_GT(nearMisses, 2000);
}

TEST(GhostBoxes, VisitExactlyTheGhostsThatOverlap)
{
    compareWithAll(7, 3, 2000);
    compareWithAll(60, 8, 2000);
    compareWithAll(900, 20, 6000);
}

TEST(GhostBoxes, TestFewBlocksWhereManyGhostsRestOrMove)
{
    constexpr std::uint32_t kSeed = 32, kGhosts = 10000;
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    Random random(kSeed);
    GhostBoxes ghosts;
    const auto anyBox = [&] { return boxAt(random.point(0, 60)); };
    const auto meanTests = [&]
    {
        std::uint32_t tests = 0, hits = 0;
        for (int query = 0; query < 200; ++query)
            tests += ghosts.forEachOverlap(anyBox(), [&](std::uint32_t) { ++hits; });
        EXPECT_GT(hits, 20u);
        return tests / 200;
    };
    for (std::uint32_t row = 0; row < kGhosts; ++row)
        ghosts.insert(row, anyBox());
    ghosts.tighten();
    // Of 1,250 blocks of ghosts and 180 above them; about 10 blocks of each level meet a box.
    EXPECT_LT(meanTests(), 40u);
    for (int frame = 0; frame < 3; ++frame)
    {
        for (std::uint32_t row = 0; row < kGhosts; ++row)
            ghosts.set(row, anyBox());
        EXPECT_GT(meanTests(), 100u) << "bounds that hold two places";
        ghosts.tighten();
        EXPECT_LT(meanTests(), 40u);
    }
    for (std::uint32_t row = 0; row < kGhosts; row += 2)
        ghosts.erase(row);
    ghosts.tighten();
    ghosts.tighten();
    EXPECT_LT(meanTests(), 60u);
}
}  // namespace
}  // namespace cullet::test
