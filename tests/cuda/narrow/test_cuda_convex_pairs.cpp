// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Convex pairs on a device: the bits of the CPU's executor, and the booleans of isaGjk() for a million pairs.

#include "cullet/tests/cuda/support/convex_check.h"
#include "cullet/tests/cuda/support/convex_scene.h"
#include "cullet/tests/cuda/support/cuda_pairs.h"
#include "cullet/tests/cuda/support/failing_calls.h"
#include "cullet/tests/cuda/support/host_pairs.h"
#include "cullet/tests/cuda/support/pair_frames.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
class CudaConvexPairs : public testing::TestWithParam<ConvexKind>
{
};

TEST_P(CudaConvexPairs, HaveBitsOfCpuExecutorInEveryFrame)
{
    const unsigned seed = 53;
    SCOPED_TRACE("seed " + std::to_string(seed));
    ConvexScene scene(GetParam(), 20000, seed);
    HostPairs host(scene.set, PsapExecutor::InOrder, 1);
    CudaPairs device(scene.set), again(scene.set);
    ASSERT_TRUE(device.isThere()) << device.why;
    for (int frame = 0; frame < 6; ++frame)
    {
        SCOPED_TRACE("frame " + std::to_string(frame));
        ConvexAnswers found, repeated;
        ASSERT_EQ(device.query(scene, found), Status::Ok);
        ASSERT_EQ(again.query(scene, repeated), Status::Ok);
        EXPECT_TRUE(haveSameBits(found, host.query(scene)));
        EXPECT_TRUE(haveSameBits(found, repeated));
        EXPECT_EQ(device.counts.failed, host.counts().failed);
        EXPECT_EQ(device.counts.remembered, host.counts().remembered);
        EXPECT_EQ(device.counts.doubtful, host.counts().doubtful);
        EXPECT_EQ(device.counts.overlapping, host.counts().overlapping);
        scene.step();
    }
}

TEST_P(CudaConvexPairs, EqualIsaGjkForMillionAnswersOfFourKinds)
{
    const unsigned seed = 54;
    SCOPED_TRACE("seed " + std::to_string(seed));
    ConvexScene scene(GetParam(), 130000, seed);
    CudaPairs device(scene.set);
    ASSERT_TRUE(device.isThere()) << device.why;
    ConvexTally tally;
    for (int frame = 0; frame < 2; ++frame)
    {
        ConvexAnswers found;
        ASSERT_EQ(device.query(scene, found), Status::Ok);
        checkPairs(scene, found, tally);
        scene.step();
    }
    // A quarter of a million for each kind.
    EXPECT_EQ(tally.pairs, 260000);
    expectGood(tally);
}

TEST_P(CudaConvexPairs, HaveBitsOfCpuExecutorWhenListChanges)
{
    const unsigned seed = 55;
    SCOPED_TRACE("seed " + std::to_string(seed));
    ConvexScene scene(GetParam(), 5000, seed);
    HostPairs host(scene.set, PsapExecutor::InOrder, 1);
    CudaPairs device(scene.set);
    ASSERT_TRUE(device.isThere()) << device.why;
    const std::vector<RowPair> all = scene.pairs;
    std::mt19937 engine(seed);
    for (const std::size_t count : {std::size_t{37}, all.size(), std::size_t{0}, std::size_t{1}, all.size()})
    {
        scene.pairs = all;
        std::shuffle(scene.pairs.begin(), scene.pairs.end(), engine);
        scene.pairs.resize(count);
        ConvexAnswers found;
        ASSERT_EQ(device.query(scene, found), Status::Ok);
        EXPECT_TRUE(haveSameBits(found, host.query(scene))) << count;
    }
}

TEST_P(CudaConvexPairs, HaveDistancesOfCpuExecutorBitByBit)
{
    const unsigned seed = 60;
    SCOPED_TRACE("seed " + std::to_string(seed));
    ConvexScene scene(GetParam(), 5000, seed);
    HostPairs host(scene.set, PsapExecutor::InOrder, 1);
    CudaPairs device(scene.set);
    ASSERT_TRUE(device.isThere()) << device.why;
    for (const float most : {std::numeric_limits<float>::infinity(), 0.025f, 0.0f})
    {
        ConvexAnswers found;
        ASSERT_EQ(device.measure(scene, most, found), Status::Ok);
        EXPECT_EQ(found.distances.size(), scene.pairs.size());
        EXPECT_EQ(found.overlaps, overlapsOf(found.states));
        EXPECT_TRUE(haveSameBits(found, host.measure(scene, most))) << most;
        scene.step();
        ASSERT_EQ(device.query(scene, found), Status::Ok);
        EXPECT_TRUE(haveSameBits(found, host.query(scene))) << most;
        EXPECT_TRUE(found.distances.empty());
    }
}

TEST_P(CudaConvexPairs, HaveContactsOfCpuExecutorBitByBit)
{
    const unsigned seed = 67;
    SCOPED_TRACE("seed " + std::to_string(seed));
    // More overlap than the first query has memory for.
    ConvexScene scene(GetParam(), 6000, seed);
    HostPairs host(scene.set, PsapExecutor::InOrder, 1);
    CudaPairs device(scene.set);
    ASSERT_TRUE(device.isThere()) << device.why;
    for (int frame = 0; frame < 3; ++frame)
    {
        ConvexAnswers found;
        ASSERT_EQ(device.contacts(scene, 0.02f, found), Status::Ok);
        EXPECT_GT(found.contacts.size(), 1500u);
        EXPECT_TRUE(haveSameBits(found, host.contacts(scene, 0.02f))) << frame;
        EXPECT_EQ(device.counts.largeDepths, host.depthCounts().large);
        EXPECT_EQ(device.counts.examinedDepths, host.depthCounts().examined);
        scene.step();
        ASSERT_EQ(device.query(scene, found), Status::Ok);
        EXPECT_TRUE(haveSameBits(found, host.query(scene))) << frame;
        EXPECT_TRUE(found.depths.empty());
    }
}

TEST_P(CudaConvexPairs, CopyContactsToMemoryOfCpu)
{
    ConvexScene scene(GetParam(), 300, 68);
    CudaPairs device(scene.set);
    ASSERT_TRUE(device.isThere()) << device.why;
    ConvexAnswers found, copied;
    ASSERT_EQ(device.contacts(scene, 0.02f, found), Status::Ok);
    ASSERT_EQ(device.copyContacts(copied), Status::Ok);
    found.states = {};
    found.axes = {};
    EXPECT_GT(copied.contacts.size(), 50u);
    EXPECT_TRUE(haveSameBits(found, copied));
}

INSTANTIATE_TEST_SUITE_P(Cuda, CudaConvexPairs, testing::ValuesIn(kConvexKinds), nameOfKind);

TEST(CudaInvalidPairs, AreReportedAndLeaveOthersAlone)
{
    ConvexScene scene(ConvexKind::Regular, 100, 56);
    CudaPairs device(scene.set);
    ASSERT_TRUE(device.isThere()) << device.why;
    ConvexAnswers good, found;
    ASSERT_EQ(device.query(scene, good), Status::Ok);
    CudaPairs other(scene.set);
    scene.pairs[3].b = 0xffffffffu;
    scene.pairs[4].a = static_cast<std::uint32_t>(scene.poses.size());
    scene.poses[10].hull = scene.set.size();
    scene.poses[13].position[0] = std::numeric_limits<float>::quiet_NaN();
    scene.poses[14].rotation[2] = std::numeric_limits<float>::infinity();
    for (const std::size_t bad : {3, 4, 5, 6, 7})
        good.states[bad] = PairState::Invalid;
    ASSERT_EQ(other.query(scene, found), Status::Ok);
    EXPECT_EQ(found.states, good.states);
    EXPECT_EQ(other.counts.invalid, 5u);
}

Status ask(CudaPairs& device, const FramesOfPairs& frames, std::size_t frame, ConvexAnswers& found)
{
    const ConvexBodies& bodies = frames.bodies(frame);
    switch (frames.question(frame))
    {
        case PairQuestion::Booleans:
            return device.query(bodies, found);
        case PairQuestion::Contacts:
            return device.contacts(bodies, frames.margin(), found);
        case PairQuestion::Distances:
            break;
    }
    return device.measure(bodies, frames.mostDistance(), found);
}

/// Each call fails once, in eight frames; the same frame and those after it are then right. Returns the number of calls.
std::uint64_t failEveryCallOfPairs(FaultInjection fault)
{
    ConvexScene scene(ConvexKind::Regular, 300, 57);
    const FramesOfPairs frames(scene);
    frames.expectVaried();
    return failEachCall(fault,
                        [&](const FaultPlan& plan)
                        {
                            CudaPairs device(scene.set);
                            ASSERT_TRUE(device.isThere()) << device.why;
                            // Poses and pairs find their memory before calls fail.
                            device.upload(frames.bodies(1));
                            plan.begin();
                            std::size_t forgotten = 0;
                            for (std::size_t frame = 0; frame < frames.size(); ++frame)
                            {
                                ConvexAnswers found;
                                Status status = ask(device, frames, frame, found);
                                if (status != Status::Ok)
                                {
                                    EXPECT_EQ(status, statusOf(fault));
                                    EXPECT_TRUE(haveSameBits(found, {}));
                                    setCudaFault(FaultInjection::None, 0);
                                    forgotten = frame;
                                    status = ask(device, frames, frame, found);
                                }
                                ASSERT_EQ(status, Status::Ok);
                                EXPECT_TRUE(haveSameBits(found, frames.expected(forgotten, frame)))
                                    << "frame " << frame << ", forgotten before " << forgotten;
                            }
                        });
}

TEST(CudaConvexPairFailures, LeaveAnswersRightWhenAnyCallRunsOutOfMemory)
{
    EXPECT_GT(failEveryCallOfPairs(FaultInjection::OutOfMemory), 30u);
}

TEST(CudaConvexPairFailures, LeaveAnswersRightWhenAnyCallLosesDevice)
{
    EXPECT_GT(failEveryCallOfPairs(FaultInjection::DeviceLost), 30u);
}

TEST(CudaConvexPairFailures, GiveReasonWhenAnyCallOfStartFails)
{
    const ConvexScene scene(ConvexKind::Regular, 1, 58);
    for (const FaultInjection fault : {FaultInjection::OutOfMemory, FaultInjection::DeviceLost})
    {
        const std::uint64_t calls = failEachCall(fault,
                                                 [&](const FaultPlan& plan)
                                                 {
                                                     plan.begin();
                                                     const CudaPairs device(scene.set);
                                                     EXPECT_EQ(device.isThere(), device.why.empty());
                                                     EXPECT_EQ(device.isThere(), !hasCudaFaultHappened());
                                                 });
        EXPECT_GT(calls, 6u);
    }
}
}  // namespace
}  // namespace cullet::test
