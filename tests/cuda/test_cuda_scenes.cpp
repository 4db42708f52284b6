// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Scenes too large for the oracle: the device against the CPU grid, against the thesis's search, and against itself.

#include "cullet/tests/cuda/support/box_frames.h"
#include "cullet/tests/cuda/support/device_boxes.h"
#include "cullet/tests/cuda/support/named_options.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/pair_lists.h"
#include "cullet/tests/support/random.h"
#include "cullet/tests/support/scattered_rows.h"

#include <cuda_runtime_api.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr SceneKind kScenes[] = {SceneKind::Uniform, SceneKind::ManySizes, SceneKind::Pile};

TEST(CudaScenes, GiveSamePairsOnAllDevicesFromSeveralThreadsAtOnce)
{
    int deviceCount = 0;
    ASSERT_EQ(cudaGetDeviceCount(&deviceCount), cudaSuccess);
    const BoxFrames frames = framesOf(SceneKind::ManySizes, 1u << 14, 12);
    const PairStream expected = follow(*makeGridBackend(), frames);
    EXPECT_GT(expected.removed, 0u);
    // Two threads per device, so that threads share a device.
    std::vector<PairStream> streams(2 * static_cast<std::size_t>(deviceCount));
    std::vector<std::thread> threads;
    for (std::size_t i = 0; i < streams.size(); ++i)
    {
        threads.emplace_back(
            [&streams, &frames, i]
            {
                PsapOptions options;
                options.device = static_cast<int>(i / 2);
                std::string why;
                const std::unique_ptr<Backend> backend = makeCudaPsapBackend(options, &why);
                ASSERT_NE(backend, nullptr) << why;
                streams[i] = follow(*backend, frames);
            });
    }
    for (std::thread& thread : threads)
        thread.join();
    for (std::size_t i = 0; i < streams.size(); ++i)
        EXPECT_EQ(streams[i], expected) << "device " << i / 2;
    RecordProperty("devices", deviceCount);
    std::printf("%d devices, %zu backends at once\n", deviceCount, streams.size());
}

TEST(CudaScenes, GiveSamePairStreamsAsGridUpToMillionBoxes)
{
    for (const std::uint32_t count : {1u << 14, 1u << 17, 1u << 20})
    {
        for (const SceneKind kind : kScenes)
        {
            SCOPED_TRACE(std::string(sceneName(kind)) + " " + std::to_string(count));
            const BoxFrames frames = framesOf(kind, count, count > 1u << 17 ? 2 : 4);
            const PairStream expected = follow(*makeGridBackend(), frames);
            EXPECT_GT(expected.added, count / 2);
            EXPECT_GT(expected.removed, 0u);
            EXPECT_EQ(follow(*makeCudaPsapBackend(), frames), expected);
            EXPECT_EQ(follow(*makeCudaBackend(thesisSearch()), frames), expected);
        }
    }
}

/// Boxes with constant velocities.
BoxFrames driftingFrames(SceneKind kind, std::uint32_t count, int frames)
{
    BoxFrames all = framesOf(kind, count, 1);
    Random random(19);
    std::vector<float> ways(3 * std::size_t{count});
    for (float& way : ways)
        way = random.between(-0.03f, 0.03f);
    for (int frame = 1; frame < frames; ++frame)
    {
        all.push_back(all.back());
        for (std::size_t i = 0; i < ways.size(); ++i)
        {
            all.back()[i / 3].min[i % 3] += ways[i];
            all.back()[i / 3].max[i % 3] += ways[i];
        }
    }
    return all;
}

TEST(CudaScenes, GiveSamePairsAsGridWhenNeighbourListsAreUsed)
{
    for (const SceneKind kind : kScenes)
    {
        SCOPED_TRACE(sceneName(kind));
        constexpr int kFrames = 24;
        const BoxFrames frames = driftingFrames(kind, 1u << 16, kFrames);
        const PairStream expected = follow(*makeGridBackend(), frames);
        EXPECT_GT(expected.removed, 5000u);
        const auto backend = makeCudaPsapBackend();
        EXPECT_EQ(follow(*backend, frames), expected);
        EXPECT_LT(backend->stats().rebuildsTotal, kFrames / 2u);
    }
}

TEST(CudaScenes, GiveSamePairsAsGridWhenScatteredRowsChange)
{
    const std::uint64_t expected = scatteredStream(*makeGridBackend(), true);
    for (const bool isLockable : {true, false})
        EXPECT_EQ(scatteredStream(*makeCudaPsapBackend(), isLockable), expected) << isLockable;
}

TEST(CudaScenes, GiveSamePairsAsGridWithHundredsOfThousandsOfPersistentPairs)
{
    const BoxFrames frames = framesOf(SceneKind::Pile, 80000, 3);
    const PairStream expected = follow(*makeGridBackend(), frames);
    EXPECT_GT(expected.removed, 0u);
    for (const std::uint32_t capacity : {1u, PsapOptions{}.initialCapacity})
    {
        PsapOptions options;
        options.initialCapacity = capacity;
        const auto backend = makeCudaPsapBackend(options);
        EXPECT_EQ(follow(*backend, frames), expected) << capacity;
        // From this number on a lane processes several.
        EXPECT_GT(backend->stats().pairs, 1u << 18);
    }
}

TEST(CudaScenes, GiveSamePairsAsBruteForceForBoxesOnDevice)
{
    SearchOptions capacityOne;
    capacityOne.initialCapacity = 1;
    for (const SearchOptions& options : {SearchOptions{}, capacityOne, thesisSearch()})
    {
        for (const SceneKind kind : kScenes)
        {
            SCOPED_TRACE(sceneName(kind));
            const auto finder = makeFinder(options);
            ASSERT_NE(finder, nullptr);
            BoxScene scene(kind, 5000, 3);
            DeviceBuffer<Aabb> boxes;
            boxes.allocate(5000);
            // More frames than the lifetime of a plan, with recorded and direct launches.
            for (int frame = 0; frame < 40; ++frame)
            {
                upload(boxes, scene.boxes());
                const Pairs pairs = inOrder(findOnDevice(*finder, boxes, 5000));
                if (frame % 8 == 0)
                {
                    ASSERT_EQ(pairs, everyPair(scene.boxes())) << frame;
                }
                ASSERT_GT(pairs.size(), 1000u);
                scene.step();
            }
        }
    }
}

// Small enough for a sanitizer: each search, with direct and recorded launches.
TEST(CudaScenes, GiveSamePairsOfFewBoxesWithEveryVariant)
{
    constexpr std::uint32_t kFew = 2000;
    DeviceBuffer<Aabb> boxes;
    boxes.allocate(kFew);
    for (const SceneKind kind : kScenes)
    {
        const BoxFrames frames = framesOf(kind, kFew, 6);
        for (NamedOptions variant : allVariants())
        {
            SCOPED_TRACE(std::string(sceneName(kind)) + ", " + variant.name);
            variant.options.initialCapacity = 1;
            const auto finder = makeFinder(variant.options);
            ASSERT_NE(finder, nullptr);
            for (const std::vector<Aabb>& frame : frames)
            {
                upload(boxes, frame);
                ASSERT_EQ(inOrder(findOnDevice(*finder, boxes, kFew)), everyPair(frame));
            }
        }
    }
}

TEST(CudaScenes, GiveSamePairsAsBruteForceForBoxesAtOnePointUnderHugeOnes)
{
    std::vector<Aabb> boxes(3000, cube(0, 1));
    boxes.push_back(cube(-1e6f, 1e6f));
    boxes.push_back(cube(-kInfinity, kInfinity));
    boxes.push_back(cube(1, -1));
    boxes.push_back(cube(kNan, 1));
    const Pairs expected = everyPair(boxes);
    ASSERT_EQ(expected.size(), 3002u * 3001 / 2);
    DeviceBuffer<Aabb> onDevice;
    onDevice.allocate(boxes.size());
    upload(onDevice, boxes);
    for (const SearchOptions& options : {SearchOptions{}, thesisSearch()})
    {
        const auto finder = makeFinder(options);
        ASSERT_NE(finder, nullptr);
        const Pairs found = inOrder(findOnDevice(*finder, onDevice, boxes.size()));
        EXPECT_EQ(found.size(), expected.size());
        EXPECT_TRUE(found == expected);
    }
}
}  // namespace
}  // namespace cullet::test
