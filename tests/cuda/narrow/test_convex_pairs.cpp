// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Convex pairs on the CPU's executor: the steps of the device, in shuffled order of pairs, against isaGjk().

#include "cullet/tests/cuda/support/convex_check.h"
#include "cullet/tests/cuda/support/convex_scene.h"
#include "cullet/tests/cuda/support/host_pairs.h"
#include "cullet/tests/cuda/support/pair_frames.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
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
constexpr int kFrames = 6;

class ConvexPairs : public testing::TestWithParam<ConvexKind>
{
};

TEST_P(ConvexPairs, EqualIsaGjkInEveryFrame)
{
    const unsigned seed = 44;
    SCOPED_TRACE("seed " + std::to_string(seed));
    ConvexScene scene(GetParam(), 3000, seed);
    HostPairs pairs(scene.set, PsapExecutor::Shuffled, seed);
    ConvexTally tally;
    convex::PairCounts work;
    for (int frame = 0; frame < kFrames; ++frame)
    {
        const ConvexAnswers answers = pairs.query(scene);
        checkPairs(scene, answers, tally);
        EXPECT_EQ(pairs.counts().overlapping,
                  std::count(answers.states.begin(), answers.states.end(), PairState::Overlapping));
        if (frame > 0)
            add(pairs.counts(), work);
        scene.step();
    }
    expectGood(tally);
    // Warm queries take every way: most are answered by their axis, and each queue has some.
    const auto warm = static_cast<std::uint32_t>(scene.pairs.size()) * (kFrames - 1);
    EXPECT_GT(warm - work.failed - work.remembered, warm / 4);
    EXPECT_GT(work.failed, warm / 20);
    EXPECT_GT(work.remembered, warm / 5);
    EXPECT_GT(work.doubtful, warm / 200);
    EXPECT_LT(work.doubtful, warm / 10);
}

TEST_P(ConvexPairs, GiveSameBitsInAnyOrder)
{
    const unsigned seed = 45;
    SCOPED_TRACE("seed " + std::to_string(seed));
    ConvexScene scene(GetParam(), 500, seed);
    HostPairs inOrder(scene.set, PsapExecutor::InOrder, 1);
    HostPairs shuffled(scene.set, PsapExecutor::Shuffled, 2);
    HostPairs threads(scene.set, PsapExecutor::Threads, 3);
    for (int frame = 0; frame < kFrames; ++frame)
    {
        const ConvexAnswers expected = inOrder.query(scene);
        EXPECT_TRUE(haveSameBits(shuffled.query(scene), expected));
        EXPECT_TRUE(haveSameBits(threads.query(scene), expected));
        scene.step();
    }
}

TEST_P(ConvexPairs, EqualIsaGjkWhenPairsChangePlaces)
{
    const unsigned seed = 46;
    SCOPED_TRACE("seed " + std::to_string(seed));
    ConvexScene scene(GetParam(), 1000, seed);
    HostPairs pairs(scene.set, PsapExecutor::Shuffled, seed);
    const std::vector<RowPair> all = scene.pairs;
    std::mt19937 engine(seed);
    ConvexTally tally;
    for (const std::size_t count : {std::size_t{300}, std::size_t{1}, all.size(), std::size_t{0}, all.size()})
    {
        scene.pairs = all;
        std::shuffle(scene.pairs.begin(), scene.pairs.end(), engine);
        scene.pairs.resize(count);
        checkPairs(scene, pairs.query(scene), tally);
    }
    EXPECT_EQ(tally.pairs, 2301);
    expectGood(tally);
}

TEST_P(ConvexPairs, HaveDistancesAndClosestPointsOfGjkAndListOverlaps)
{
    const unsigned seed = 59;
    SCOPED_TRACE("seed " + std::to_string(seed));
    ConvexScene scene(GetParam(), 1500, seed);
    HostPairs pairs(scene.set, PsapExecutor::Shuffled, seed);
    DistanceTally tally;
    for (int frame = 0; frame < kFrames; ++frame)
    {
        const float most = frame % 2 == 0 ? std::numeric_limits<float>::infinity() : 0.025f;
        const ConvexAnswers answers = pairs.measure(scene, most);
        EXPECT_EQ(answers.overlaps, overlapsOf(answers.states));
        ConvexTally states;
        checkPairs(scene, answers, states);
        EXPECT_EQ(states.wrong + states.unproved, 0);
        for (std::size_t k = 0; k < scene.pairs.size(); ++k)
            checkDistance(scene, k, answers, double(most), tally);
        scene.step();
    }
    EXPECT_EQ(tally.wrong, 0);
    EXPECT_GT(tally.measured, 1500);
    EXPECT_GT(tally.beyond, 200);
}

/// The steps of convex pairs one by one, in order.
class StepByStep
{
public:
    explicit StepByStep(const ConvexScene& scene)
        : m_axes(scene.pairs.size()),
          m_heights(m_axes.size()),
          m_simplices(m_axes.size()),
          m_states(m_axes.size())
    {
    }

    /// @return how many pairs have asked for supports
    int query(const ConvexScene& scene)
    {
        const auto count = static_cast<std::uint32_t>(scene.pairs.size());
        const convex::PairReader reader = {
            scene.set.tables(),
            {scene.poses.data(), static_cast<std::uint32_t>(scene.poses.size()), scene.pairs.data(), count}};
        const convex::PairMemory memory = {m_axes.data(), m_heights.data(), m_simplices.data(),
                                           m_states.data()};
        convex::PairCounts counts;
        const convex::TestAxes test = {reader, memory, &counts};
        int asked = 0;
        for (std::uint32_t pair = 0; pair < count; ++pair)
        {
            convex::TestAxes::Query query;
            convex::PairRoute route = test.begin(pair, query);
            asked += route == convex::PairRoute::Asked;
            if (route == convex::PairRoute::Asked)
                route = test.finish(pair, query, query.a.support(), query.b.support());
            if (route != convex::PairRoute::Done &&
                !convex::SearchInFloat{{reader, memory, &counts}}(pair, route))
                convex::SearchInDouble{{reader, memory, &counts}}(pair);
        }
        return asked;
    }

    ConvexAnswers answers() const
    {
        ConvexAnswers answers;
        answers.states = m_states;
        answers.axes = m_axes;
        return answers;
    }

private:
    std::vector<PairAxis> m_axes;
    std::vector<convex::PairHeights> m_heights;
    std::vector<convex::PairSimplex> m_simplices;
    std::vector<PairState> m_states;
};

TEST_P(ConvexPairs, AskForFewSupportsWhenBodiesHardlyMove)
{
    const unsigned seed = 60;
    SCOPED_TRACE("seed " + std::to_string(seed));
    ConvexScene scene(GetParam(), 3000, seed);
    StepByStep steps(scene);
    ConvexTally tally;
    int asked = 0;
    for (int frame = 0; frame < 2 * kFrames; ++frame)
    {
        const int now = steps.query(scene);
        // A search finds an axis, the next frame its heights.
        asked += frame > 1 ? now : 0;
        checkPairs(scene, steps.answers(), tally);
        scene.step(0.01);
    }
    expectGood(tally);
    const int apart = (tally.pairs - tally.overlapping) / (2 * kFrames);
    EXPECT_GT(apart, 1000);
    EXPECT_LT(asked, apart * (2 * kFrames - 2) / 2);
}

INSTANTIATE_TEST_SUITE_P(Host, ConvexPairs, testing::ValuesIn(kConvexKinds), nameOfKind);

TEST(ConvexPairSizes, EqualIsaGjkWhereFloatUnderflowsOrOverflows)
{
    for (const int exponent : {-70, -24, 22, 100})
    {
        SCOPED_TRACE(exponent);
        ConvexScene scene(ConvexKind::Regular, 500, 47);
        scene.rescale(exponent);
        HostPairs pairs(scene.set, PsapExecutor::Shuffled, 1);
        ConvexTally tally;
        for (int frame = 0; frame < 2; ++frame)
        {
            checkPairs(scene, pairs.query(scene), tally);
            EXPECT_EQ(pairs.counts().doubtful, 500u);
        }
        expectGood(tally);
    }
}

/// A scene of two hulls that overlap, and one pose for each test to spoil.
ConvexScene sceneOfOnePair()
{
    ConvexScene scene(ConvexKind::Coincident, 1, 48);
    scene.poses[1] = scene.poses[0];
    return scene;
}

TEST(InvalidConvexPairs, AreReportedAndLeaveOthersAlone)
{
    const float nan = std::numeric_limits<float>::quiet_NaN(),
                infinity = std::numeric_limits<float>::infinity();
    ConvexScene scene = sceneOfOnePair();
    const BodyPose good = scene.poses[0];
    scene.poses.resize(1);
    const auto addBody = [&](const auto& spoil)
    {
        BodyPose pose = good;
        spoil(pose);
        scene.poses.push_back(pose);
    };
    addBody([&](BodyPose& pose) { pose.position[1] = nan; });
    addBody([&](BodyPose& pose) { pose.position[2] = -infinity; });
    addBody([&](BodyPose& pose) { pose.rotation[0] = nan; });
    addBody([&](BodyPose& pose) { std::fill(pose.rotation, pose.rotation + 4, 0.0f); });
    addBody([&](BodyPose& pose) { pose.rotation[3] = 2.1f; });
    addBody([&](BodyPose& pose) { pose.hull = scene.set.size(); });
    addBody([&](BodyPose& pose) { pose.hull = scene.set.add(Hull<float>()); });
    const auto bodies = static_cast<std::uint32_t>(scene.poses.size());
    scene.pairs = {{0, 0}};
    for (std::uint32_t bad = 1; bad <= bodies; ++bad)
    {
        scene.pairs.push_back({0, bad});
        scene.pairs.push_back({bad, 0});
    }
    scene.pairs.push_back({0xffffffffu, 0});
    scene.pairs.push_back({0, 0});
    std::vector<PairState> expected(scene.pairs.size(), PairState::Invalid);
    expected.front() = expected.back() = PairState::Overlapping;
    HostPairs pairs(scene.set, PsapExecutor::Shuffled, 1);
    for (int frame = 0; frame < 2; ++frame)
    {
        EXPECT_EQ(pairs.query(scene).states, expected);
        EXPECT_EQ(pairs.counts().invalid, scene.pairs.size() - 2);
    }
    // A pair that becomes valid is answered.
    scene.poses[1] = good;
    EXPECT_EQ(pairs.query(scene).states[1], PairState::Overlapping);
}

TEST(ForgottenConvexPairs, AreAnsweredAsNewOnesInAllLaterFrames)
{
    ConvexScene scene(ConvexKind::Regular, 300, 57);
    const FramesOfPairs frames(scene);
    frames.expectVaried();
    for (std::size_t forgotten = 1; forgotten < frames.size(); ++forgotten)
    {
        HostPairs pairs(scene.set, PsapExecutor::InOrder, 1);
        for (std::size_t frame = 0; frame < frames.size(); ++frame)
        {
            if (frame == forgotten)
                pairs.forget();
            EXPECT_TRUE(haveSameBits(frames.answer(pairs, frame),
                                     frames.expected(frame < forgotten ? 0 : forgotten, frame)))
                << "frame " << frame << ", forgotten before " << forgotten;
        }
    }
}

TEST(ConvexPairsOfAnyKind, OverlapExactlyWhereTheyTouch)
{
    const std::vector<Eigen::Vector3f> point = {{0.25f, 0.5f, 0.125f}};
    const std::vector<Eigen::Vector3f> segment = {{-1, 0, 0}, {1, 0, 0}, {0.5f, 0, 0}};
    const std::vector<Eigen::Vector3f> square = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    std::mt19937 engine(49);
    std::vector<Eigen::Vector3f> many;
    for (int i = 0; i < 70000; ++i)
        many.push_back(randomDirection(engine).cast<float>());
    ConvexBodies bodies;
    HullSet set;
    for (const auto& points : {point, segment, square, castPoints<float>(boxPoints(1, 1, 1)), many})
        set.add(makeHull(points, HullExtra::None));
    set.add(makeCloud(std::vector<Eigen::Vector3f>(many.begin(), many.begin() + 5000)));
    const auto bodyAt = [&](std::uint32_t hull, float x) {
        bodies.poses.push_back({{x, 0, 0}, hull, {0, 0, 0, 1}});
    };
    // The right end of each hull, at half of its height at most.
    const float rightEnds[] = {0.25f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f};
    std::vector<PairState> expected;
    for (std::uint32_t hull = 0; hull < set.size(); ++hull)
    {
        for (const float gap : {-0.01f, 0.01f})
        {
            // A box of side 2 to the right of the hull, whose points are at most 1e-3 inside of a sphere.
            bodyAt(hull, 0);
            bodyAt(3, rightEnds[hull] + 1 + gap);
            const auto last = static_cast<std::uint32_t>(bodies.poses.size());
            bodies.pairs.push_back({last - 2, last - 1});
            expected.push_back(gap < 0 ? PairState::Overlapping : PairState::Apart);
        }
    }
    HostPairs pairs(set, PsapExecutor::Shuffled, 1);
    for (int frame = 0; frame < 2; ++frame)
        EXPECT_EQ(pairs.query(bodies).states, expected) << frame;
}
}  // namespace
}  // namespace cullet::test
