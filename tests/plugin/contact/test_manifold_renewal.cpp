// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/convex/convex_contacts.h"

#include <gtest/gtest.h>

#include <cmath>

namespace cullet::test
{
namespace
{
int endedTotal = 0;

/// Counts the calls of gContactEndedCallback for a scope.
struct EndedScope
{
    EndedScope()
    {
        endedTotal = 0;
        gContactEndedCallback = [](btPersistentManifold* const&) { ++endedTotal; };
    }
    ~EndedScope() { gContactEndedCallback = nullptr; }
};

/// A wheel with its axle along z.
std::unique_ptr<btConvexHullShape> makeWheel(int sides)
{
    std::vector<btVector3> points;
    for (int i = 0; i < sides; ++i)
    {
        const double angle = 2.0 * double(SIMD_PI) * i / sides;
        for (const double z : {-0.05, 0.05})
            points.push_back(vec(0.3 * std::cos(angle), 0.3 * std::sin(angle), z));
    }
    return makeHullShape(points);
}
}  // namespace

TEST(ManifoldRenewal, DropsPointsThatRollingWheelHasLeft)
{
    const auto wheel = makeWheel(24);
    btBoxShape floor(vec(20, 1, 20));
    ConvexWorld world(Narrow::IsaGjk);
    btRigidBody& ground = world.add(&floor, 0, vec(0, -1, 0));
    btRigidBody& body = world.add(wheel.get(), 1, vec(0, 0.33, 0));
    ground.setFriction(1);
    body.setFriction(1);
    body.setLinearVelocity(vec(2, 0, 0));
    body.setAngularVelocity(vec(0, 0, -2 / 0.3));
    const EndedScope scope;
    int lines = 0, touching = 0, points = 0, landings = 0, before = 0;
    for (int i = 0; i < 120; ++i)
    {
        world.step();
        const int count = world.contactsOf(ground, body);
        landings += before == 0 && count > 0;
        before = count;
        lines += count == 2;
        touching += count > 0;
        points += count;
    }
    EXPECT_GT(touching, 100);
    EXPECT_GT(lines, touching / 2);
    EXPECT_LT(points, 3 * touching);
    EXPECT_GT(body.getWorldTransform().getOrigin().x(), 3);
    EXPECT_GT(before, 0);
    EXPECT_EQ(endedTotal, landings - 1)
        << "the contact ends where the wheel jumps, not where its points change";
}

TEST(ManifoldRenewal, KeepsImpulsesOfPointsThatAreRenewedAndDropsOthers)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    ConvexBench bench;
    ConvexPairProbe probe(bench.dispatcher, *cube, *cube);
    probe.place(vec(0, 1.08, 0), vec(0, 0, 0));
    btPersistentManifold* manifold = probe.step();
    ASSERT_EQ(manifold->getNumContacts(), 4);
    // One of 1, 2, 4 and 5 at each corner of the face.
    const auto impulseAt = [](const btManifoldPoint& point)
    { return btScalar(1 + (point.m_localPointA.x() > 0 ? 1 : 0) + (point.m_localPointA.z() > 0 ? 3 : 0)); };
    const auto expectOwnImpulses = [&](btScalar sum)
    {
        for (int i = 0; i < manifold->getNumContacts(); ++i)
        {
            const btManifoldPoint& point = manifold->getContactPoint(i);
            EXPECT_EQ(point.m_appliedImpulse, impulseAt(point)) << i;
            sum -= point.m_appliedImpulse;
        }
        EXPECT_EQ(sum, 0) << "a corner is missing, or there twice";
    };
    for (int i = 0; i < 4; ++i)
        manifold->getContactPoint(i).m_appliedImpulse = impulseAt(manifold->getContactPoint(i));
    expectOwnImpulses(1 + 2 + 4 + 5);
    const EndedScope scope;
    probe.place(vec(0.001, 1.08, 0), vec(0, 0, 0));
    manifold = probe.step();
    ASSERT_EQ(manifold->getNumContacts(), 4);
    expectOwnImpulses(1 + 2 + 4 + 5);
    // The cube stands on the edge at its lesser x.
    const double angle = 0.07;
    probe.place(btTransform(btQuaternion(0, 0, btScalar(angle)),
                            vec(0, 0.58 + 0.5 * (std::cos(angle) + std::sin(angle)), 0)),
                btTransform::getIdentity());
    manifold = probe.step();
    EXPECT_EQ(manifold->getNumContacts(), 2);
    expectOwnImpulses(1 + 4);
    EXPECT_EQ(endedTotal, 0);
}

TEST(ManifoldRenewal, DoesNotEndAContactWhoseLastPointJumps)
{
    const auto ball = makeHullShape(ballPoints(40, 0.5, 11));
    btBoxShape floor(vec(20, 1, 20));
    ConvexBench bench;
    ConvexPairProbe probe(bench.dispatcher, *ball, floor);
    const EndedScope scope;
    int jumps = 0;
    btVector3 last(0, 0, 0);
    for (int i = 0; i < 60; ++i)
    {
        const btQuaternion turn(vec(0.3, 0.2, 1).normalized(), btScalar(0.2 * i));
        probe.place(btTransform(turn, vec(0, 0.42, 0)),
                    btTransform(btQuaternion::getIdentity(), vec(0, -1, 0)));
        btPersistentManifold* manifold = probe.step();
        ASSERT_GE(manifold->getNumContacts(), 1) << i;
        EXPECT_LE(manifold->getNumContacts(), 3) << i;
        const btVector3 at = manifold->getContactPoint(0).m_localPointA;
        jumps += at.distance(last) > btScalar(0.1);
        last = at;
    }
    EXPECT_GT(jumps, 20);
    EXPECT_EQ(endedTotal, 0);
}
}  // namespace cullet::test
