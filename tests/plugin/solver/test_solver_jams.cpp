// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// How much energy joints give to their bodies: those that something keeps open, and those of two bodies alone.
#include "cullet/tests/plugin/solver/solver_scene.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <string>
#include <utility>

namespace cullet::test
{
namespace
{
constexpr std::uint32_t kSeed = 20261128;

btRigidBody& addBox(SolverScene& scene, const btVector3& half, Random& random, const btVector3& place)
{
    btCollisionShape& box = scene.box(double(half.x()), double(half.y()), double(half.z()));
    btRigidBody& body =
        scene.add(box, double(random.between(0.5f, 4)), btTransform(randomTurn(random), place));
    body.setActivationState(DISABLE_DEACTIVATION);
    body.setFriction(btScalar(0.5));
    body.setRollingFriction(btScalar(0.02));
    body.setSpinningFriction(btScalar(0.02));
    return body;
}

/// What starts of a kind have in common.
struct Motion
{
    double mean = 0;   ///< kinetic energy, J
    double last = 0;   ///< that of the last step
    double depth = 0;  ///< of the deepest point of the first step, m
};

/// Two joined bodies on both sides of a box, which their joint draws into each of them: in no place are all three content.
Motion jam(Contender contender, JointKind kind, Random& random)
{
    constexpr int kSteps = 300;
    SolverScene scene(contender);
    scene.addFloor();
    btRigidBody& above = addBox(scene, vec(random.point(0.2f, 0.4f)), random, vec(0, 2, 0));
    btRigidBody& below = addBox(scene, vec(random.point(0.2f, 0.4f)), random, vec(0, 1, 0));
    scene.joinOfKind(kind, above, below);
    const btVector3 aside = vec(random.point(-0.1f, 0.1f));
    addBox(scene, vec(random.point(0.4f, 0.5f)), random, vec(aside.x(), 1.5, aside.z()));
    Motion motion;
    for (int i = 0; i < kSteps; ++i)
    {
        scene.step();
        if (i == 0)
            motion.depth = scene.maxDepth();
        motion.last = scene.kineticEnergy();
        motion.mean += motion.last / kSteps;
    }
    return motion;
}

Motion meanJam(Contender contender)
{
    constexpr int kStarts = 30;
    const double all = kStarts * double(std::size(kJointKinds));
    Motion mean;
    for (const JointKind kind : kJointKinds)
    {
        Random random(kSeed);
        for (int i = 0; i < kStarts; ++i)
        {
            const Motion one = jam(contender, kind, random);
            mean.mean += one.mean / all;
            mean.last += one.last / all;
            mean.depth += one.depth / all;
        }
    }
    return mean;
}

TEST(SolverJams, GiveJoinedBodiesNotMuchMoreEnergyThanStock)
{
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    const Motion stock = meanJam(Contender::Stock);
    EXPECT_GT(stock.depth, 0.1) << "bodies are not pressed into each other";
    EXPECT_GT(stock.mean, 5) << "stock's bodies hardly move";
    for (const Contender contender : {Contender::Bullet, Contender::Soft})
    {
        const Motion motion = meanJam(contender);
        EXPECT_LT(motion.mean, 1.3 * stock.mean) << nameOf(contender);
        EXPECT_LT(motion.last, stock.last + 1) << nameOf(contender);
    }
}

/// What a deep contact keeps of its impulse must carry a load, too.
TEST(SolverJams, PressNoLightBodyThroughTheFloorByAThousandTimesItsMass)
{
    for (const Contender contender : {Contender::Stock, Contender::Bullet, Contender::Soft})
    {
        SolverScene scene(contender);
        scene.addFloor();
        btBoxShape& cube = scene.box(0.5, 0.5, 0.5);
        btRigidBody& light = scene.add(cube, 1, vec(0, 0.5, 0));
        scene.add(cube, 1000, vec(0, 1.5, 0));
        scene.step(600);
        EXPECT_GT(heightOfBody(light), 0.4) << nameOf(contender);
    }
}

enum class JointStart
{
    Closed,
    Open  ///< the frames are turned by up to half a turn and moved by up to a third of a metre along each axis
};

/// Two joined bodies that float and turn.
///
/// @return the most of their energy in a second, and what it was first: after the first step, which takes away what a closed
/// joint forbids and turns bodies whose angular velocity stays; else before it; J
std::pair<double, double> energiesOfPair(Contender contender, JointKind kind, JointStart start,
                                         Random& random)
{
    SolverScene scene(contender);
    scene.world().setGravity(vec(0, 0, 0));
    btRigidBody& a = addBox(scene, vec(random.point(0.1f, 0.5f)), random, vec(0, 1, 0));
    btRigidBody& b = addBox(scene, vec(random.point(0.1f, 0.5f)), random, vec(0, 0, 0));
    scene.joinOfKind(kind, a, b);
    for (btRigidBody* const body : {&a, &b})
    {
        body->setLinearVelocity(vec(random.point(-1, 1)));
        body->setAngularVelocity(vec(random.point(-5, 5)));
    }
    if (start == JointStart::Open)
    {
        const btVector3 axis = vec(random.point(-1, 1)), way = vec(random.point(-1, 1)) / 3;
        const btQuaternion turn(axis.normalized(), btScalar(random.unit()) * SIMD_PI);
        const btTransform place = b.getWorldTransform();
        b.setWorldTransform(btTransform(turn * place.getRotation(), place.getOrigin() + way));
    }
    else
        scene.step();
    const double first = scene.kineticEnergy();
    double most = first;
    for (int i = 0; i < 60; ++i)
    {
        scene.step();
        most = std::max(most, scene.kineticEnergy());
    }
    return {most, first};
}

TEST(SolverJams, GiveTwoBodiesOfAClosedJointNoEnergy)
{
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    for (const Contender contender : {Contender::Stock, Contender::Bullet, Contender::Soft})
    {
        for (const JointKind kind : kJointKinds)
        {
            Random random(kSeed);
            for (int i = 0; i < 100; ++i)
            {
                const auto [most, first] = energiesOfPair(contender, kind, JointStart::Closed, random);
                EXPECT_GT(first, 0.01) << "nothing moves";
                EXPECT_LT(most, 1.01 * first) << nameOf(contender) << ", " << nameOf(kind) << ", start " << i;
            }
        }
    }
}

/// What the joints of random starts give to their bodies on average, J.
double gainOfOpenJoints(Contender contender, JointKind kind)
{
    constexpr int kStarts = 100;
    Random random(kSeed);
    double gain = 0;
    for (int i = 0; i < kStarts; ++i)
    {
        const auto [most, first] = energiesOfPair(contender, kind, JointStart::Open, random);
        gain += (most - first) / kStarts;
    }
    return gain;
}

TEST(SolverJams, GiveTwoBodiesOfAnOpenJointNotMuchMoreEnergyThanStock)
{
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    for (const JointKind kind : kJointKinds)
    {
        SCOPED_TRACE(nameOf(kind));
        const double stock = gainOfOpenJoints(Contender::Stock, kind);
        EXPECT_GT(stock, 1) << "joints are hardly open";
        for (const Contender contender : {Contender::Bullet, Contender::Soft})
            EXPECT_LT(gainOfOpenJoints(contender, kind), 1.3 * stock) << nameOf(contender);
    }
}
}  // namespace
}  // namespace cullet::test
