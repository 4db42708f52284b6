// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Two boxes by BoxBoxAlgorithm, beside Bullet's own algorithm.

#include "cullet/plugin/convex/box_box_algorithm.h"
#include "cullet/plugin/convex/box_kernels.h"
#include "cullet/tests/plugin/convex/convex_contacts.h"
#include "cullet/tests/support/process/floating_point_flags.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
bool isOurs(const btCollisionAlgorithm& algorithm)
{
    return dynamic_cast<const BoxBoxAlgorithm*>(&algorithm) != nullptr;
}

/// Two boxes and a pose of each, which overlap or are nearly so.
struct BoxPose
{
    btVector3 halfA, halfB;
    btTransform a, b;
};

class BoxPoses
{
public:
    explicit BoxPoses(unsigned seed) : m_engine(seed) {}

    BoxPose draw(bool isLevel)
    {
        BoxPose pose;
        pose.halfA = drawVec(m_extent, m_engine);
        pose.halfB = drawVec(m_extent, m_engine);
        pose.a = btTransform(randomRotation(m_engine), drawVec(m_unit, m_engine) * 3);
        if (!isLevel)
        {
            pose.b = btTransform(randomRotation(m_engine),
                                 pose.a.getOrigin() + drawVec(m_unit, m_engine) * btScalar(1.1));
            return pose;
        }
        const btVector3 shift = drawVec(m_unit, m_engine) * btScalar(0.2);
        const btQuaternion turn(vec(0, 1, 0), btScalar(m_unit(m_engine)));
        const btScalar height = (pose.halfA.y() + pose.halfB.y()) * btScalar(0.99);
        pose.b = pose.a * btTransform(turn, vec(shift.x(), height, shift.z()));
        pose.b = tremble(pose.b, 1e-3);
        return pose;
    }

    btTransform tremble(const btTransform& at, double by)
    {
        const btVector3 axis = drawVec(m_unit, m_engine), shift = drawVec(m_unit, m_engine);
        const btQuaternion turn(axis.normalized(), btScalar(by));
        return btTransform(turn * at.getRotation(), at.getOrigin() + shift * btScalar(by));
    }

private:
    std::mt19937 m_engine;
    std::uniform_real_distribution<double> m_unit{-1, 1}, m_extent{0.2, 0.8};
};

double deepestOf(const std::vector<Reported>& points)
{
    double deepest = 1;
    for (const Reported& point : points)
        deepest = std::min(deepest, point.distance);
    return deepest;
}

TEST(BoxPairs, TouchWhereBulletsDoAndAreNoDeeper)
{
    constexpr double kNoise = 1e-4;
    ConvexBench ours, stock(true);
    BoxPoses poses(31);
    int touching = 0, separated = 0, alike = 0, fewer = 0;
    for (int k = 0; k < 3000; ++k)
    {
        SCOPED_TRACE(k);
        const BoxPose pose = poses.draw(k % 2 == 0);
        btBoxShape a(pose.halfA), b(pose.halfB);
        ConvexPairProbe our(ours.dispatcher, a, b), his(stock.dispatcher, a, b);
        ASSERT_TRUE(isOurs(*our.algorithm));
        our.place(pose.a, pose.b);
        his.place(pose.a, pose.b);
        const std::vector<Reported> mine = our.query(), theirs = his.query();
        if (mine.empty() || theirs.empty())
        {
            EXPECT_LT(std::abs(deepestOf(mine.empty() ? theirs : mine)),
                      mine.size() == theirs.size() ? 2 : kNoise);
            ++separated;
            continue;
        }
        ++touching;
        // Bullet takes an edge only if that is a twentieth less deep than every face.
        const double depth = -deepestOf(mine), hisDepth = -deepestOf(theirs);
        EXPECT_LT(depth, hisDepth + kNoise);
        EXPECT_GT(depth, hisDepth / 1.05 - kNoise);
        fewer += mine.size() < theirs.size() && (mine[0].normal - theirs[0].normal).length() < 1e-3 ? 1 : 0;
        alike += (mine[0].normal - theirs[0].normal).length() < 1e-3 ? 1 : 0;
    }
    EXPECT_GT(touching, 1500);
    EXPECT_GT(separated, 300);
    EXPECT_GT(alike, touching * 8 / 10);
    EXPECT_LT(fewer, touching / 10);
}

/// The points of a manifold, in order, as bytes that may be compared.
std::vector<btScalar> numbersOf(const btPersistentManifold& manifold)
{
    std::vector<btScalar> numbers;
    for (int i = 0; i < manifold.getNumContacts(); ++i)
    {
        const btManifoldPoint& point = manifold.getContactPoint(i);
        for (const btVector3* v : {&point.m_localPointA, &point.m_localPointB, &point.m_positionWorldOnA,
                                   &point.m_positionWorldOnB, &point.m_normalWorldOnB,
                                   &point.m_lateralFrictionDir1, &point.m_lateralFrictionDir2})
            numbers.insert(numbers.end(), v->m_floats, v->m_floats + 4);
        numbers.insert(
            numbers.end(),
            {point.m_distance1, point.m_combinedFriction, point.m_combinedRestitution,
             point.m_combinedRollingFriction, point.m_combinedSpinningFriction, point.m_appliedImpulse,
             point.m_contactCFM, point.m_contactERP, btScalar(point.m_lifeTime), btScalar(point.m_partId0),
             btScalar(point.m_index1), btScalar(point.m_contactPointFlags)});
    }
    return numbers;
}

bool ignoreContact(btManifoldPoint&, void*, void*)
{
    return true;
}

/// Bullet's functions update the manifold while an application's callback is set.
struct ProcessedScope
{
    ProcessedScope() { gContactProcessedCallback = ignoreContact; }
    ~ProcessedScope() { gContactProcessedCallback = nullptr; }
};

TEST(BoxPairs, UpdateTheirManifoldAsBulletDoes)
{
    ConvexBench bench;
    BoxPoses poses(32);
    int points = 0, older = 0;
    const btVector3 kFar = vec(1, 1, 1) * (btScalar(0.02) / std::numeric_limits<btScalar>::epsilon());
    for (int k = 0; k < 400; ++k)
    {
        BoxPose pose = poses.draw(k % 4 != 0);
        // Far away, where rounding moves points by as much as ends a contact.
        if (k % 10 == 9)
        {
            pose.a.setOrigin(pose.a.getOrigin() + kFar);
            pose.b.setOrigin(pose.b.getOrigin() + kFar);
        }
        btBoxShape a(pose.halfA), b(pose.halfB);
        ConvexPairProbe one(bench.dispatcher, a, b), two(bench.dispatcher, a, b);
        btTransform at = pose.b;
        for (int step = 0; step < 12; ++step)
        {
            SCOPED_TRACE(std::to_string(k) + ", step " + std::to_string(step));
            one.place(pose.a, at);
            two.place(pose.a, at);
            const btPersistentManifold& mine = *one.step();
            const ProcessedScope scope;
            const btPersistentManifold& bullets = *two.step();
            ASSERT_EQ(numbersOf(mine), numbersOf(bullets));
            points += mine.getNumContacts();
            older += mine.getNumContacts() > 0 && mine.getContactPoint(0).m_lifeTime > 1 ? 1 : 0;
            at = poses.tremble(at, step % 3 == 0 ? 0.02 : 1e-3);
        }
    }
    EXPECT_GT(points, 5000);
    EXPECT_GT(older, 1000);
}

TEST(BoxPairs, HaveTheSameBitsWithEveryInstructionSet)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2") == 0)
        GTEST_SKIP() << "no AVX2";
    BoxPoses poses(33);
    int touching = 0;
    for (int k = 0; k < 4000; ++k)
    {
        const BoxPose pose = poses.draw(k % 2 == 0);
        const auto source = [](const btTransform& at, const btVector3& half) {
            return BoxSource{at.getBasis()[0].m_floats, at.getOrigin().m_floats, half.m_floats, 0};
        };
        BoxContact<btScalar> narrow, wide;
        BoxAxisGroup first = BoxAxisGroup::None, second = BoxAxisGroup::None;
        collideBoxesBaseline(source(pose.a, pose.halfA), source(pose.b, pose.halfB), first, narrow);
        collideBoxesAvx2(source(pose.a, pose.halfA), source(pose.b, pose.halfB), second, wide);
        ASSERT_EQ(narrow.count, wide.count);
        ASSERT_EQ(first, second);
        if (narrow.count == 0)
            continue;
        ++touching;
        ASSERT_EQ(std::memcmp(narrow.normal, wide.normal, sizeof(wide.normal)), 0);
        ASSERT_EQ(std::memcmp(narrow.points, wide.points, sizeof(wide.points)), 0);
        ASSERT_EQ(std::memcmp(narrow.distances, wide.distances, sizeof(wide.distances)), 0);
    }
    EXPECT_GT(touching, 2000);
#endif
}

TEST(BoxPairs, RaiseNoFloatingPointFlags)
{
    ConvexBench bench;
    BoxPoses poses(34);
    std::vector<BoxPose> all;
    for (int k = 0; k < 500; ++k)
        all.push_back(poses.draw(k % 2 == 0));
    // Parallel edges, and boxes without volume.
    BoxPose flat = all[0];
    flat.b = flat.a;
    all.push_back(flat);
    flat.b.getOrigin() += flat.a.getBasis().getColumn(0);
    all.push_back(flat);
    flat.halfA = vec(0, 1, 1);
    flat.halfB = vec(0, 0, 1);
    all.push_back(flat);
    const int flags = flagsOf(
        [&]
        {
            for (const BoxPose& pose : all)
            {
                btBoxShape a(pose.halfA), b(pose.halfB);
                ConvexPairProbe probe(bench.dispatcher, a, b);
                probe.place(pose.a, pose.b);
                probe.step();
                probe.step();
            }
        });
    EXPECT_EQ(flags, 0) << nameFlags(flags);
}

TEST(BoxPairs, AreLeftToBulletForDerivedShapesAndQueriesForClosestPoints)
{
    struct Derived : btBoxShape
    {
        using btBoxShape::btBoxShape;
    };
    ConvexBench bench;
    btBoxShape box(vec(1, 1, 1));
    Derived derived(vec(1, 1, 1));
    EXPECT_TRUE(isOurs(*ConvexPairProbe(bench.dispatcher, box, box).algorithm));
    EXPECT_FALSE(isOurs(*ConvexPairProbe(bench.dispatcher, box, derived).algorithm));
    EXPECT_FALSE(isOurs(*ConvexPairProbe(bench.dispatcher, derived, box).algorithm));
    const auto closest = bench.closest(box, btTransform(btQuaternion::getIdentity(), vec(0, 3, 0)), box,
                                       btTransform::getIdentity(), 2);
    ASSERT_TRUE(closest.has_value());
    EXPECT_NEAR(closest->distance, 1, 0.05);
}

TEST(BoxPairs, AddToManifoldOfParentWithoutRefreshingIt)
{
    ConvexBench bench;
    btBoxShape box(vec(1, 1, 1));
    btCollisionObject a, b;
    a.setCollisionShape(&box);
    b.setCollisionShape(&box);
    btPersistentManifold* const shared = bench.dispatcher.getNewManifold(&a, &b);
    {
        ConvexPairProbe probe(bench.dispatcher, box, box, BT_CONTACT_POINT_ALGORITHMS, shared);
        probe.place(vec(0, 1.99, 0), vec(0, 0, 0));
        shared->setBodies(&probe.bodyA, &probe.bodyB);
        EXPECT_EQ(probe.step(), shared);
        EXPECT_EQ(shared->getNumContacts(), 4);
        EXPECT_EQ(shared->getContactPoint(0).m_lifeTime, 0);
        btManifoldArray manifolds;
        probe.algorithm->getAllContactManifolds(manifolds);
        EXPECT_EQ(manifolds.size(), 0);
        probe.place(vec(0, 5, 0), vec(0, 0, 0));
        probe.step();
        EXPECT_EQ(shared->getNumContacts(), 4);
    }
    EXPECT_EQ(bench.dispatcher.getNumManifolds(), 1);
    bench.dispatcher.releaseManifold(shared);
}

TEST(BoxPairs, CountOverlapsAmongTheStatistics)
{
    ConvexBench bench;
    btBoxShape box(vec(1, 1, 1));
    ConvexPairProbe probe(bench.dispatcher, box, box);
    for (const double height : {1.9, 1.99, 5.0})
    {
        probe.place(vec(0, height, 0), vec(0, 0, 0));
        probe.step();
    }
    const IsaGjkStats stats = bench.registration->stats();
    EXPECT_EQ(stats.touchingTotal, 2u);
    EXPECT_EQ(stats.depthsTotal, 2u);
    EXPECT_EQ(stats.separatedTotal, 1u);
}

TEST(BoxPairs, LoseTheirContactsWhenTheyPartOrArePlacedNowhere)
{
    ConvexBench bench;
    btBoxShape box(vec(1, 1, 1));
    ConvexPairProbe probe(bench.dispatcher, box, box);
    probe.place(vec(0, 1.99, 0), vec(0, 0, 0));
    EXPECT_EQ(probe.step()->getNumContacts(), 4);
    // Kept, as by Bullet, up to the breaking threshold.
    probe.place(vec(0, 2.01, 0), vec(0, 0, 0));
    EXPECT_EQ(probe.step()->getNumContacts(), 4);
    probe.place(vec(0, 2.1, 0), vec(0, 0, 0));
    EXPECT_EQ(probe.step()->getNumContacts(), 0);
    probe.place(vec(0, std::numeric_limits<double>::quiet_NaN(), 0), vec(0, 0, 0));
    EXPECT_EQ(probe.step()->getNumContacts(), 0);
    EXPECT_TRUE(probe.query().empty());
    EXPECT_EQ(bench.registration->stats().touchingTotal, 1u);
}
}  // namespace
}  // namespace cullet::test
