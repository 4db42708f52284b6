// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The same bits for any number of threads, in either world, beside other islands, and in a second run.
#include "cullet/plugin/world.h"
#include "cullet/tests/plugin/log_scope.h"
#include "cullet/tests/plugin/solver/solver_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <utility>
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
///
/// @param spacing of the bodies, which are cubes of 1 m
void buildHeap(SolverScene& scene, double spacing)
{
    scene.addFloor().setFriction(btScalar(0.8));
    btBoxShape& cube = scene.box(0.5, 0.5, 0.5);
    btRigidBody& plate = scene.addKinematic(scene.box(4, 0.5, 4), vec(0, 0.5, 0));
    plate.setAnisotropicFriction(vec(1, 1, 0.5));
    for (int i = 0; i < 1400; ++i)
    {
        const double x = spacing * (i % 10), y = 1.499 + spacing * (i / 100), z = spacing * (i / 10 % 10);
        btRigidBody& body = scene.add(cube, 1 + i % 3, vec(x - 5, y, z - 5));
        body.setRollingFriction(btScalar(i % 7 == 0 ? 0.05 : 0));
        const auto& bodies = scene.bodies();
        if (i % 5 == 1)
            scene
                .join<btPoint2PointConstraint>(*bodies[bodies.size() - 2], body, vec(0.5, 0, 0),
                                               vec(0.5 - spacing, 0, 0))
                .setEnabled(i % 10 != 1);
    }
}

/// @param examine called with the scene after the first step
template <class Examine>
void expectBitsOfHeapForAnyNumber(Contender model, double spacing, btScalar residualThreshold, int steps,
                                  const Examine& examine)
{
    std::vector<std::uint64_t> expected;
    for (const int threads : {1, 2, 5, 8})
    {
        SCOPED_TRACE(testing::Message() << nameOf(model) << ' ' << threads);
        SolverScene scene(makeSolver(model, threads), 0, makeParallelWorld<1>);
        scene.info().m_leastSquaresResidualThreshold = residualThreshold;
        buildHeap(scene, spacing);
        std::vector<std::uint64_t> hashes;
        for (int i = 0; i < steps; ++i)
        {
            scene.step();
            hashes.push_back(scene.hash());
            if (i == 0)
                examine(scene);
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

TEST(SolverThreads, KeepBitsOfLargeIslandForAnyNumber)
{
    for (const Contender model : kModels)
        expectBitsOfHeapForAnyNumber(model, 0.998, 0, 6, [](SolverScene&) {});
}

TEST(SolverThreads, KeepBitsOfSplitImpulseForAnyNumber)
{
    for (const btScalar threshold : {btScalar(0), btScalar(1e-6)})
        expectBitsOfHeapForAnyNumber(Contender::Bullet, 0.93, threshold, 2,
                                     [](SolverScene& scene)
                                     {
                                         ASSERT_TRUE(scene.info().m_splitImpulse);
                                         EXPECT_GT(scene.meanDepth(), 0.05);
                                     });
}

/// What the bodies of an island have that a solver might ask its whole group for.
enum class Trait
{
    None,
    OwnJoint,   ///< a joint of the application
    Stiffness,  ///< of contacts
    Anchor,     ///< CF_HAS_FRICTION_ANCHOR
    Bounce,     ///< restitution, rolling and spinning friction
    Iterations  ///< of a joint
};
constexpr Trait kTraits[] = {Trait::None,   Trait::OwnJoint, Trait::Stiffness,
                             Trait::Anchor, Trait::Bounce,   Trait::Iterations};
constexpr const char* kTraitNames[] = {"none", "own joint", "stiffness", "anchor", "bounce", "iterations"};

void give(SolverScene& scene, btRigidBody& body, Trait trait)
{
    switch (trait)
    {
        case Trait::None:
            break;
        case Trait::OwnJoint:
            scene.join<OwnJoint>(body, vec(0.5, 0.5, 0.5));
            break;
        case Trait::Stiffness:
            body.setContactStiffnessAndDamping(2000, 100);
            break;
        case Trait::Anchor:
            body.setCollisionFlags(body.getCollisionFlags() | btCollisionObject::CF_HAS_FRICTION_ANCHOR);
            break;
        case Trait::Bounce:
            body.setRestitution(btScalar(0.5));
            body.setRollingFriction(btScalar(0.1));
            body.setSpinningFriction(btScalar(0.1));
            break;
        case Trait::Iterations:
            scene.join<btPoint2PointConstraint>(body, vec(0.5, 0.5, 0.5)).setOverrideNumSolverIterations(40);
            break;
    }
}

/// What lies in the world of an island that hashesBeside() watches.
struct Neighbourhood
{
    Contender model;
    btScalar residualThreshold = 0;
    Trait own = Trait::None, others = Trait::None;
    int before = 0, after = 0;  ///< other islands that were made before and after it
};

/// Hash of a pile with joints, beside other islands that came before, after or not at all.
template <class MakeWorld>
std::vector<std::uint64_t> hashesBeside(const Neighbourhood& what, int steps, const MakeWorld& makeWorld)
{
    SolverScene scene(makeSolver(what.model, 2), 0, makeWorld);
    scene.info().m_leastSquaresResidualThreshold = what.residualThreshold;
    // The largest residual of a group ends its iterations.
    if (what.residualThreshold > 0)
        scene.info().m_minimumSolverBatchSize = 1;
    // Else the order of an island's contacts depends on all others, and with it what Bullet's solver finds.
    scene.world().getDispatchInfo().m_deterministicOverlappingPairs = what.own == Trait::OwnJoint;
    btRigidBody& floor = scene.addFloor();
    floor.setRestitution(1);
    btBoxShape& cube = scene.box(0.5, 0.5, 0.5);
    const auto addOthers = [&](int count, double z)
    {
        for (int i = 0; i < count; ++i)
        {
            btRigidBody& lower = scene.add(cube, 1, vec(3 * i - 15, 0.5, z));
            btRigidBody& upper = scene.add(cube, 1, vec(3 * i - 15 + 0.2, 1.55, z));
            if (i % 2 == 0)
                scene.join<btPoint2PointConstraint>(lower, upper, vec(0, 0.5, 0), vec(-0.2, -0.55, 0));
            if (i % 3 == 0)
                give(scene, lower, what.others);
        }
    };
    addOthers(what.before, 20);
    std::vector<btRigidBody*> own;
    for (int i = 0; i < 30; ++i)
        own.push_back(&scene.add(cube, 1, vec(1.02 * (i % 3), 0.55 + 1.03 * (i / 9), 1.02 * (i / 3 % 3))));
    give(scene, *own.front(), what.own);
    std::vector<btTypedConstraint*> joints;
    // With what they lie on: Bullet's broad phase keeps pairs of boxes that have parted for a time that depends on all pairs.
    for (std::size_t i = 27; i < 30; ++i)
        joints.push_back(
            &scene.join<btPoint2PointConstraint>(*own[i - 9], *own[i], vec(0, 0.515, 0), vec(0, -0.515, 0)));
    addOthers(what.after, -20);
    EXPECT_TRUE(floor.isStaticObject());
    std::vector<std::uint64_t> hashes;
    for (int step = 0; step < steps; ++step)
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
    constexpr int kSteps = 100;
    for (const Contender model : kModels)
    {
        SCOPED_TRACE(nameOf(model));
        Neighbourhood what{model};
        const auto alone = hashesBeside(what, kSteps, makeDiscreteWorld);
        EXPECT_EQ(hashesBeside(what, kSteps, makeParallelWorld<3>), alone);
        for (const auto& [before, after] : {std::pair(1, 0), std::pair(0, 1), std::pair(10, 10)})
        {
            what.before = before;
            what.after = after;
            EXPECT_EQ(hashesBeside(what, kSteps, makeDiscreteWorld), alone);
        }
        EXPECT_EQ(hashesBeside(what, kSteps, makeParallelWorld<3>), alone);
    }
}

TEST(SolverThreads, SolveIslandAsIfItWereAloneBesideOnesOfOtherKinds)
{
    constexpr int kSteps = 40;
    const LogScope quiet;
    for (const Contender model : kModels)
    {
        for (const btScalar threshold : {btScalar(0), btScalar(1e-4)})
        {
            std::vector<std::vector<std::uint64_t>> kinds;
            for (const Trait own : kTraits)
            {
                Neighbourhood what{model, threshold, own};
                const auto alone = hashesBeside(what, kSteps, makeDiscreteWorld);
                kinds.push_back(alone);
                what.before = what.after = 4;
                for (const Trait others : kTraits)
                {
                    what.others = others;
                    SCOPED_TRACE(testing::Message()
                                 << nameOf(model) << ", threshold " << threshold << ", "
                                 << kTraitNames[int(own)] << " beside " << kTraitNames[int(others)]);
                    EXPECT_EQ(hashesBeside(what, kSteps, makeDiscreteWorld), alone);
                    EXPECT_EQ(hashesBeside(what, kSteps, makeParallelWorld<3>), alone);
                }
            }
            // Each kind is solved in another way.
            std::sort(kinds.begin(), kinds.end());
            EXPECT_EQ(std::unique(kinds.begin(), kinds.end()), kinds.end());
        }
    }
}
}  // namespace
}  // namespace cullet::test
