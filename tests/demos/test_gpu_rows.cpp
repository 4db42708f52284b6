// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/cuda/cuda_floor.h"
#include "cullet/demos/scenes/fresh_boxes.h"

#include <gtest/gtest.h>

#include <array>

namespace cullet
{
namespace
{
constexpr std::uint64_t kMillion = 1u << 20;

TEST(GpuFloors, CountBytesOfUpdatesWhenAllBoxesMove)
{
    const UpdateWork work = {kMillion, kMillion, 1000000, 51000};
    EXPECT_EQ(leastForStage("upload", work).bus, 24 * kMillion);
    EXPECT_EQ(leastForStage("upload", work).device, 74 * kMillion);
    EXPECT_EQ(leastForStage("sort", work).device, 56 * kMillion);
    EXPECT_EQ(leastForStage("settle", work).device, 64u * 1000000);
    EXPECT_EQ(leastForStage("search", work).device, 32 * kMillion);
    EXPECT_EQ(leastForStage("deltas", work).bus, 8u * 51000);
    EXPECT_EQ(leastForStage("another", work).all(), 0u);
    EXPECT_EQ(leastForPairs(1000, 10).all(), 24080u);
}

TEST(GpuFloors, CountBytesOfUpdatesWhenSomeBoxesMove)
{
    const UpdateWork work = {1000, 100, 10000, 5};
    EXPECT_EQ(leastForStage("upload", work).bus, 28u * 100);
    // 0.19 of the pairs have a box that moved.
    EXPECT_NEAR(static_cast<double>(leastForStage("settle", work).all()), 18.0 * 10000 + 48 * 1900, 100);
}

TEST(GpuFloors, EqualTimeToCopyAsManyBytes)
{
    const CopySpeed speed = {4e9, 5e7};
    EXPECT_DOUBLE_EQ(speed.floorOf({8000000000, 100000000}), 4.0);
    EXPECT_DOUBLE_EQ(CopySpeed{}.floorOf({8, 8}), 0.0);
}

TEST(FreshBoxes, RepeatForSameSeedAndDifferForAnother)
{
    for (const auto make :
         {uniformBoxes, boxesOfManySizes, heapOfBoxes, flatBoxes, boxesOnOneLine, boxesUnderOne})
    {
        const auto placeOfLast = [&](std::uint64_t seed)
        {
            const Aabb box = make(100, seed).at(99);
            return std::array<float, 3>{box.min[0], box.min[1], box.min[2]};
        };
        EXPECT_EQ(placeOfLast(1), placeOfLast(1));
        EXPECT_NE(placeOfLast(1), placeOfLast(2));
    }
}

TEST(FreshBoxes, ShareOneExtentAlongAxisOfFlatScenes)
{
    int axis = 0;
    for (const auto make : {flatBoxes, flatBoxesY, flatBoxesZ})
    {
        for (const Aabb& box : make(100, 1))
        {
            EXPECT_EQ(box.min[axis], -1.0f);
            EXPECT_EQ(box.max[axis], 1.0f);
        }
        EXPECT_NE(make(100, 1)[0].min[(axis + 1) % 3], make(100, 1)[1].min[(axis + 1) % 3]);
        ++axis;
    }
}

TEST(FreshBoxes, LieUnderFirstBoxInSceneUnderOne)
{
    const std::vector<Aabb> boxes = boxesUnderOne(1000, 1);
    for (const Aabb& box : boxes)
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            EXPECT_LE(boxes[0].min[axis], box.min[axis]);
            EXPECT_GE(boxes[0].max[axis], box.max[axis]);
        }
    }
}
}  // namespace
}  // namespace cullet
