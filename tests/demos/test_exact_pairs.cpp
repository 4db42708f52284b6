// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/exact_pairs.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace cullet
{
namespace
{
Pairs everyPair(const std::vector<ExactBox>& boxes)
{
    Pairs pairs;
    for (std::uint32_t a = 0; a < boxes.size(); ++a)
    {
        for (std::uint32_t b = a + 1; b < boxes.size(); ++b)
        {
            if (overlaps(boxes[a], boxes[b]))
                pairs.push_back({a, b});
        }
    }
    return pairs;
}

TEST(ExactPairs, EqualPairsOfDoubleLoopOnRandomBoxes)
{
    constexpr unsigned kSeed = 7;
    RecordProperty("seed", kSeed);
    std::mt19937 random(kSeed);
    std::uniform_real_distribution<double> place(0.0, 10.0);
    std::uniform_real_distribution<double> size(0.0, 2.0);
    std::vector<ExactBox> boxes(500);
    for (ExactBox& box : boxes)
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            box.min[axis] = place(random);
            box.max[axis] = box.min[axis] + size(random);
        }
    }
    const Pairs expected = everyPair(boxes);
    ASSERT_GT(expected.size(), 500u);
    ASSERT_LT(expected.size(), 20000u);
    EXPECT_EQ(findExactPairs(boxes), expected);
}

TEST(ExactPairs, IncludeTouchingBoxesAndExcludeInvalidOnes)
{
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const std::vector<ExactBox> boxes = {{{0, 0, 0}, {1, 1, 1}},
                                         {{1, 0, 0}, {2, 1, 1}},
                                         {{3, 0, 0}, {0, 1, 1}},
                                         {{0, nan, 0}, {1, 1, 1}},
                                         {{-1e30, -1e30, -1e30}, {1e30, 1e30, 1e30}}};
    EXPECT_EQ(findExactPairs(boxes), (Pairs{{0, 1}, {0, 4}, {1, 4}}));
}

TEST(PairDigest, DoesNotDependOnOrderButOnEveryPair)
{
    PairDigest forward;
    PairDigest backward;
    PairDigest other;
    for (std::uint32_t i = 1; i < 10; ++i)
        forward.add({i, i + 1});
    for (std::uint32_t i = 9; i > 0; --i)
        backward.add({i, i + 1});
    for (std::uint32_t i = 1; i < 10; ++i)
        other.add({i, i + 2});
    EXPECT_EQ(forward, backward);
    EXPECT_NE(forward, other);
    forward.add({1, 2});
    EXPECT_NE(forward, backward);
}
}  // namespace
}  // namespace cullet
