// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The pairs do not depend on the order and search of boxes, the axis, or the sizes of cells and blocks, and they are
// the same in every run.

#include "cullet/demos/scenes/fresh_boxes.h"
#include "cullet/tests/cuda/support/box_frames.h"
#include "cullet/tests/cuda/support/device_boxes.h"
#include "cullet/tests/cuda/support/named_options.h"
#include "cullet/tests/cuda/support/pair_sums.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr PsapAxis kAxes[] = {PsapAxis::X, PsapAxis::Y, PsapAxis::Z, PsapAxis::Variance, PsapAxis::Random};
constexpr int kRuns = 20;

/// The options with each axis and three sizes of cells.
std::vector<NamedOptions> withAxesAndCells(const SearchOptions& options)
{
    std::vector<NamedOptions> all;
    for (const PsapAxis axis : kAxes)
    {
        for (const std::uint32_t size : {1u, 2u, 4u})
        {
            SearchOptions changed = options;
            changed.axis = axis;
            changed.seed = size;
            changed.cellScale = changed.binScale = 0.5f * static_cast<float>(size);
            changed.cells = ThesisCells::FixedCount;  // for the thesis's search, which has no scales
            changed.cellCount = 50 * size * size;
            all.push_back(
                {"axis " + std::to_string(static_cast<int>(axis)) + ", size " + std::to_string(size),
                 changed});
        }
    }
    return all;
}

class CudaIndependence : public testing::TestWithParam<NamedOptions>
{
};

TEST_P(CudaIndependence, GivesSamePairsForEveryAxisAndCellSize)
{
    for (const SceneKind kind : {SceneKind::Uniform, SceneKind::ManySizes, SceneKind::Pile})
    {
        const BoxFrames frames = framesOf(kind, 20000, 4);
        const PairStream expected = follow(*makeGridBackend(), frames);
        EXPECT_GT(expected.added, 10000u);
        EXPECT_GT(expected.removed, 0u);
        for (const NamedOptions& changed : withAxesAndCells(GetParam().options))
        {
            SCOPED_TRACE(std::string(sceneName(kind)) + ", " + changed.name);
            EXPECT_EQ(follow(*makeCudaBackend(changed.options), frames), expected);
        }
    }
}

TEST_P(CudaIndependence, GivesSamePairsForEveryBlockSize)
{
    const BoxFrames frames = framesOf(SceneKind::ManySizes, 20000, 4);
    const PairStream expected = follow(*makeGridBackend(), frames);
    EXPECT_GT(expected.added, 10000u);
    // Less than a warp, whole warps, no power of two, and more than the limit of a block.
    for (const std::uint32_t threads : {1u, 32u, 100u, 128u, 192u, 1u << 20})
    {
        SearchOptions options = GetParam().options;
        options.blockThreads = threads;
        EXPECT_EQ(follow(*makeCudaBackend(options), frames), expected) << threads;
    }
}

TEST_P(CudaIndependence, GivesSamePairsInTwentyRuns)
{
    const BoxFrames frames = framesOf(SceneKind::ManySizes, 1u << 17, 3);
    const PairStream expected = follow(*makeGridBackend(), frames);
    EXPECT_GT(expected.added, 500000u);
    for (int run = 0; run < kRuns; ++run)
        ASSERT_EQ(follow(*makeCudaBackend(GetParam().options), frames), expected) << run;
}

TEST_P(CudaIndependence, GivesSamePairsFromTwentyFinders)
{
    constexpr std::uint32_t kCount = 1u << 17;
    const std::vector<Aabb> sets[2] = {boxesOfManySizes(kCount, 1), boxesOfManySizes(kCount, 2)};
    DeviceBuffer<Aabb> boxes;
    boxes.allocate(kCount);
    PairSum expected[2];
    for (int set = 0; set < 2; ++set)
    {
        upload(boxes, sets[set]);
        expected[set] = sumOfBruteForce(boxes.data(), kCount);
    }
    EXPECT_GT(expected[0].count, 4 * kCount);
    for (int run = 0; run < kRuns; ++run)
    {
        const auto finder = makeFinder(GetParam().options);
        ASSERT_NE(finder, nullptr);
        for (int frame = 0; frame < 6; ++frame)
        {
            upload(boxes, sets[frame % 2]);
            DevicePairs found;
            ASSERT_EQ(finder->enqueue(boxes.data(), kCount), Status::Ok);
            ASSERT_EQ(finder->collect(found), Status::Ok);
            ASSERT_EQ(sumOf(found), expected[frame % 2]) << "run " << run << ", frame " << frame;
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Cuda, CudaIndependence, testing::ValuesIn(allOrders()), nameOf);
}  // namespace
}  // namespace cullet::test
