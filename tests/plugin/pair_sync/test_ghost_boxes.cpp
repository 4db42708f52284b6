// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_sync/ghost_boxes.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <set>

namespace cullet::test
{
namespace
{
TEST(GhostBoxes, VisitExactlyTheGhostsThatOverlap)
{
    constexpr std::uint32_t kSeed = 31;
    Random random(kSeed);
    const auto anyBox = [&] { return boxAt(random.point(0, 8)); };
    GhostBoxes ghosts;
    std::map<std::uint32_t, Aabb> expected;
    int hits = 0, nearMisses = 0;
    for (int step = 0; step < 2000; ++step)
    {
        const auto row = random.below(60);
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
        const Aabb box = anyBox();
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
}  // namespace
}  // namespace cullet::test
