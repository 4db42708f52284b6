// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// What applications hear of a step: impulses of blows and jerks, contact callbacks, fast bodies that thin walls stop.
#include "cullet/tests/plugin/solver/solver_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace cullet::test
{
namespace
{
/// The impulse of a ball's blow on the floor as an application adds it up after each step, and the largest of a step.
Measures blow(SolverScene& scene, double mass, double fall)
{
    const btRigidBody& floor = scene.addFloor();
    btRigidBody& ball = scene.add(scene.shape<btSphereShape>(btScalar(0.5)), mass, vec(0, 0.5 + fall, 0));
    ball.setActivationState(DISABLE_DEACTIVATION);
    double sum = 0, most = 0, speed = 0;
    int steps = 0;
    while (steps < 10)
    {
        const double before = -double(ball.getLinearVelocity().y());
        scene.step();
        const double impulse = scene.normalImpulse(floor);
        if (impulse > 0 && steps == 0)
            speed = before;
        steps += impulse > 0 || steps > 0;
        sum += impulse;
        most = std::max(most, impulse);
    }
    const double expected = mass * (speed + steps * kGravity * scene.dt());
    return {equal("sum over formula", sum / expected, 0.02),
            notMore("error of sum", std::abs(sum / expected - 1), 0.02),
            equal("loudest step", most / expected, 0.1)};
}

TEST(SolverEvents, ReportBlowsAsStock)
{
    for (const double mass : {0.1, 1.0, 50.0})
    {
        for (const double fall : {0.5, 3.0})
            expectAsStock([=](SolverScene& scene) { return blow(scene, mass, fall); });
    }
}

/// A load falls until a rope of one ball joint is taut: the largest impulse that the joint reports, over the blow's.
Measures jerk(SolverScene& scene)
{
    btRigidBody& anchor = scene.add(scene.box(0.1, 0.1, 0.1), 0, vec(0, 5, 0));
    btRigidBody& load = scene.add(scene.shape<btSphereShape>(btScalar(0.2)), 3, vec(0, 4, 0));
    load.setActivationState(DISABLE_DEACTIVATION);
    auto& joint = scene.join<btPoint2PointConstraint>(anchor, load, vec(0, 0, 0), vec(0, 1, 0));
    joint.setEnabled(false);
    scene.step(12);
    const double speed = -double(load.getLinearVelocity().y());
    joint.setEnabled(true);
    scene.step();
    const double first = std::abs(double(joint.getAppliedImpulse()));
    return {equal("impulse of jerk", first, 0.1 * 3 * speed)};
}

TEST(SolverEvents, ReportJerksOfJointsAsStock)
{
    expectAsStock(jerk);
}

/// Whether a joint breaks that gets a load with this speed; 1 if so.
double breaksAt(SolverScene& scene, double speed, double threshold)
{
    btRigidBody& anchor = scene.add(scene.box(0.1, 0.1, 0.1), 0, vec(0, 5, 0));
    btRigidBody& load = scene.add(scene.shape<btSphereShape>(btScalar(0.2)), 3, vec(0, 4, 0));
    load.setActivationState(DISABLE_DEACTIVATION);
    load.setLinearVelocity(vec(0, -speed, 0));
    auto& joint = scene.join<btPoint2PointConstraint>(anchor, load, vec(0, 0, 0), vec(0, 1, 0));
    joint.setBreakingImpulseThreshold(btScalar(threshold));
    scene.step(3);
    return joint.isEnabled() ? 0 : 1;
}

TEST(SolverEvents, BreakJointsByJerksAsStock)
{
    const double impulse = 3 * (2 + kGravity / 60);
    for (const double share : {0.5, 0.95, 1.05, 2.0})
    {
        const double threshold = impulse * share;
        expectAsStock([=](SolverScene& scene)
                      { return Measures{equal("breaks", breaksAt(scene, 2, threshold), 0)}; });
        SolverScene scene(Contender::Soft);
        EXPECT_EQ(breaksAt(scene, 2, threshold), share < 1 ? 1 : 0) << share;
    }
}

TEST(SolverEvents, ReportIterationsOfTheJointsThatAreThere)
{
    SolverScene scene(Contender::Bullet);
    btSphereShape& ball = scene.shape<btSphereShape>(btScalar(0.25));
    btRigidBody& anchor = scene.add(ball, 0, vec(0, 5, 0));
    btRigidBody& load = scene.add(ball, 1, vec(0, 4, 0));
    auto& joint = scene.join<btPoint2PointConstraint>(anchor, load, vec(0, -0.5, 0), vec(0, 0.5, 0));
    joint.setOverrideNumSolverIterations(40);
    scene.step();
    EXPECT_EQ(scene.solver().m_analyticsData.m_numIterationsUsed, 40);
    joint.setOverrideNumSolverIterations(-1);
    scene.step();
    EXPECT_EQ(scene.solver().m_analyticsData.m_numIterationsUsed, scene.info().m_numIterations);
}

/// Of all points of a box that slides, one after the other.
std::vector<btVector3> frictionDirections(Contender contender, int mode)
{
    SolverScene scene(contender);
    scene.info().m_solverMode |= mode;
    scene.addFloor();
    scene.add(scene.box(1, 0.25, 1), 1, vec(0, 0.25, 0)).setLinearVelocity(vec(3, 0, 1));
    scene.step(2);
    std::vector<btVector3> directions;
    btDispatcher& dispatcher = *scene.world().getDispatcher();
    for (int i = 0; i < dispatcher.getNumManifolds(); ++i)
    {
        const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
        for (int k = 0; k < manifold.getNumContacts(); ++k)
        {
            directions.push_back(manifold.getContactPoint(k).m_lateralFrictionDir1);
            directions.push_back(manifold.getContactPoint(k).m_lateralFrictionDir2);
        }
    }
    return directions;
}

TEST(SolverEvents, LeaveBothFrictionDirectionsInPointsAsStock)
{
    for (const int mode : {0, SOLVER_DISABLE_VELOCITY_DEPENDENT_FRICTION_DIRECTION | 0})
    {
        SCOPED_TRACE(mode);
        const int cached = SOLVER_USE_2_FRICTION_DIRECTIONS | SOLVER_ENABLE_FRICTION_DIRECTION_CACHING | mode;
        const std::vector<btVector3> expected = frictionDirections(Contender::Stock, cached);
        const std::vector<btVector3> own = frictionDirections(Contender::Bullet, cached);
        ASSERT_GE(expected.size(), 4u);
        ASSERT_EQ(own.size(), expected.size());
        for (std::size_t i = 0; i < own.size(); ++i)
            EXPECT_LT((own[i] - expected[i]).length(), btScalar(0.01)) << i;
    }
}

/// Calls of Bullet's callbacks for contacts.
struct CallbackCounts
{
    int added = 0, processed = 0, destroyed = 0, started = 0, ended = 0;
};
CallbackCounts counts;

/// Sets all callbacks while it lives.
class CountingCallbacks
{
public:
    CountingCallbacks()
    {
        counts = {};
        gContactAddedCallback = [](btManifoldPoint& point, const btCollisionObjectWrapper*, int, int,
                                   const btCollisionObjectWrapper*, int, int)
        {
            ++counts.added;
            // Bullet tells only of the end of points that the application has marked.
            point.m_userPersistentData = &counts;
            return true;
        };
        gContactProcessedCallback = [](btManifoldPoint&, void*, void*)
        {
            ++counts.processed;
            return true;
        };
        gContactDestroyedCallback = [](void*)
        {
            ++counts.destroyed;
            return true;
        };
        gContactStartedCallback = [](btPersistentManifold* const&) { ++counts.started; };
        gContactEndedCallback = [](btPersistentManifold* const&) { ++counts.ended; };
    }
    ~CountingCallbacks()
    {
        gContactAddedCallback = nullptr;
        gContactProcessedCallback = nullptr;
        gContactDestroyedCallback = nullptr;
        gContactStartedCallback = nullptr;
        gContactEndedCallback = nullptr;
    }
    CountingCallbacks(const CountingCallbacks&) = delete;
    CountingCallbacks& operator=(const CountingCallbacks&) = delete;
};

/// A ball falls, rests, is thrown up by the application twice, and rests again.
Measures callbacks(SolverScene& scene)
{
    const CountingCallbacks counting;
    btRigidBody& floor = scene.addFloor();
    btRigidBody& ball = scene.add(scene.shape<btSphereShape>(btScalar(0.5)), 1, vec(0, 1, 0));
    ball.setActivationState(DISABLE_DEACTIVATION);
    for (btRigidBody* body : {&floor, &ball})
        body->setCollisionFlags(body->getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
    scene.step(60);
    for (int i = 0; i < 2; ++i)
    {
        ball.setLinearVelocity(vec(0, 3, 0));
        scene.step(90);
    }
    EXPECT_EQ(counts.started, 3) << "of " << counts.added << " points";
    EXPECT_EQ(counts.ended, 2);
    return {equal("added", counts.added, 0), equal("started", counts.started, 0),
            equal("ended", counts.ended, 0), equal("destroyed", counts.destroyed, 0),
            equal("processed", counts.processed, 3)};
}

TEST(SolverEvents, CallContactCallbacksAsStock)
{
    expectAsStock(callbacks);
}

/// Fast balls fly at a thin wall that stands, and at a thin board that hangs from hinges.
Measures fastBalls(SolverScene& scene)
{
    scene.world().setGravity(vec(0, 0, 0));
    scene.add(scene.box(0.01, 5, 5), 0, vec(10, 0, 0));
    btRigidBody& board = scene.add(scene.box(0.01, 1, 1), 5, vec(10, 0, 20));
    board.setActivationState(DISABLE_DEACTIVATION);
    scene.join<btHingeConstraint>(board, vec(0, 1, 0), vec(0, 0, 1));
    btSphereShape& shape = scene.shape<btSphereShape>(btScalar(0.1));
    std::vector<btRigidBody*> balls;
    for (int i = 0; i < 8; ++i)
    {
        btRigidBody& ball = scene.add(shape, 0.2, vec(0.37 * i, 0.9 * (i % 4) - 1.3, i < 6 ? i - 3 : 20));
        ball.setCcdMotionThreshold(btScalar(0.05));
        ball.setCcdSweptSphereRadius(btScalar(0.08));
        ball.setLinearVelocity(vec(120, 0, 0));
        ball.setActivationState(DISABLE_DEACTIVATION);
        balls.push_back(&ball);
    }
    double farthest = 0, spin = 0;
    for (int i = 0; i < 60; ++i)
    {
        scene.step();
        for (int k = 0; k < 6; ++k)
            farthest = std::max(farthest, double(balls[std::size_t(k)]->getWorldTransform().getOrigin().x()));
        spin = std::max(spin, double(board.getAngularVelocity().length()));
    }
    return {notMore("through the wall", farthest > 10 ? 1 : 0, 0), notMore("farthest", farthest, 0.02),
            notLess("board turns", std::min(spin, 1.0), 0.05)};
}

TEST(SolverEvents, StopFastBodiesAtThinWallsAsStock)
{
    expectAsStock(fastBalls, 3);
}
}  // namespace
}  // namespace cullet::test
