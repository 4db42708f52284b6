// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Whichever CUDA call of a finder fails, and however, enqueue() or collect() reports it, and the finder continues: the
// next frame has the pairs of brute force.

#include "cullet/tests/cuda/support/device_boxes.h"
#include "cullet/tests/cuda/support/failing_calls.h"
#include "cullet/tests/cuda/support/named_options.h"
#include "cullet/tests/support/box_scenes.h"
#include "cullet/tests/support/pair_lists.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr std::uint32_t kCount = 300;
// The first frame makes a plan; then launches are recorded for each of two phases, and the recordings launched.
constexpr int kFrames = 6;

/// Frames of a scene, with the pairs of each.
class Frames
{
public:
    explicit Frames(int count)
    {
        BoxScene scene(SceneKind::Uniform, kCount, 5);
        for (int frame = 0; frame < count; ++frame)
        {
            boxes.push_back(scene.boxes());
            pairs.push_back(everyPair(scene.boxes()));
            EXPECT_GT(pairs.back().size(), 50u);
            scene.step();
        }
    }

    std::vector<std::vector<Aabb>> boxes;
    std::vector<Pairs> pairs;
};

/// Ok and the pairs of the boxes, or the error.
Status search(DevicePairFinder& finder, const DeviceBuffer<Aabb>& boxes, DevicePairs& found)
{
    const Status status = finder.enqueue(boxes.data(), boxes.size());
    return status == Status::Ok ? finder.collect(found) : status;
}

std::uint64_t failEveryCallOfAFinder(SearchOptions options, FaultInjection fault)
{
    options.initialCapacity = 1;
    const Frames frames(framesWithPlan(options, kFrames));
    DeviceBuffer<Aabb> boxes;
    boxes.allocate(kCount);
    return failEachCall(fault,
                        [&](const FaultPlan& plan)
                        {
                            const auto finder = makeFinder(options);
                            ASSERT_NE(finder, nullptr);
                            plan.begin();
                            for (std::size_t frame = 0; frame < frames.boxes.size(); ++frame)
                            {
                                SCOPED_TRACE("frame " + std::to_string(frame));
                                upload(boxes, frames.boxes[frame]);
                                DevicePairs found;
                                Status status = search(*finder, boxes, found);
                                if (status != Status::Ok)
                                {
                                    EXPECT_EQ(status, statusOf(fault));
                                    setCudaFault(FaultInjection::None, 0);
                                    status = search(*finder, boxes, found);
                                }
                                ASSERT_EQ(status, Status::Ok);
                                EXPECT_EQ(inOrder(download(found)), frames.pairs[frame]);
                            }
                        });
}

class FinderFailures : public testing::TestWithParam<NamedOptions>
{
};

TEST_P(FinderFailures, LeavePairsExactWhenAnyCallRunsOutOfMemory)
{
    EXPECT_GT(failEveryCallOfAFinder(GetParam().options, FaultInjection::OutOfMemory), 30u);
}

TEST_P(FinderFailures, LeavePairsExactWhenAnyCallLosesDevice)
{
    EXPECT_GT(failEveryCallOfAFinder(GetParam().options, FaultInjection::DeviceLost), 30u);
}

INSTANTIATE_TEST_SUITE_P(Cuda, FinderFailures, testing::ValuesIn(allOrders()), nameOf);
}  // namespace
}  // namespace cullet::test
