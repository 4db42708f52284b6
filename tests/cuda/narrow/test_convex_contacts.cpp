// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Depths and contacts of convex pairs on the CPU's executor, in shuffled order, against penetration().

#include "cullet/tests/cuda/support/contact_check.h"
#include "cullet/tests/cuda/support/convex_check.h"
#include "cullet/tests/cuda/support/convex_scene.h"
#include "cullet/tests/cuda/support/host_pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <random>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr float kMargin = 0.02f;

/// 10^6 pairs of each kind by CULLET_CONTACT_PAIRS=500000.
std::size_t pairsOfScene()
{
    const char* const pairs = std::getenv("CULLET_CONTACT_PAIRS");
    return pairs != nullptr ? std::strtoul(pairs, nullptr, 10) : 1500;
}

class ConvexContacts : public testing::TestWithParam<ConvexKind>
{
};

TEST_P(ConvexContacts, HaveDepthsOfPenetrationAndPointsOfBothHulls)
{
    const unsigned seed = 61;
    SCOPED_TRACE("seed " + std::to_string(seed));
    ConvexScene scene(GetParam(), pairsOfScene(), seed);
    HostPairs pairs(scene.set, PsapExecutor::Shuffled, seed);
    ContactTally tally;
    for (int frame = 0; frame < 2; ++frame)
    {
        const float margin = frame == 0 ? 0.0f : kMargin;
        checkContacts(scene, pairs.contacts(scene, margin), margin, tally);
        EXPECT_EQ(pairs.depthCounts().unproved, 0u);
        EXPECT_LE(pairs.depthCounts().examined, pairs.counts().overlapping / 1000);
        scene.step();
    }
    EXPECT_EQ(tally.wrong, 0);
    expectVaried(tally, GetParam() == ConvexKind::Coincident);
}

TEST_P(ConvexContacts, HaveDepthsOfPenetrationWhereNoPolytopeIsLargeEnough)
{
    const unsigned seed = 69;
    SCOPED_TRACE("seed " + std::to_string(seed));
    ConvexScene scene(GetParam(), 120, seed);
    HostPairs pairs(scene.set, PsapExecutor::Shuffled, seed, {6, 8});
    ContactTally tally;
    checkContacts(scene, pairs.contacts(scene, kMargin), kMargin, tally);
    EXPECT_EQ(tally.wrong, 0);
    EXPECT_GT(pairs.depthCounts().large, pairs.depthCounts().examined);
    EXPECT_GT(pairs.depthCounts().examined, tally.pairs / 10);
    EXPECT_EQ(pairs.depthCounts().unproved, 0u);
}

TEST_P(ConvexContacts, GiveSameBitsInAnyOrderAndWithoutHistory)
{
    const unsigned seed = 62;
    SCOPED_TRACE("seed " + std::to_string(seed));
    ConvexScene scene(GetParam(), 500, seed);
    HostPairs inOrder(scene.set, PsapExecutor::InOrder, 1);
    HostPairs shuffled(scene.set, PsapExecutor::Shuffled, 2);
    HostPairs threads(scene.set, PsapExecutor::Threads, 3);
    for (int frame = 0; frame < 3; ++frame)
    {
        const ConvexAnswers expected = inOrder.contacts(scene, kMargin);
        EXPECT_GT(expected.contacts.size(), 100u);
        EXPECT_TRUE(haveSameBits(shuffled.contacts(scene, kMargin), expected));
        EXPECT_TRUE(haveSameBits(threads.contacts(scene, kMargin), expected));
        ConvexAnswers fresh = HostPairs(scene.set, PsapExecutor::Shuffled, 4).contacts(scene, kMargin);
        // What a query remembers are axes.
        fresh.axes = expected.axes;
        EXPECT_TRUE(haveSameBits(fresh, expected));
        scene.step();
    }
}

TEST_P(ConvexContacts, AreCompleteOnceMoreThanExpectedHaveFoundMemory)
{
    ConvexScene scene(GetParam(), 300, 63);
    HostPairs pairs(scene.set, PsapExecutor::Shuffled, 1), other(scene.set, PsapExecutor::Shuffled, 2);
    const ConvexAnswers few = pairs.contacts(scene, kMargin, 10), all = other.contacts(scene, kMargin);
    ASSERT_EQ(few.depths.size(), 10u);
    ASSERT_GT(all.depths.size(), 100u);
    EXPECT_EQ(few.overlaps, all.overlaps);
    EXPECT_EQ(std::memcmp(few.contacts.data(), all.contacts.data(), 10 * sizeof(PairContact)), 0);
    ConvexAnswers again = pairs.contacts(scene, kMargin, static_cast<std::uint32_t>(all.depths.size()));
    again.axes = all.axes;
    EXPECT_TRUE(haveSameBits(again, all));
}

INSTANTIATE_TEST_SUITE_P(Host, ConvexContacts, testing::ValuesIn(kConvexKinds), nameOfKind);

TEST(ConvexContactSizes, HaveDepthsOfPenetrationWhereFloatUnderflowsOrOverflows)
{
    for (const int exponent : {-40, -24, 22, 60})
    {
        SCOPED_TRACE(exponent);
        ConvexScene scene(ConvexKind::Regular, 200, 64);
        scene.rescale(exponent);
        HostPairs pairs(scene.set, PsapExecutor::Shuffled, 1);
        ContactTally tally;
        const float margin = std::ldexp(kMargin, exponent);
        checkContacts(scene, pairs.contacts(scene, margin), margin, tally);
        EXPECT_GT(tally.pairs, 40);
        EXPECT_EQ(tally.wrong, 0);
    }
}

/// Two bodies.
class TwoHulls
{
public:
    using Points = std::vector<Eigen::Vector3f>;

    TwoHulls(const Points& a, const Points& b)
        : TwoHulls(makeHull(a, HullExtra::None), makeHull(b, HullExtra::None))
    {
    }
    TwoHulls(const Hull<float>& a, const Hull<float>& b)
    {
        m_set.add(a);
        m_set.add(b);
        m_bodies.poses = {{{0, 0, 0}, 0, {0, 0, 0, 1}}, {{0, 0, 0}, 1, {0, 0, 0, 1}}};
        m_bodies.pairs = {{0, 1}};
    }

    void moveB(float x, float y, float z)
    {
        float* const position = m_bodies.poses[1].position;
        position[0] = x;
        position[1] = y;
        position[2] = z;
    }
    void turnB(const Eigen::Quaternionf& turn)
    {
        std::copy_n(turn.coeffs().data(), 4, m_bodies.poses[1].rotation);
    }

    /// Of the contact of both.
    PairContact contact(float margin = kMargin)
    {
        HostPairs pairs(m_set, PsapExecutor::Shuffled, 1);
        const ConvexAnswers answers = pairs.contacts(m_bodies, margin);
        counts = pairs.depthCounts();
        EXPECT_EQ(answers.contacts.size(), 1u);
        if (answers.contacts.empty())
            return {};
        depth = answers.depths[0];
        return answers.contacts[0];
    }

    PairDepth depth = {};
    convex::DepthCounts counts;

private:
    HullSet m_set;
    ConvexBodies m_bodies;
};

TwoHulls::Points boxOf(double x, double y, double z)
{
    return castPoints<float>(boxPoints(x, y, z));
}

/// Points of a contact by their coordinates, sorted.
std::vector<std::vector<float>> sortedPoints(const PairContact& contact)
{
    std::vector<std::vector<float>> points;
    for (std::uint32_t i = 0; i < contact.count; ++i)
    {
        std::vector<float> rounded;
        for (const float value : contact.points[i].pointB)
            rounded.push_back(std::round(value * 1e4f) * 1e-4f + 0.0f);
        points.push_back(rounded);
    }
    std::sort(points.begin(), points.end());
    return points;
}

TEST(KnownConvexContacts, HaveCornersOfOverlapWhereFacesTouch)
{
    TwoHulls boxes(boxOf(1, 1, 1), boxOf(2, 0.5, 1));
    boxes.moveB(0.5f, 0.75f, -1.99f);
    const PairContact contact = boxes.contact();
    EXPECT_NEAR(boxes.depth.depth, 0.01f, 1e-6f);
    EXPECT_EQ(vectorOf(contact.normal), Eigen::Vector3d(0, 0, 1));
    const std::vector<std::vector<float>> expected = {
        {-1, 0.25f, -0.99f}, {-1, 1, -0.99f}, {1, 0.25f, -0.99f}, {1, 1, -0.99f}};
    const auto found = sortedPoints(contact);
    ASSERT_EQ(found.size(), 4u);
    for (std::size_t i = 0; i < 4; ++i)
    {
        for (std::size_t k = 0; k < 3; ++k)
            EXPECT_NEAR(found[i][k], expected[i][k], 2e-4f) << i << " " << k;
        EXPECT_NEAR(contact.points[i].depth, 0.01f, 1e-6f);
    }
}

TEST(KnownConvexContacts, HaveEndsOfEdgeThatLiesOnFace)
{
    // A box on its edge, below another one.
    TwoHulls boxes(boxOf(1, 1, 1), boxOf(0.5, 0.5, 0.5));
    boxes.turnB(Eigen::Quaternionf(Eigen::AngleAxisf(0.7853982f, Eigen::Vector3f::UnitX())));
    boxes.moveB(0.75f, 0, -1 - 0.7071068f + 0.001f);
    const PairContact contact = boxes.contact(0);
    EXPECT_NEAR(boxes.depth.depth, 0.001f, 1e-6f);
    // The edge and where both of its faces leave the other body: the touch is within the first two.
    EXPECT_GE(contact.count, 2u);
    float least = 1, most = -1;
    for (std::uint32_t i = 0; i < contact.count; ++i)
    {
        least = std::min(least, contact.points[i].pointB[0]);
        most = std::max(most, contact.points[i].pointB[0]);
        EXPECT_LT(std::abs(contact.points[i].pointB[1]), 2e-3f);
    }
    EXPECT_NEAR(least, 0.25f, 1e-4f);
    EXPECT_NEAR(most, 1.0f, 1e-4f);
}

TEST(KnownConvexContacts, HaveOnePointWhereCornerTouchesFaceOrEdgesCross)
{
    TwoHulls corner(boxOf(1, 1, 1), {{0, 0, 0}, {1, 0, -2}, {-1, 1, -2}, {-1, -1, -2}});
    corner.moveB(0.25f, 0.5f, -0.999f);
    const PairContact atCorner = corner.contact(0);
    EXPECT_NEAR(corner.depth.depth, 0.001f, 1e-6f);
    EXPECT_NEAR(atCorner.points[0].pointB[0], 0.25f, 1e-5f);
    EXPECT_NEAR(atCorner.points[0].pointB[1], 0.5f, 1e-5f);

    // Two prisms whose edges cross above each other.
    TwoHulls edges({{-2, 0, 0}, {2, 0, 0}, {-2, 1, 1}, {2, 1, 1}, {-2, -1, 1}, {2, -1, 1}},
                   {{0, -2, 0}, {0, 2, 0}, {1, -2, -1}, {1, 2, -1}, {-1, -2, -1}, {-1, 2, -1}});
    edges.moveB(0.5f, 0.25f, 0.002f);
    const PairContact crossing = edges.contact(0);
    EXPECT_NEAR(edges.depth.depth, 0.002f, 1e-6f);
    EXPECT_NEAR(crossing.normal[2], 1.0f, 1e-6f);
    EXPECT_NEAR(crossing.points[0].pointB[0], 0.5f, 3e-3f);
    EXPECT_NEAR(crossing.points[0].pointB[1], 0.0f, 3e-3f);
    // All of the contact is as small as it is deep.
    for (std::uint32_t i = 1; i < crossing.count; ++i)
    {
        EXPECT_NEAR(crossing.points[i].pointB[0], 0.5f, 5e-3f);
        EXPECT_NEAR(crossing.points[i].pointB[1], 0.0f, 5e-3f);
    }
}

TEST(FlatConvexContacts, HaveDepthsAndPointsWithoutVolume)
{
    const TwoHulls::Points point = {{0.25f, 0.5f, 0.125f}}, segment = {{-1, 0, 0}, {1, 0, 0}},
                           square = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    const TwoHulls::Points box = boxOf(1, 1, 1);
    struct Case
    {
        const char* name;
        TwoHulls::Points a, b;
        float place[3];
        float depth;
    };
    const Case cases[] = {
        {"point in box", box, point, {0, 0, 0}, 0.5f},
        {"segment in box", box, segment, {0, 0.75f, 0}, 0.25f},
        {"square in box", box, square, {0, 0, 0.875f}, 0.125f},
        {"square in square", square, square, {0.5f, 0.5f, 0}, 0.0f},
        {"segment on square", square, segment, {0.25f, 0.5f, 0}, 0.0f},
        {"segments in one line", segment, segment, {0.5f, 0, 0}, 0.0f},
        {"points in one place", point, point, {0, 0, 0}, 0.0f},
        {"point on square", square, point, {0, 0, -0.125f}, 0.0f},
    };
    for (const Case& one : cases)
    {
        SCOPED_TRACE(one.name);
        TwoHulls hulls(one.a, one.b);
        hulls.moveB(one.place[0], one.place[1], one.place[2]);
        const PairContact contact = hulls.contact();
        EXPECT_NEAR(hulls.depth.depth, one.depth, 1e-6f);
        EXPECT_NEAR(hulls.depth.gap, 0.0f, 1e-6f);
        EXPECT_NEAR(vectorOf(contact.normal).norm(), 1.0, 1e-6);
        EXPECT_GE(contact.count, 1u);
        for (const float coordinate : contact.points[0].pointB)
            EXPECT_LE(std::abs(coordinate), 2.0f);
    }
}

/// Points on a unit sphere.
TwoHulls::Points spherePoints(int count, unsigned seed)
{
    std::mt19937 engine(seed);
    TwoHulls::Points points;
    for (int i = 0; i < count; ++i)
        points.push_back(randomDirection(engine).cast<float>());
    return points;
}

TEST(DeepConvexContacts, TakeLargePolytopeForRoundHullsInOnePlace)
{
    // A - B has thousands of faces at nearly the same distance.
    const TwoHulls::Points points = spherePoints(1000, 65);
    TwoHulls spheres(points, points);
    const Eigen::AngleAxisf turn(1.0f, Eigen::Vector3f(1, 2, 3).normalized());
    spheres.turnB(Eigen::Quaternionf(turn));
    spheres.contact();
    EXPECT_EQ(spheres.counts.large, 1u);
    EXPECT_EQ(spheres.counts.examined, 0u);
    std::vector<Eigen::Vector3d> wide;
    for (const Eigen::Vector3f& point : points)
        wide.push_back(point.cast<double>());
    const Hull<double> exact = makeHull(wide, HullExtra::None);
    const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal;
    double depth = 0;
    ASSERT_TRUE(exactPenetration(PosedHull<double>(exact, Eigen::Matrix3d::Identity(), zero),
                                 PosedHull<double>(exact, turn.toRotationMatrix().cast<double>(), zero),
                                 normal, depth));
    EXPECT_NEAR(spheres.depth.depth, depth, 1e-6);
    EXPECT_LE(spheres.depth.gap, 1e-6f);
}

TEST(DeepConvexContacts, SayHowFarTheyAreProvedWithoutFaces)
{
    const TwoHulls::Points points = spherePoints(2000, 66);
    TwoHulls clouds(makeCloud(points), makeCloud(points));
    const PairContact contact = clouds.contact();
    EXPECT_EQ(clouds.counts.unproved, 1u);
    EXPECT_NEAR(clouds.depth.depth, 2.0f, 0.02f);
    EXPECT_GT(clouds.depth.gap, 1e-5f);
    EXPECT_LT(clouds.depth.gap, 0.2f);
    EXPECT_EQ(contact.count, 1u);
}
}  // namespace
}  // namespace cullet::test
