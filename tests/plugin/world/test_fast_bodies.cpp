// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/world/fast_bodies.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace cullet::test
{
namespace
{
constexpr int kShots = 80;
constexpr btScalar kSpeculation = btScalar(0.25);

struct Flight
{
    std::vector<bool> passed;
    std::uint64_t hash;
    int deflected = 0;
};

enum class Aim
{
    Hit,
    NearMiss
};

/// @param shapes of projectiles, see FastBodies::fire()
Flight fly(Own own, Continuous continuous, double speed, Aim aim = Aim::Hit, int shapes = 4)
{
    FastBodies scene(own, continuous == Continuous::Speculation ? kSpeculation : btScalar(0));
    std::mt19937 engine(21);
    std::uniform_real_distribution<double> any(-1.0, 1.0), clear(0.2, 0.5);
    std::vector<double> speeds;
    for (int i = 0; i < kShots; ++i)
    {
        double y = any(engine);
        const double z = any(engine);
        if (aim == Aim::NearMiss)
            y = (y > 0 ? 1 : -1) * (FastBodies::kHalfTarget + clear(engine));
        speeds.push_back(speed * (0.95 + 0.05 * any(engine)));
        scene.fire(kTargets[i % 4], i / 4 % shapes, speeds.back(), {y, z}, continuous,
                   randomRotation(engine));
    }
    scene.fly(0.9 * speed);
    Flight flight{scene.passed(), hashOfBodies(scene.bodies), 0};
    for (std::size_t i = 0; i < speeds.size(); ++i)
        flight.deflected += scene.isDeflected(i, speeds[i]) ? 1 : 0;
    return flight;
}

int countOf(const std::vector<bool>& flags)
{
    return int(std::count(flags.begin(), flags.end(), true));
}

/// Metres per second: steps of half a side of the bodies to 50 of them.
constexpr double kSpeeds[] = {6, 30, 120, 600};
}  // namespace

// Seed 21. Bits follow the order of manifolds, and so the pairs' history, which is not that of DBVT.
TEST(FastBodies, AreStoppedByBulletsSweepsAsInStockBullet)
{
    int tunnelled = 0, swept = 0;
    for (const double speed : kSpeeds)
    {
        SCOPED_TRACE("speed " + std::to_string(speed));
        tunnelled += countOf(fly(Own::Nothing, Continuous::Nothing, speed).passed);
        const Flight stock = fly(Own::Nothing, Continuous::BulletsSweeps, speed);
        swept += countOf(stock.passed);
        std::uint64_t withBroadphase = 0;
        for (const Own own : {Own::Broadphase, Own::BroadphaseAndWorld, Own::Dispatcher, Own::All})
        {
            SCOPED_TRACE(testing::PrintToString(own));
            const Flight flight = fly(own, Continuous::BulletsSweeps, speed);
            EXPECT_EQ(flight.passed, stock.passed);
            if (own == Own::Broadphase)
                withBroadphase = flight.hash;
            if (own == Own::BroadphaseAndWorld)
            {
                EXPECT_EQ(flight.hash, withBroadphase);
            }
        }
    }
    EXPECT_GT(tunnelled, kShots * 2) << "hardly any body tunnels without sweeps: nothing is shown";
    EXPECT_LT(swept, tunnelled / 20);
}

TEST(FastBodies, PassNoThinTargetWithSpeculation)
{
    int tunnelled = 0, sweptCompounds = 0, withBulletsDetector = 0;
    for (const double speed : kSpeeds)
    {
        SCOPED_TRACE("speed " + std::to_string(speed));
        tunnelled += countOf(fly(Own::All, Continuous::Nothing, speed, Aim::Hit, 5).passed);
        sweptCompounds += countOf(fly(Own::All, Continuous::BulletsSweeps, speed, Aim::Hit, 5).passed);
        EXPECT_EQ(countOf(fly(Own::All, Continuous::Speculation, speed, Aim::Hit, 5).passed), 0);
        withBulletsDetector +=
            countOf(fly(Own::BroadphaseAndWorld, Continuous::Speculation, speed, Aim::Hit, 5).passed);
    }
    EXPECT_GT(tunnelled, kShots * 2);
    EXPECT_GT(sweptCompounds, kShots / 4) << "Bullet sweeps compounds after all";
    EXPECT_EQ(withBulletsDetector, 0);
}

// A ghost collision: the plane of the closest points at the start of a step would stop some of these bodies.
TEST(FastBodies, FlyPastTargetsUndeflectedWithSpeculation)
{
    for (const double speed : kSpeeds)
    {
        const Flight flight = fly(Own::All, Continuous::Speculation, speed, Aim::NearMiss, 5);
        EXPECT_EQ(flight.deflected, 0);
        EXPECT_EQ(countOf(flight.passed), kShots);
        EXPECT_EQ(flight.hash, fly(Own::All, Continuous::Nothing, speed, Aim::NearMiss, 5).hash);
    }
}

TEST(FastBodies, AreCountedWithSpeculation)
{
    FastBodies scene(Own::All, kSpeculation);
    scene.fire(Target::Wall, 1, 100, {0, 0}, Continuous::Speculation, btQuaternion::getIdentity());
    scene.fire(Target::Mesh, 1, 1, {0, 0}, Continuous::Speculation, btQuaternion::getIdentity());
    SpeculationStats most;
    for (int i = 0; i < 6; ++i)
    {
        scene.world->stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
        const SpeculationStats& stats = scene.ownWorld->speculationStats();
        EXPECT_LE(stats.bodies, 1u);
        most.bodies = std::max(most.bodies, stats.bodies);
        most.pairs = std::max(most.pairs, stats.pairs);
        most.queries = std::max(most.queries, stats.queries);
        most.contacts = std::max(most.contacts, stats.contacts);
    }
    EXPECT_EQ(most.bodies, 1u);
    EXPECT_EQ(most.pairs, 1u);
    EXPECT_GE(most.queries, 1u);
    EXPECT_EQ(most.contacts, 1u);
    EXPECT_FALSE(scene.hasPassed(0));
}

// A wall that gives way.
TEST(FastBodies, PushLightPlateInsteadOfPassingItWithSpeculation)
{
    for (const bool isOn : {false, true})
    {
        FastBodies scene(Own::All, isOn ? kSpeculation : btScalar(0));
        btBoxShape plateShape(vec(0.02, 1, 1));
        scene.bodies.push_back(
            makeBodyAt(btTransform(btQuaternion::getIdentity(), vec(3, 0, 0)), &plateShape, 0.5));
        btRigidBody& plate = *scene.bodies.back();
        scene.world->addRigidBody(&plate);
        scene.fire(Target::Wall, 0, 90, {0, 2}, Continuous::Nothing, btQuaternion::getIdentity());
        btRigidBody& ball = *scene.bodies.back();
        ball.setWorldTransform(btTransform(btQuaternion::getIdentity(), vec(-5, 0, 0)));
        ball.setInterpolationWorldTransform(ball.getWorldTransform());
        for (int i = 0; i < 12; ++i)
            scene.world->stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
        EXPECT_EQ(plate.getLinearVelocity().x() > 1, isOn);
        EXPECT_EQ(ball.getWorldTransform().getOrigin().x() < plate.getWorldTransform().getOrigin().x(), isOn);
        while (scene.bodies.size() > 1)
        {
            scene.world->removeRigidBody(scene.bodies.back().get());
            scene.bodies.pop_back();
        }
        scene.world->removeRigidBody(scene.bodies.back().get());
        scene.bodies.clear();
    }
}

TEST(FastBodies, KeepTheirBitsWithSpeculationWhileAllAreSlow)
{
    const double slow = 2;  // a sixth of the thinnest side in a step
    EXPECT_EQ(fly(Own::All, Continuous::Speculation, slow).hash,
              fly(Own::All, Continuous::Nothing, slow).hash);
}
}  // namespace cullet::test
