// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Boxes, pairs and answers on a device, in one call: the bits of the CPU's executor, in every frame.

#include "cullet/tests/cuda/support/contact_frames.h"
#include "cullet/tests/cuda/support/crowd_scene.h"
#include "cullet/tests/cuda/support/cuda_contacts.h"
#include "cullet/tests/cuda/support/failing_calls.h"
#include "cullet/tests/cuda/support/host_contacts.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
class CudaContactFinders : public testing::TestWithParam<ConvexKind>
{
};

TEST_P(CudaContactFinders, HaveBitsOfCpuExecutorInEveryFrame)
{
    const unsigned seed = 69;
    SCOPED_TRACE("seed " + std::to_string(seed));
    CrowdScene scene(GetParam(), 20000, seed);
    HostContacts host(scene.set, contactOptions(PsapExecutor::InOrder, 1));
    PsapOptions listing;
    listing.nearPairs = PsapNearPairs::Always;
    CudaContacts device(scene.set), again(scene.set, listing);
    ASSERT_TRUE(device.isThere()) << device.why;
    std::uint64_t added = 0, removed = 0;
    for (int frame = 0; frame < 24; ++frame)
    {
        SCOPED_TRACE("frame " + std::to_string(frame));
        // Frames alike are launched from a graph; distances come after a third of them, contacts at last.
        const ContactQuery query =
            contactQuery(0.01f, frame / 8 == 1 ? 0.02f : -1.0f, frame / 8 == 2 ? 0.02f : -1.0f);
        FoundContacts found, repeated;
        ASSERT_EQ(device.query(scene.poses, query, found), Status::Ok);
        ASSERT_EQ(again.query(scene.poses, query, repeated), Status::Ok);
        const FoundContacts expected =
            host.query(scene.poses, query.margin, query.pairs.maxDistance, query.pairs.contactMargin);
        EXPECT_TRUE(haveSameBits(found, expected));
        EXPECT_TRUE(haveSameBits(found, repeated));
        EXPECT_EQ(found.counts.failed, expected.counts.failed);
        EXPECT_EQ(found.counts.remembered, expected.counts.remembered);
        EXPECT_EQ(found.counts.overlapping, expected.counts.overlapping);
        EXPECT_EQ(found.counts.invalid, 0u);
        EXPECT_EQ(found.changes.added, expected.changes.added);
        added += found.changes.added;
        removed += found.changes.removed;
        // Some frames with many changes, which find no room.
        scene.move(frame % 8 == 7 ? 1.0 : 0.01);
    }
    EXPECT_GT(added, 20000u);
    EXPECT_GT(removed, 5000u);
}

TEST_P(CudaContactFinders, HaveRightPairsWhenNoFrameIsCollected)
{
    const unsigned seed = 70;
    SCOPED_TRACE("seed " + std::to_string(seed));
    CrowdScene scene(GetParam(), 4000, seed);
    HostContacts host(scene.set, contactOptions(PsapExecutor::InOrder, 1));
    CudaContacts device(scene.set);
    ASSERT_TRUE(device.isThere()) << device.why;
    const ContactQuery query = contactQuery(0.0f, -1.0f);
    FoundContacts expected;
    int whole = 0;
    for (int frame = 0; frame < 12; ++frame)
    {
        ASSERT_EQ(device.enqueue(scene.poses, query), Status::Ok);
        expected = host.query(scene.poses);
        const std::uint64_t count = device.countAhead();
        EXPECT_TRUE(count == expected.pairs.size() || count == contacts::kVoidList);
        whole += count == expected.pairs.size();
        if (frame != 11)
            scene.move(0.01);
    }
    EXPECT_GT(whole, 6);
    FoundContacts found;
    ASSERT_EQ(device.collect(found), Status::Ok);
    EXPECT_TRUE(areEqual(found.pairs, expected.pairs));
    EXPECT_EQ(found.answers.states, expected.answers.states);
}

INSTANTIATE_TEST_SUITE_P(Cuda, CudaContactFinders, testing::ValuesIn(kConvexKinds), nameOfKind);

TEST(CudaContactBodies, MayComeAndGo)
{
    CrowdScene scene(ConvexKind::Regular, 2000, 71);
    HostContacts host(scene.set, contactOptions(PsapExecutor::InOrder, 1));
    CudaContacts device(scene.set, contactOptions(PsapExecutor::InOrder, 1, 1));
    ASSERT_TRUE(device.isThere()) << device.why;
    const std::vector<BodyPose> all = scene.poses;
    for (const std::size_t count : {all.size(), std::size_t{100}, std::size_t{0}, all.size() / 2, all.size()})
    {
        std::vector<BodyPose> poses = all;
        poses.resize(count);
        FoundContacts found;
        ASSERT_EQ(device.query(poses, contactQuery(0.0f, 1.0f), found), Status::Ok);
        EXPECT_TRUE(haveSameBits(found, host.query(poses, 0.0f, 1.0f))) << count;
    }
    device.forget();
    host.forget();
    FoundContacts found;
    ASSERT_EQ(device.query(all, contactQuery(0.0f, 1.0f), found), Status::Ok);
    EXPECT_TRUE(haveSameBits(found, host.query(all, 0.0f, 1.0f)));
}

/// Each call fails once, in eight frames; the same frame and those after it are then right. Returns the number of calls.
std::uint64_t failEveryCallOfContacts(FaultInjection fault)
{
    CrowdScene scene(ConvexKind::Regular, 400, 72);
    const FramesOfContacts frames(scene);
    frames.expectVaried();
    return failEachCall(fault,
                        [&](const FaultPlan& plan)
                        {
                            CudaContacts device(scene.set);
                            ASSERT_TRUE(device.isThere()) << device.why;
                            // Poses find their memory before calls fail.
                            device.upload(frames.poses(0));
                            plan.begin();
                            std::size_t forgotten = 0;
                            for (std::size_t frame = 0; frame < frames.size(); ++frame)
                            {
                                const ContactQuery query = frames.query(frame);
                                FoundContacts found;
                                Status status = device.query(frames.poses(frame), query, found);
                                if (status != Status::Ok)
                                {
                                    EXPECT_EQ(status, statusOf(fault));
                                    EXPECT_TRUE(haveSameBits(found, {}));
                                    setCudaFault(FaultInjection::None, 0);
                                    forgotten = frame;
                                    status = device.query(frames.poses(frame), query, found);
                                }
                                ASSERT_EQ(status, Status::Ok);
                                EXPECT_TRUE(haveSameBits(found, frames.expected(forgotten, frame)))
                                    << "frame " << frame << ", forgotten before " << forgotten;
                            }
                        });
}

TEST(CudaContactFailures, LeaveAnswersRightWhenAnyCallRunsOutOfMemory)
{
    EXPECT_GT(failEveryCallOfContacts(FaultInjection::OutOfMemory), 100u);
}

TEST(CudaContactFailures, LeaveAnswersRightWhenAnyCallLosesDevice)
{
    EXPECT_GT(failEveryCallOfContacts(FaultInjection::DeviceLost), 100u);
}

TEST(CudaContactFailures, GiveReasonWhenAnyCallOfStartFails)
{
    const ConvexScene scene(ConvexKind::Regular, 1, 73);
    for (const FaultInjection fault : {FaultInjection::OutOfMemory, FaultInjection::DeviceLost})
    {
        const std::uint64_t calls = failEachCall(fault,
                                                 [&](const FaultPlan& plan)
                                                 {
                                                     plan.begin();
                                                     const CudaContacts device(scene.set);
                                                     EXPECT_EQ(device.isThere(), device.why.empty());
                                                     EXPECT_EQ(device.isThere(), !hasCudaFaultHappened());
                                                 });
        EXPECT_GT(calls, 6u);
    }
}
}  // namespace
}  // namespace cullet::test
