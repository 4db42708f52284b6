// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Boxes, pairs and answers of bodies on the CPU's executor, against brute force and isaGjk().

#include "cullet/tests/cuda/support/contact_frames.h"
#include "cullet/tests/cuda/support/convex_check.h"
#include "cullet/tests/cuda/support/crowd_scene.h"
#include "cullet/tests/cuda/support/host_contacts.h"
#include "cullet/tests/cuda/support/host_pairs.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
/// The exact box of a body, and how much larger a box may be.
void checkBox(const ConvexScene& scene, std::uint32_t body, const Aabb& box, double margin)
{
    const PosedHull<double> hull = scene.posed(body);
    const double size = hull.hull().radius() + hull.origin().cwiseAbs().maxCoeff() + margin;
    for (int axis = 0; axis < 3; ++axis)
    {
        const Eigen::Vector3d up = Eigen::Vector3d::Unit(axis);
        const double max = hull.origin()[axis] + heightAlong(hull, up) + margin;
        const double min = hull.origin()[axis] - heightAlong(hull, -up) - margin;
        // Poses are turned in double here, with an error below 1e-12.
        EXPECT_GE(box.max[axis], max - 1e-12 * size) << body;
        EXPECT_LE(box.max[axis], max + 1e-5 * size) << body;
        EXPECT_LE(box.min[axis], min + 1e-12 * size) << body;
        EXPECT_GE(box.min[axis], min - 1e-5 * size) << body;
    }
}

class ContactSearches : public testing::TestWithParam<ConvexKind>
{
};

TEST_P(ContactSearches, EqualBruteForceAndIsaGjkInEveryFrame)
{
    const unsigned seed = 64;
    SCOPED_TRACE("seed " + std::to_string(seed));
    CrowdScene scene(GetParam(), 600, seed);
    HostContacts contacts(scene.set, contactOptions(PsapExecutor::Shuffled, seed, 1));
    ConvexTally tally;
    DistanceTally distances;
    DeltaCounts changes = {};
    for (int frame = 0; frame < 8; ++frame)
    {
        SCOPED_TRACE("frame " + std::to_string(frame));
        const float margin = frame % 2 == 0 ? 0.0f : 0.02f;
        const FoundContacts found = contacts.query(scene.poses, margin, 0.04f);
        const std::vector<Aabb> boxes = contacts.boxes();
        for (std::uint32_t body = 0; body < boxes.size(); ++body)
            checkBox(scene, body, boxes[body], double(margin));
        ASSERT_TRUE(areEqual(found.pairs, pairsOf(boxes)));
        scene.pairs = found.pairs;
        checkPairs(scene, found.answers, tally);
        for (std::size_t k = 0; k < scene.pairs.size(); ++k)
            checkDistance(scene, k, found.answers, 0.04, distances);
        EXPECT_EQ(found.answers.overlaps, overlapsOf(found.answers.states));
        EXPECT_EQ(found.counts.overlapping, found.answers.overlaps.size());
        EXPECT_EQ(found.counts.invalid, 0u);
        changes = {changes.kept + found.changes.kept, changes.added + found.changes.added,
                   changes.removed + found.changes.removed};
        scene.move(0.1);
    }
    expectGood(tally);
    EXPECT_EQ(distances.wrong, 0);
    EXPECT_GT(distances.measured, 100);
    EXPECT_GT(changes.kept, changes.added);
    EXPECT_GT(changes.added, 500u);
    EXPECT_GT(changes.removed, 200u);
    EXPECT_GE(contacts.repeats(), 1);
}

TEST_P(ContactSearches, HaveContactsOfConvexPairs)
{
    const unsigned seed = 74;
    SCOPED_TRACE("seed " + std::to_string(seed));
    // More pairs overlap than there is room for at first.
    CrowdScene scene(GetParam(), 1600, seed, 0.8);
    HostContacts contacts(scene.set, contactOptions(PsapExecutor::Shuffled, seed));
    for (int frame = 0; frame < 3; ++frame)
    {
        const FoundContacts found = contacts.query(scene.poses, 0.0f, -1.0f, 0.02f);
        scene.pairs = found.pairs;
        HostPairs pairs(scene.set, PsapExecutor::Shuffled, seed);
        const ConvexAnswers expected =
            pairs.contacts(scene, 0.02f, static_cast<std::uint32_t>(found.pairs.size()));
        EXPECT_GT(expected.overlaps.size(), 1500u);
        ConvexAnswers answers = found.answers;
        // What is remembered are axes.
        answers.axes = expected.axes;
        EXPECT_TRUE(haveSameBits(answers, expected));
        scene.move(0.05);
    }
}

TEST_P(ContactSearches, RememberPairsWhileOthersComeAndGo)
{
    CrowdScene scene(GetParam(), 400, 66);
    HostContacts contacts(scene.set, contactOptions(PsapExecutor::Shuffled, 66));
    const FoundContacts few = contacts.query(scene.poses, 0.05f);
    const FoundContacts many = contacts.query(scene.poses, 0.2f);
    EXPECT_GT(many.changes.added, few.pairs.size() / 4);
    EXPECT_LE(many.counts.failed, many.changes.added);
    EXPECT_EQ(many.counts.remembered, few.counts.overlapping);
    // All pairs were there before: axes still separate, and the others are known to overlap.
    const FoundContacts left = contacts.query(scene.poses, 0.0f);
    EXPECT_GT(left.changes.removed, few.pairs.size() / 4);
    EXPECT_EQ(left.counts.failed, 0u);
    EXPECT_EQ(left.counts.remembered, left.counts.overlapping);
    EXPECT_GT(left.pairs.size() - left.counts.overlapping, 100u);
    contacts.forget();
    EXPECT_EQ(contacts.query(scene.poses, 0.0f).counts.remembered, 0u);
}

INSTANTIATE_TEST_SUITE_P(Host, ContactSearches, testing::ValuesIn(kConvexKinds), nameOfKind);

TEST(ContactSearchBodies, MayBeInvalidAndComeAndGo)
{
    CrowdScene scene(ConvexKind::Regular, 200, 67);
    HostContacts contacts(scene.set, contactOptions(PsapExecutor::Shuffled, 67, 1));
    const std::vector<BodyPose> all = scene.poses;
    const auto expectPairs = [&]
    {
        const FoundContacts found = contacts.query(scene.poses);
        EXPECT_TRUE(areEqual(found.pairs, pairsOf(contacts.boxes())));
        EXPECT_EQ(found.counts.invalid, 0u);
        return found.pairs.size();
    };
    const std::size_t before = expectPairs();
    scene.poses[3].position[1] = std::numeric_limits<float>::quiet_NaN();
    scene.poses[10].hull = scene.set.size();
    scene.poses[11].rotation[3] = 9.0f;
    EXPECT_LT(expectPairs(), before);
    for (const std::uint32_t bad : {3u, 10u, 11u})
        EXPECT_FALSE(isValid(contacts.boxes()[bad]));
    scene.poses = all;
    EXPECT_EQ(expectPairs(), before);
    scene.poses.resize(60);
    EXPECT_LT(expectPairs(), before);
    scene.poses.clear();
    EXPECT_EQ(expectPairs(), 0u);
    scene.poses = all;
    EXPECT_EQ(expectPairs(), before);
    contacts.recover();
    EXPECT_EQ(expectPairs(), before);
}

TEST(ContactSearchBodies, AreAnsweredAsByNewSearchAfterFailureBeforeAnyFrame)
{
    CrowdScene scene(ConvexKind::Regular, 400, 72);
    const FramesOfContacts frames(scene);
    frames.expectVaried();
    for (std::size_t failed = 1; failed < frames.size(); ++failed)
    {
        HostContacts contacts(scene.set, contactOptions(PsapExecutor::InOrder, 1));
        for (std::size_t frame = 0; frame < frames.size(); ++frame)
        {
            if (frame == failed)
                contacts.recover();
            EXPECT_TRUE(haveSameBits(frames.answer(contacts, frame),
                                     frames.expected(frame < failed ? 0 : failed, frame)))
                << "frame " << frame << ", failure before " << failed;
        }
    }
}

TEST(ContactSearchBodies, HaveBoxesOfAnySize)
{
    for (const int exponent : {-70, -24, 22, 100})
    {
        SCOPED_TRACE(exponent);
        ConvexScene scene(ConvexKind::Regular, 50, 68);
        scene.rescale(exponent);
        HostContacts contacts(scene.set, contactOptions(PsapExecutor::InOrder, 1));
        contacts.query(scene.poses);
        for (std::uint32_t body = 0; body < scene.poses.size(); ++body)
        {
            const PosedHull<double> hull = scene.posed(body);
            const Aabb box = contacts.boxes()[body];
            const double size = hull.hull().radius() + hull.origin().cwiseAbs().maxCoeff();
            for (int axis = 0; axis < 3; ++axis)
            {
                const double top = hull.origin()[axis] + heightAlong(hull, Eigen::Vector3d::Unit(axis));
                EXPECT_GE(box.max[axis], top - 1e-12 * size);
                EXPECT_LE(box.max[axis], hull.origin()[axis] + 1.01 * hull.hull().radius() + 1e-5 * size);
            }
        }
    }
}
}  // namespace
}  // namespace cullet::test
