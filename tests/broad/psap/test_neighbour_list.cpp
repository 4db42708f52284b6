// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Neighbour lists: skins, closeness, and when a list is kept.

#include "cullet/broad/psap/verlet/neighbour_list.h"
#include "cullet/broad/psap/verlet/neighbour_steps.h"
#include "cullet/broad/psap/verlet/pair_list_steps.h"
#include "cullet/broad/psap/verlet/skin_policy.h"
#include "cullet/cuda/host/host_exec.h"
#include "cullet/tests/support/boxes.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

namespace cullet::test
{
namespace
{
using psap::NeighbourMode;

constexpr std::uint32_t kSeed = 4711;

/// A box with size and position of any magnitude.
Aabb anyBox(Random& random, float scale, float offset)
{
    Aabb box;
    for (int axis = 0; axis < 3; ++axis)
    {
        const float low = offset + scale * random.between(-1, 1);
        const float high = low + scale * random.between(0, 1);
        box.min[axis] = std::min(low, high);
        box.max[axis] = std::max(low, high);
    }
    return box;
}

/// Moves no side by more than `farthest`, as rounded to float.
Aabb moved(Random& random, const Aabb& box, float farthest)
{
    Aabb other = box;
    for (int axis = 0; axis < 3; ++axis)
    {
        other.min[axis] += random.between(-farthest, farthest);
        other.max[axis] += random.between(-farthest, farthest);
        if (other.min[axis] > other.max[axis])
            std::swap(other.min[axis], other.max[axis]);
    }
    return other;
}

TEST(PsapSkins, GrowBoxesByAtLeastTheirThickness)
{
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    Random random(kSeed);
    int rounded = 0;
    for (int trial = 0; trial < 100000; ++trial)
    {
        const float scale = std::pow(10.0f, random.between(-6, 6));
        const float share = random.between(-1, 1);
        const Aabb box = anyBox(random, scale, share * std::pow(10.0f, random.between(-6, 8)));
        const float skin = scale * std::pow(10.0f, random.between(-5, 1));
        const Aabb grown = psap::grownBy(box, skin);
        for (int axis = 0; axis < 3; ++axis)
        {
            ASSERT_LE(double{grown.min[axis]}, double{box.min[axis]} - double{skin});
            ASSERT_GE(double{grown.max[axis]}, double{box.max[axis]} + double{skin});
            rounded += double{box.max[axis] + skin} < double{box.max[axis]} + double{skin} ? 1 : 0;
        }
    }
    EXPECT_GT(rounded, 30000);  // a plain sum would fail
    const Aabb unbounded = {{-kInfinity, -1, 0}, {kInfinity, 1, kInfinity}};
    const Aabb grown = psap::grownBy(unbounded, 1);
    EXPECT_EQ(grown.min[0], -kInfinity);
    EXPECT_EQ(grown.max[2], kInfinity);
    const Aabb atTheEnds = {{-kInfinity, kInfinity, 0}, {-kInfinity, kInfinity, 1}};
    EXPECT_TRUE(isValid(psap::grownBy(atTheEnds, 1)));
}

TEST(PsapSkins, DecideOverlapByClosenessWhileBoxesStayInside)
{
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    Random random(kSeed);
    int surelyTogether = 0, surelyApart = 0, open = 0, unlike = 0, gone = 0;
    for (int trial = 0; trial < 1000000; ++trial)
    {
        const float scale = std::pow(10.0f, random.between(-20, 15));
        const float offset = scale * random.between(-10, 10);
        psap::SkinnedBox a = {anyBox(random, scale, offset), scale * random.between(0.05f, 0.3f)};
        psap::SkinnedBox b = {anyBox(random, scale, offset), scale * random.between(0.05f, 0.3f)};
        // Also boxes that touch, contain each other, or do not move.
        if (trial % 7 == 0)
            b.box.min[0] = std::min(b.box.max[0], a.box.max[0]);
        const float share = trial % 5 == 0 ? 0.0f : random.between(0, 1.1f);
        const Aabb nowA = moved(random, a.box, share * a.skin), nowB = moved(random, b.box, share * b.skin);
        const float displacement = std::max(psap::displacementOf(a, nowA), psap::displacementOf(b, nowB));
        const bool areTogether = overlaps(nowA, nowB);
        if (!(displacement <= psap::kMostDisplacement))
        {
            ++gone;
            continue;
        }
        unlike += areTogether != overlaps(a.box, b.box) ? 1 : 0;
        if (!overlaps(psap::grownBy(a.box, a.skin), psap::grownBy(b.box, b.skin)))
        {
            ASSERT_FALSE(areTogether) << "a pair that is not near overlaps";
            continue;
        }
        const float closeness = psap::closenessOf(a, b);
        const float sure = psap::decisiveCloseness(displacement);
        ASSERT_FALSE(closeness > sure && !areTogether) << trial;
        ASSERT_FALSE(closeness < -sure && areTogether) << trial;
        surelyTogether += closeness > sure ? 1 : 0;
        surelyApart += closeness < -sure ? 1 : 0;
        open += std::fabs(closeness) <= sure ? 1 : 0;
    }
    EXPECT_GT(surelyTogether, 20000);
    EXPECT_GT(surelyApart, 20000);
    EXPECT_GT(open, 50000);
    EXPECT_GT(unlike, 10000);
    EXPECT_GT(gone, 10000);
}

TEST(PsapSkins, ReportInfiniteDisplacementWhenBoxAppearsOrVanishes)
{
    const Aabb box = {{0, 0, 0}, {1, 1, 1}};
    const Aabb inverted = {{0, 0.01f, 0}, {1, 0, 1}};
    const Aabb lost = {{kNan, 0, 0}, {1, 1, 1}};
    EXPECT_EQ(psap::displacementOf({box, 1}, box), 0.0f);
    EXPECT_EQ(psap::displacementOf({box, 2}, {{0.5f, 0, 0}, {1, 1, 1}}), 0.25f);
    EXPECT_EQ(psap::displacementOf({box, 1}, inverted), kInfinity);
    EXPECT_EQ(psap::displacementOf({box, 1}, lost), kInfinity);
    EXPECT_EQ(psap::displacementOf({psap::emptyBox(), 1}, box), kInfinity);
    EXPECT_EQ(psap::displacementOf({psap::emptyBox(), 1}, lost), 0.0f);
    const Aabb unbounded = {{-kInfinity, 0, 0}, {kInfinity, 1, 1}};
    EXPECT_EQ(psap::displacementOf({unbounded, 1}, unbounded), 0.0f);
    EXPECT_EQ(psap::displacementOf({unbounded, 1}, box), kInfinity);
    // Undecidable cases must be tested.
    const Aabb atInfinity = {{kInfinity, 0, 0}, {kInfinity, 1, 1}};
    EXPECT_FALSE(std::fabs(psap::closenessOf({unbounded, 1}, {atInfinity, 1})) >= 0);
}

TEST(PsapSkins, AreThickerForFastBoxesUpToLimit)
{
    const psap::SkinRule rule = {1};
    EXPECT_EQ(rule.skinFor(0), 1);
    EXPECT_EQ(rule.skinFor(0.5f), 1);
    EXPECT_EQ(rule.skinFor(0.6f), 2);
    EXPECT_EQ(rule.skinFor(2), 4);
    EXPECT_EQ(rule.skinFor(2.1f), 1);
    EXPECT_EQ(rule.skinFor(kInfinity), 1);
}

// The boxes of other pairs are not loaded.
TEST(PsapSkins, LeaveOnlyPairsWithSentRowsUndecided)
{
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    Random random(kSeed);
    constexpr std::uint32_t kRows = 96;
    std::vector<std::uint32_t> sent(kRows / 32);
    for (std::uint32_t row = 0; row < kRows; ++row)
        sent[row / 32] |= random.chance(0.3f) ? 1u << row % 32 : 0u;
    const std::uint32_t displacement = 0;
    psap::FollowHeld step = {};
    step.displacement = &displacement;
    int undecided = 0;
    for (std::uint32_t a = 0; a < kRows; ++a)
        for (std::uint32_t b = 0; b < kRows; ++b)
        {
            const psap::NeighbourItem item = {{a, b}, 0, false, true};
            const bool isSent = (sent[a / 32] >> a % 32 & 1u) != 0 || (sent[b / 32] >> b % 32 & 1u) != 0;
            step.sentRows = sent.data();
            ASSERT_EQ(step.isUndecided(item), isSent) << a << ", " << b;
            undecided += isSent ? 1 : 0;
            step.sentRows = nullptr;
            ASSERT_TRUE(step.isUndecided(item));
        }
    EXPECT_NEAR(undecided, 0.51 * kRows * kRows, 0.2 * kRows * kRows);
}

TEST(PsapSkins, SampleOnlyBoxesOfTheSet)
{
    constexpr float kBehind = 1000;
    std::vector<Aabb> boxes(5001, cube(0, 1));
    std::uint64_t clamped = 0;
    for (std::uint64_t count = 1; count < boxes.size(); ++count)
    {
        boxes[count] = cube(0, kBehind);
        for (const std::uint64_t most : {4u, 100u, 1024u})
        {
            const std::uint64_t stride = (count + most - 1) / most;
            const std::uint64_t last = (count + stride - 1) / stride - 1;
            std::vector<psap::BoxInSample> sample(last + 1);
            psap::SampleBoxes<psap::RowBoxes>{
                {boxes.data(), boxes.data()}, stride, count, sample.data()}(last);
            ASSERT_EQ(sample[last].side, 1) << count << ", " << most;
            clamped += last * stride + stride > count ? 1 : 0;
        }
        boxes[count] = cube(0, 1);
    }
    EXPECT_GT(clamped, 1000u) << "the last box of the sample may lie behind the set";
}

constexpr std::uint64_t kManyBoxes = 100000;

/// A scene as input of the policy: boxes of one size that move equally far in each set.
class Scene
{
public:
    Scene(PsapNearPairs choice, float way) : m_policy(choice), m_way(way) {}

    /// @return the final decision for the next set
    NeighbourMode step(bool someJump = false)
    {
        NeighbourMode frame = m_policy.choose(boxes);
        if (frame == NeighbourMode::Follow)
        {
            m_gone += someJump ? kInfinity : m_way;
            const float displacement = m_gone / m_policy.rule().common;
            m_policy.recordFollowed(displacement);
            if (!(displacement <= psap::kMostDisplacement))
            {
                ++voids;
                frame = m_policy.search();
            }
        }
        if (frame == NeighbourMode::Begin)
        {
            m_gone = 0;
            m_policy.recordBegun(near, boxes, boxes);
        }
        ++counts[static_cast<int>(frame)];
        if (m_policy.wantsSample(boxes))
        {
            std::vector<psap::BoxInSample> sample(100, {1.0f, m_way});
            m_policy.recordSampling();
            m_policy.recordSample(sample.data(), sample.size());
        }
        return frame;
    }
    int count(NeighbourMode frame) const { return counts[static_cast<int>(frame)]; }
    void setWay(float way) { m_way = way; }

    std::uint64_t boxes = kManyBoxes, near = 200000;
    int voids = 0;

private:
    psap::SkinPolicy m_policy;
    float m_way;
    float m_gone = 0;
    int counts[3] = {};
};

/// A scene with lists that are built asynchronously after a set.
class SceneBehind
{
public:
    SceneBehind(PsapNearPairs choice, float way) : m_policy(choice), m_way(way) {}

    /// @param way motion of the boxes, if it changes
    void step(float way)
    {
        const bool isFollowed = m_policy.chooseFollow(boxes, thinnest);
        m_gone += way;
        if (isFollowed)
            follow();
        else
            ++searched;
        if (m_policy.wantsSample(boxes))
        {
            std::vector<psap::BoxInSample> sample(100, {1.0f, m_way});
            m_policy.recordSampling();
            m_policy.recordSample(sample.data(), sample.size());
        }
        if (m_policy.tryBegin(boxes))
        {
            ++behind;
            m_gone = 0;
        }
    }
    void step() { step(m_way); }

    std::uint64_t boxes = kManyBoxes;
    float thinnest = 0;
    int searched = 0, followed = 0, voids = 0, ahead = 0, behind = 0;

private:
    void follow()
    {
        const float displacement = m_gone / m_policy.rule().common;
        const bool isAhead = m_policy.tryBeginEarly();
        const bool isTold = displacement <= psap::kMostDisplacement;
        ++(isTold ? followed : voids);
        if (!isAhead)
            return m_policy.recordFollowed(displacement);
        ++ahead;
        m_gone = 0;
        if (!isTold)
            m_policy.forget();
    }

    psap::SkinPolicy m_policy;
    float m_way;
    float m_gone = 0;
};

TEST(SkinPolicy, MakesNeighbourListsAheadWhenBoxesMoveAsFarAsBefore)
{
    for (const float way : {0.0f, 1e-4f, 0.01f, 0.03f, 0.06f})
    {
        SCOPED_TRACE(way);
        SceneBehind scene(PsapNearPairs::Automatic, way);
        for (int set = 0; set < 400; ++set)
            scene.step();
        EXPECT_LT(scene.searched, 4);
        EXPECT_GT(scene.followed, 395);
        EXPECT_EQ(scene.voids, 0);
        // The first list, and those after skins that were too thin.
        EXPECT_LE(scene.behind, 3);
        EXPECT_LT(scene.ahead, 200);
        EXPECT_GE(scene.ahead, way >= 0.03f ? 40 : 0);
    }
}

TEST(SkinPolicy, MakesNeighbourListsAfterSetsThatWereSearched)
{
    SceneBehind scene(PsapNearPairs::Automatic, 0.03f), jumping(PsapNearPairs::Automatic, 0.01f);
    for (int set = 0; set < 2000; ++set)
    {
        scene.step(set % 97 == 96 ? kInfinity : 0.03f);
        jumping.step(kInfinity);
    }
    EXPECT_EQ(scene.voids, 20);
    EXPECT_GT(scene.followed, 1500);  // teleports that end a new list cause pauses
    EXPECT_GT(scene.ahead, 200);
    EXPECT_GT(scene.behind, 15);
    EXPECT_LT(jumping.behind, 30);
    EXPECT_GT(jumping.behind, 4);
}

TEST(SkinPolicy, FollowsNeighbourListsWhenBoxesMoveShortDistances)
{
    for (const float way : {0.0f, 1e-4f, 0.01f, 0.03f, 0.06f})
    {
        SCOPED_TRACE(way);
        Scene scene(PsapNearPairs::Automatic, way);
        for (int set = 0; set < 400; ++set)
            scene.step();
        EXPECT_LT(scene.count(NeighbourMode::Search), 4);
        EXPECT_GT(scene.count(NeighbourMode::Follow), 2 * scene.count(NeighbourMode::Begin));
        EXPECT_EQ(scene.voids, 0);
    }
}

TEST(SkinPolicy, DoesNotKeepNeighbourListsThatDoNotPay)
{
    Scene fast(PsapNearPairs::Automatic, 0.2f), slow(PsapNearPairs::Automatic, 0.01f);
    Scene never(PsapNearPairs::Never, 0.01f), always(PsapNearPairs::Always, 0.2f),
        crowded(PsapNearPairs::Automatic, 0.01f);
    crowded.near = 10000000;
    for (int set = 0; set < 2000; ++set)
    {
        fast.step();
        slow.step(true);
        never.step();
        always.step(true);
        crowded.step();
    }
    EXPECT_EQ(fast.count(NeighbourMode::Search), 2000);
    EXPECT_LT(slow.count(NeighbourMode::Begin), 30);  // pauses get longer
    EXPECT_GT(slow.count(NeighbourMode::Begin), 4);   // but a list is tried again
    EXPECT_EQ(never.count(NeighbourMode::Search), 2000);
    EXPECT_GT(always.count(NeighbourMode::Begin), 1900);
    EXPECT_LT(crowded.count(NeighbourMode::Begin), 20);
}

TEST(SkinPolicy, UsesNoNeighbourListsInSmallWorldsUnlessForced)
{
    Scene small(PsapNearPairs::Automatic, 0.01f), forced(PsapNearPairs::Always, 0.01f);
    small.boxes = forced.boxes = 1000;
    for (int set = 0; set < 100; ++set)
    {
        small.step();
        forced.step();
    }
    EXPECT_EQ(small.count(NeighbourMode::Search), 100);
    EXPECT_GT(forced.count(NeighbourMode::Follow), 70);
}

TEST(SkinPolicy, EndsNeighbourListWhenTooFewBoxesAreLeft)
{
    Scene scene(PsapNearPairs::Automatic, 0.001f);
    for (int set = 0; set < 10; ++set)
        scene.step();
    ASSERT_EQ(scene.step(), NeighbourMode::Follow);
    scene.boxes = 1000;
    EXPECT_EQ(scene.step(), NeighbourMode::Search);
    EXPECT_EQ(scene.step(), NeighbourMode::Search);
    scene.boxes = kManyBoxes;
    EXPECT_EQ(scene.step(), NeighbourMode::Begin) << "the old list lacks the sets between";
}

TEST(SkinPolicy, MakesNoNeighbourListsWithSkinsThickerThanAQuarterOfABoxUnlessForced)
{
    for (const float thinnest : {0.0f, 0.2f, 0.25f, 0.26f, 1.0f})
    {
        SCOPED_TRACE(thinnest);
        SceneBehind scene(PsapNearPairs::Automatic, 0.001f), forced(PsapNearPairs::Always, 0.001f);
        scene.thinnest = forced.thinnest = thinnest;
        for (int set = 0; set < 50; ++set)
        {
            scene.step();
            forced.step();
        }
        EXPECT_EQ(scene.followed > 40, thinnest <= 0.25f);
        EXPECT_EQ(scene.searched == 50, thinnest > 0.25f);
        EXPECT_GT(forced.followed, 40);
    }
}

TEST(SkinPolicy, TriesNeighbourListsAgainWhenSceneComesToRest)
{
    Scene scene(PsapNearPairs::Automatic, 0.5f);
    for (int set = 0; set < 500; ++set)
        scene.step();
    EXPECT_EQ(scene.count(NeighbourMode::Follow), 0);
    scene.setWay(0.001f);
    for (int set = 0; set < 500; ++set)
        scene.step();
    EXPECT_GT(scene.count(NeighbourMode::Follow), 450);
}

TEST(SkinPolicy, KeepsSearchingAfterSamplesWithoutBoxesOrSizes)
{
    psap::SkinPolicy policy(PsapNearPairs::Always);
    std::vector<psap::BoxInSample> none(10, {-1.0f, 0.0f});
    policy.recordSample(none.data(), none.size());
    EXPECT_EQ(policy.choose(100), NeighbourMode::Search);
    std::vector<psap::BoxInSample> points(10, {0.0f, 0.0f});
    policy.recordSample(points.data(), points.size());
    EXPECT_EQ(policy.choose(100), NeighbourMode::Search);
    policy.recordSample(points.data(), 0);
    EXPECT_EQ(policy.choose(100), NeighbourMode::Search);
}

/// A policy whose list of slow boxes was followed so often; its skins are a twentieth of a box.
psap::SkinPolicy policyWithList(int sets)
{
    psap::SkinPolicy policy(PsapNearPairs::Automatic);
    std::vector<psap::BoxInSample> sample(100, {1.0f, 0.01f});
    policy.recordSample(sample.data(), sample.size());
    EXPECT_EQ(policy.choose(kManyBoxes), NeighbourMode::Begin);
    for (int set = 0; set < sets; ++set)
    {
        EXPECT_EQ(policy.choose(kManyBoxes), NeighbourMode::Follow);
        policy.recordFollowed(0.001f);
    }
    EXPECT_FLOAT_EQ(policy.rule().common, 0.05f);
    return policy;
}

TEST(SkinPolicy, PausesAfterListsThatWereFollowedOnceAtMost)
{
    for (const int sets : {0, 1, 2, 3, 64, 65, 100})
    {
        SCOPED_TRACE(sets);
        psap::SkinPolicy policy = policyWithList(sets);
        policy.recordFollowed(kInfinity);
        EXPECT_EQ(policy.search(), sets < 2 ? NeighbourMode::Search : NeighbourMode::Begin);
    }
}

TEST(SkinPolicy, AdaptsSkinsToTheNumberOfSetsThatListsLast)
{
    // {sets, displacement that ends the list, skins after it}: those of five sets, of 1.5 times as many, of 0.7 times.
    const std::vector<std::tuple<int, float, float>> cases = {{2, 1.5f, 0.075f}, {2, 3.9f, 0.075f},
                                                              {2, 4.0f, 0.05f},  {3, 1.5f, 0.05f},
                                                              {64, 1.5f, 0.05f}, {65, 1.5f, 0.035f}};
    for (const auto& [sets, displacement, skin] : cases)
    {
        SCOPED_TRACE(sets);
        psap::SkinPolicy policy = policyWithList(sets);
        const std::uint32_t revision = policy.revision();
        policy.recordFollowed(displacement);
        EXPECT_FLOAT_EQ(policy.rule().common, skin) << displacement;
        EXPECT_EQ(policy.revision() != revision, skin != 0.05f) << "launches are recorded again without need";
    }
}

TEST(SkinPolicy, KeepsListsOfUpToSixNeighboursForEachBoxAndPair)
{
    constexpr std::uint64_t kPairs = 30000, kMost = 6 * (kManyBoxes + kPairs);
    for (const std::uint64_t neighbours : {std::uint64_t{0}, kMost, kMost + 1})
    {
        SCOPED_TRACE(neighbours);
        psap::SkinPolicy policy = policyWithList(0);
        policy.recordBegun(neighbours, kManyBoxes, kPairs);
        EXPECT_EQ(policy.choose(kManyBoxes),
                  neighbours <= kMost ? NeighbourMode::Follow : NeighbourMode::Search);
    }
}

TEST(PsapNeighbours, AreFollowedUnlessThereAreManyForEachBoxAndPair)
{
    constexpr std::uint64_t kPairs = 5, kMost = 6 * (kManyBoxes + kPairs);
    for (const std::uint64_t found : {std::uint64_t{10}, kMost, kMost + 1})
    {
        SCOPED_TRACE(found);
        psap::HostExec exec{PsapOptions{}};
        psap::NeighbourStore<psap::HostExec> store{PsapOptions{}};
        store.policy() = policyWithList(0);
        ASSERT_TRUE(store.reserve(exec, kManyBoxes));
        store.recordBegun(found, kPairs);
        EXPECT_EQ(store.choose(kManyBoxes), found <= kMost ? NeighbourMode::Follow : NeighbourMode::Search);
    }
}

TEST(SkinPolicy, BeginsListsWithSkinsOfAtLeastTheThinnest)
{
    for (const float thinnest : {0.0f, 0.04f, 0.2f})
    {
        psap::SkinPolicy policy = policyWithList(3);
        policy.forget();
        EXPECT_FALSE(policy.chooseFollow(kManyBoxes, thinnest));
        EXPECT_TRUE(policy.tryBegin(kManyBoxes)) << thinnest;
        EXPECT_FLOAT_EQ(policy.rule().common, std::max(0.05f, thinnest));
    }
}

TEST(SkinPolicy, BeginsWithTheNumberOfBoxesThatTwoLaunchesTake)
{
    constexpr std::uint64_t kFewest = 1u << 15;
    Scene few(PsapNearPairs::Automatic, 0.01f), enough(PsapNearPairs::Automatic, 0.01f);
    few.boxes = kFewest - 1;
    enough.boxes = kFewest;
    for (int set = 0; set < 20; ++set)
    {
        few.step();
        enough.step();
    }
    EXPECT_EQ(few.count(NeighbourMode::Search), 20);
    EXPECT_GT(enough.count(NeighbourMode::Follow), 10);
}

TEST(PsapSkins, DivideManyBoxesAmongIndicesOfEightEach)
{
    constexpr std::uint64_t kMany = psap::StridedBoxes::kManyBoxes;
    for (const std::uint64_t count : {kMany - 1, kMany, kMany + 1, kMany + 7, kMany + 8})
    {
        SCOPED_TRACE(count);
        const psap::StridedBoxes boxes = {count};
        EXPECT_EQ(boxes.indices(), count < kMany ? count : (count + 7) / 8);
        std::vector<std::uint8_t> visits(count);
        for (std::uint64_t index = 0; index < boxes.indices(); ++index)
            boxes.forEach(index, [&](std::uint64_t i) { ++visits.at(i); });
        EXPECT_EQ(std::count(visits.begin(), visits.end(), 1), static_cast<std::ptrdiff_t>(count));
    }
}
}  // namespace
}  // namespace cullet::test
