// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The same bits for any number of threads, in either world, beside other islands, and in a second run.
#include "cullet/plugin/world.h"
#include "cullet/tests/plugin/solver/solver_scene.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr auto kModels = {Contender::Bullet, Contender::Soft};

template <int Threads>
std::unique_ptr<btDiscreteDynamicsWorld> makeParallelWorld(btDispatcher* dispatcher,
                                                           btBroadphaseInterface* broadphase,
                                                           btConstraintSolver* solver,
                                                           btCollisionConfiguration* configuration)
{
    auto world =
        std::make_unique<World<btDiscreteDynamicsWorld>>(dispatcher, broadphase, solver, configuration);
    world->setUpdateThreads(Threads);
    return world;
}

/// One large island, many small ones, and joints of most kinds.
void build(SolverScene& scene)
{
    scene.addFloor().setFriction(btScalar(0.8));
    btBoxShape& cube = scene.box(0.5, 0.5, 0.5);
    for (int row = 0; row < 14; ++row)
    {
        for (int i = 0; i < 14 - row; ++i)
            scene.add(cube, 1 + i % 3, vec(1.05 * (i - 0.5 * (13 - row)), 0.5 + 1.01 * row, 0));
    }
    for (int i = 0; i < 60; ++i)
    {
        const btVector3 place = vec(3.0 * (i % 10) - 15, 0.6, 5.0 + 3.0 * (i / 10));
        btRigidBody& a = scene.add(cube, 1, place);
        btRigidBody& b = scene.add(cube, 2, place + vec(0.1, 1.1, 0));
        a.setRestitution(btScalar(0.3));
        b.setRollingFriction(btScalar(0.1 * (i % 2)));
        const btTransform above = at(0, 0.55, 0), below = at(0, -0.55, 0);
        switch (i % 6)
        {
            case 0:
                scene.join<btPoint2PointConstraint>(a, b, above.getOrigin(), below.getOrigin());
                break;
            case 1:
                scene.join<btHingeConstraint>(a, b, above, below).setLimit(-1, 1);
                break;
            case 2:
                scene.join<btConeTwistConstraint>(a, b, above, below).setLimit(1, 1, 1);
                break;
            case 3:
                scene.join<btSliderConstraint>(a, b, above, below, true).setUpperLinLimit(1);
                break;
            case 4:
                scene.join<btGeneric6DofSpring2Constraint>(a, b, above, below).enableSpring(1, true);
                break;
            default:
                break;
        }
    }
}

/// Hashes after every tenth step.
template <class MakeWorld>
std::vector<std::uint64_t> hashesOf(Contender model, int threads, const MakeWorld& makeWorld)
{
    SolverScene scene(makeSolver(model, threads), 0, makeWorld);
    scene.info().m_minimumSolverBatchSize = 4;
    build(scene);
    std::vector<std::uint64_t> hashes;
    for (int i = 0; i < 12; ++i)
    {
        scene.step(10);
        hashes.push_back(scene.hash());
    }
    return hashes;
}

TEST(SolverThreads, RepeatBitsInSecondRun)
{
    for (const Contender model : kModels)
        EXPECT_EQ(hashesOf(model, 2, makeDiscreteWorld), hashesOf(model, 2, makeDiscreteWorld))
            << nameOf(model);
}

TEST(SolverThreads, KeepBitsForAnyNumberInDiscreteWorld)
{
    for (const Contender model : kModels)
    {
        const auto expected = hashesOf(model, 1, makeDiscreteWorld);
        EXPECT_NE(expected.front(), expected.back());
        for (const int threads : {2, 3, 8})
            EXPECT_EQ(hashesOf(model, threads, makeDiscreteWorld), expected)
                << nameOf(model) << ' ' << threads;
    }
}

TEST(SolverThreads, KeepBitsForAnyNumberInWorld)
{
    for (const Contender model : kModels)
    {
        const auto expected = hashesOf(model, 1, makeDiscreteWorld);
        EXPECT_EQ(hashesOf(model, 1, makeParallelWorld<1>), expected) << nameOf(model);
        EXPECT_EQ(hashesOf(model, 2, makeParallelWorld<2>), expected) << nameOf(model);
        EXPECT_EQ(hashesOf(model, 3, makeParallelWorld<3>), expected) << nameOf(model);
        EXPECT_EQ(hashesOf(model, 8, makeParallelWorld<8>), expected) << nameOf(model);
        EXPECT_EQ(hashesOf(model, 1, makeParallelWorld<8>), expected) << nameOf(model);
    }
}

/// One island of which each part of the work is divided: bodies of three masses, some joined, some with friction of rolling,
/// some on a kinematic body, and a disabled joint.
void buildHeap(SolverScene& scene)
{
    scene.addFloor().setFriction(btScalar(0.8));
    btBoxShape& cube = scene.box(0.5, 0.5, 0.5);
    btRigidBody& plate = scene.addKinematic(scene.box(4, 0.5, 4), vec(0, 0.5, 0));
    plate.setAnisotropicFriction(vec(1, 1, 0.5));
    for (int i = 0; i < 1400; ++i)
    {
        const double x = 0.998 * (i % 10), y = 1.499 + 0.998 * (i / 100), z = 0.998 * (i / 10 % 10);
        btRigidBody& body = scene.add(cube, 1 + i % 3, vec(x - 5, y, z - 5));
        body.setRollingFriction(btScalar(i % 7 == 0 ? 0.05 : 0));
        const auto& bodies = scene.bodies();
        if (i % 5 == 1)
            scene
                .join<btPoint2PointConstraint>(*bodies[bodies.size() - 2], body, vec(0.5, 0, 0),
                                               vec(-0.498, 0, 0))
                .setEnabled(i % 10 != 1);
    }
}

TEST(SolverThreads, KeepBitsOfLargeIslandForAnyNumber)
{
    for (const Contender model : kModels)
    {
        std::vector<std::uint64_t> expected;
        for (const int threads : {1, 2, 5, 8})
        {
            SCOPED_TRACE(testing::Message() << nameOf(model) << ' ' << threads);
            SolverScene scene(makeSolver(model, threads), 0, makeParallelWorld<1>);
            buildHeap(scene);
            std::vector<std::uint64_t> hashes;
            for (int i = 0; i < 6; ++i)
            {
                scene.step();
                hashes.push_back(scene.hash());
            }
            const SolverStats& stats = static_cast<Solver&>(scene.solver()).stats();
            EXPECT_GT(stats.contacts, 3000u);
            EXPECT_GT(stats.joints, 100u);
            EXPECT_EQ(stats.refusedGroups, 0u);
            if (threads == 1)
                expected = hashes;
            EXPECT_EQ(hashes, expected);
        }
    }
}

/// Hash of a pile and a chain, beside other islands that came before, after or not at all.
template <class MakeWorld>
std::vector<std::uint64_t> hashesBeside(Contender model, int before, int after, const MakeWorld& makeWorld)
{
    SolverScene scene(makeSolver(model, 2), 0, makeWorld);
    btRigidBody& floor = scene.addFloor();
    btBoxShape& cube = scene.box(0.5, 0.5, 0.5);
    const auto addOthers = [&](int count, double z)
    {
        for (int i = 0; i < count; ++i)
        {
            btRigidBody& lower = scene.add(cube, 1, vec(3 * i - 15, 0.5, z));
            btRigidBody& upper = scene.add(cube, 1, vec(3 * i - 15 + 0.2, 1.55, z));
            if (i % 2 == 0)
                scene.join<btPoint2PointConstraint>(lower, upper, vec(0, 0.5, 0), vec(-0.2, -0.55, 0));
        }
    };
    addOthers(before, 20);
    std::vector<const btRigidBody*> own;
    for (int i = 0; i < 30; ++i)
        own.push_back(&scene.add(cube, 1, vec(1.02 * (i % 3), 0.55 + 1.03 * (i / 9), 1.02 * (i / 3 % 3))));
    std::vector<btTypedConstraint*> joints;
    for (int i = 0; i < 3; ++i)
        joints.push_back(&scene.join<btPoint2PointConstraint>(
            *scene.bodies()[scene.bodies().size() - 1 - std::size_t(i)], vec(0, 0.5, 0)));
    addOthers(after, -20);
    EXPECT_TRUE(floor.isStaticObject());
    std::vector<std::uint64_t> hashes;
    for (int step = 0; step < 100; ++step)
    {
        scene.step();
        std::uint64_t hash = 1;
        for (const btRigidBody* body : own)
            hash = hash * 1099511628211ull + hashOf(*body);
        for (btTypedConstraint* joint : joints)
            hash = hash * 1099511628211ull + hashOf(joint->internalGetAppliedImpulse());
        hashes.push_back(hash);
    }
    return hashes;
}

TEST(SolverThreads, SolveIslandAsIfItWereAlone)
{
    for (const Contender model : kModels)
    {
        SCOPED_TRACE(nameOf(model));
        const auto alone = hashesBeside(model, 0, 0, makeDiscreteWorld);
        EXPECT_EQ(hashesBeside(model, 1, 0, makeDiscreteWorld), alone);
        EXPECT_EQ(hashesBeside(model, 0, 1, makeDiscreteWorld), alone);
        EXPECT_EQ(hashesBeside(model, 10, 10, makeDiscreteWorld), alone);
        EXPECT_EQ(hashesBeside(model, 0, 0, makeParallelWorld<3>), alone);
        EXPECT_EQ(hashesBeside(model, 10, 10, makeParallelWorld<3>), alone);
    }
}
}  // namespace
}  // namespace cullet::test
