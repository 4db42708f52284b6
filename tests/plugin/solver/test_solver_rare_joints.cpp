// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Joints that derive from others of Bullet's, and ball joints that pick a body up.
#include "cullet/tests/plugin/solver/solver_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace cullet::test
{
namespace
{
void expectNoRefusal(SolverScene& scene)
{
    if (const auto* const own = dynamic_cast<const Solver*>(&scene.solver()))
    {
        EXPECT_EQ(own->stats().refusal, SolverRefusal::No);
        EXPECT_GT(own->stats().joints, 0u);
    }
}

btRigidBody& addAwake(SolverScene& scene, btCollisionShape& shape, double mass, const btVector3& place)
{
    btRigidBody& body = scene.add(shape, mass, place);
    body.setActivationState(DISABLE_DEACTIVATION);
    return body;
}

/// A load hangs from a universal joint and swings into its limits; a shaft turns another one through such a joint.
Measures universalJoints(SolverScene& scene)
{
    btBoxShape& cube = scene.box(0.25, 0.25, 0.25);
    btRigidBody& anchor = scene.add(cube, 0, vec(0, 5, 0));
    btRigidBody& load = addAwake(scene, cube, 2, vec(0, 4, 0));
    btUniversalConstraint& joint =
        scene.join<btUniversalConstraint>(anchor, load, vec(0, 5, 0), vec(1, 0, 0), vec(0, 0, 1));
    joint.setLowerLimit(btScalar(-0.4), btScalar(-0.3));
    joint.setUpperLimit(btScalar(0.4), btScalar(0.3));
    load.setLinearVelocity(vec(2, 0, 3));
    btCylinderShape& rod = scene.shape<btCylinderShape>(vec(0.1, 0.5, 0.1));
    btRigidBody& driver = addAwake(scene, rod, 1, vec(5, 3.5, 0));
    btRigidBody& driven = addAwake(scene, rod, 1, vec(5, 2.5, 0));
    scene.join<btHingeConstraint>(driver, vec(0, 0, 0), vec(0, 1, 0)).enableAngularMotor(true, 3, 1);
    scene.join<btHingeConstraint>(driven, vec(0, 0, 0), vec(0, 1, 0));
    scene.join<btUniversalConstraint>(driver, driven, vec(5, 3, 0), vec(1, 0, 0), vec(0, 0, 1));
    double farthest = 0, error = 0;
    for (int i = 0; i < 240; ++i)
    {
        scene.step();
        const btVector3 arm = load.getWorldTransform().getOrigin() - vec(0, 5, 0);
        farthest = std::max(farthest, std::hypot(double(arm.x()), double(arm.z())));
        error = std::max(error, std::abs(double(arm.length()) - 1));
    }
    expectNoRefusal(scene);
    return {equal("farthest aside", farthest, 0.03), notMore("error of place", error, 0.005),
            equal("speed of driver", double(driver.getAngularVelocity().y()), 0.03),
            equal("speed of driven", double(driven.getAngularVelocity().y()), 0.03)};
}

TEST(SolverRareJoints, HoldUniversalJointsAsStock)
{
    expectAsStock(universalJoints, 3);
}

/// Wheels on suspensions: one with a motor, one that is pushed aside and steered back by its limit.
Measures suspensions(SolverScene& scene)
{
    btCylinderShape& disc = scene.shape<btCylinderShape>(vec(0.1, 0.4, 0.4));
    btBoxShape& chassis = scene.box(0.2, 0.2, 0.2);
    std::vector<btRigidBody*> wheels;
    for (int i = 0; i < 2; ++i)
    {
        btRigidBody& frame = scene.add(chassis, 0, vec(3 * i, 5, 0));
        // Of a disc whose axis is x.
        btRigidBody& wheel = addAwake(scene, disc, 2, vec(3 * i, 4, 0));
        btVector3 anchor = vec(3 * i, 4, 0), steering = vec(0, 1, 0), axle = vec(1, 0, 0);
        auto& joint = scene.join<btHinge2Constraint>(frame, wheel, anchor, steering, axle);
        joint.setStiffness(2, 400);
        joint.setDamping(2, 10);
        if (i == 0)
        {
            joint.enableMotor(3, true);
            joint.setTargetVelocity(3, 4);
            joint.setMaxMotorForce(3, 10);
        }
        else
        {
            wheel.setAngularVelocity(vec(0, 6, 0));
        }
        wheels.push_back(&wheel);
    }
    double most = 0;
    for (int i = 0; i < 240; ++i)
    {
        scene.step();
        const btVector3 axle = wheels[1]->getWorldTransform().getBasis().getColumn(0);
        most = std::max(most, std::atan2(std::abs(double(axle.z())), double(axle.x())));
    }
    expectNoRefusal(scene);
    return {equal("height with motor", heightOfBody(*wheels[0]), 0.005),
            equal("height", heightOfBody(*wheels[1]), 0.005),
            equal("spin", double(wheels[0]->getAngularVelocity().x()), 0.04),
            equal("most turned aside", most, 0.05),
            notMore("wheel from its axis",
                    std::hypot(double(wheels[0]->getWorldTransform().getOrigin().x()),
                               double(wheels[0]->getWorldTransform().getOrigin().z())),
                    0.003)};
}

TEST(SolverRareJoints, SuspendWheelsAsStock)
{
    expectAsStock(suspensions, 3);
}

/// Doors that count their turns: one with a motor, one with limits.
Measures countingDoors(SolverScene& scene)
{
    scene.world().setGravity(vec(0, 0, 0));
    btBoxShape& leaf = scene.box(0.5, 1, 0.05);
    std::vector<btHingeAccumulatedAngleConstraint*> hinges;
    for (int i = 0; i < 2; ++i)
    {
        btRigidBody& body = addAwake(scene, leaf, 2, vec(0, 0, 3 * i));
        hinges.push_back(&scene.join<btHingeAccumulatedAngleConstraint>(body, vec(-0.5, 0, 0), vec(0, 1, 0)));
    }
    hinges[0]->enableAngularMotor(true, 6, 100);
    hinges[1]->enableAngularMotor(true, 3, 1);
    hinges[1]->setLimit(btScalar(-0.5), btScalar(0.5));
    scene.step(180);
    expectNoRefusal(scene);
    EXPECT_GT(std::abs(double(hinges[0]->getAccumulatedHingeAngle())), 2 * SIMD_2_PI);
    return {equal("angle", double(hinges[0]->getAccumulatedHingeAngle()), 0.1),
            equal("angle at limit", double(hinges[1]->getAccumulatedHingeAngle()), 0.01)};
}

TEST(SolverRareJoints, CountTurnsOfHingesAsStock)
{
    expectAsStock(countingDoors, 3);
}

/// As Bullet's demos pick up a body: by a ball joint whose impulse has a bound.
btPoint2PointConstraint& pick(SolverScene& scene, btRigidBody& body, double clamp)
{
    auto& joint = scene.join<btPoint2PointConstraint>(body, vec(0, 0, 0));
    joint.m_setting.m_impulseClamp = btScalar(clamp);
    joint.m_setting.m_tau = btScalar(0.001);
    return joint;
}

/// A body that is carried sideways and let go, one that is held, and one that is too heavy for that.
Measures picking(SolverScene& scene)
{
    btBoxShape& cube = scene.box(0.25, 0.25, 0.25);
    btRigidBody& thrown = addAwake(scene, cube, 2, vec(0, 10, 0));
    btRigidBody& held = addAwake(scene, cube, 2, vec(0, 10, 3));
    btRigidBody& heavy = addAwake(scene, cube, 30, vec(0, 10, 6));
    btPoint2PointConstraint& hand = pick(scene, thrown, 30);
    btJointFeedback holding{}, weak{};
    pick(scene, held, 30).setJointFeedback(&holding);
    pick(scene, heavy, 2).setJointFeedback(&weak);
    double least = 10, most = 0;
    for (int i = 1; i <= 60; ++i)
    {
        hand.setPivotB(vec(4 * i * scene.dt(), 10, 0));
        scene.step();
        const double impulse = double(weak.m_appliedForceBodyA.y()) * scene.dt();
        least = std::min(least, impulse);
        most = std::max(most, impulse);
    }
    expectNoRefusal(scene);
    EXPECT_GT(most, 0);
    Measures measures = {
        equal("behind the hand", 4 - double(thrown.getWorldTransform().getOrigin().x()), 0.02),
        equal("speed", double(thrown.getLinearVelocity().x()), 0.05),
        equal("height of what is held", heightOfBody(held), 0.005),
        equal("force that holds", double(holding.m_appliedForceBodyA.y()), 0.02 * 2 * kGravity),
        equal("speed of what is too heavy", double(heavy.getLinearVelocity().y()), 0.03),
        equal("least impulse", least, 1e-3),
        equal("most impulse", most, 1e-3)};
    hand.setEnabled(false);
    scene.step(60);
    measures.push_back(equal("thrown", double(thrown.getWorldTransform().getOrigin().x()), 0.1));
    measures.push_back(equal("fallen", heightOfBody(thrown), 0.05));
    return measures;
}

TEST(SolverRareJoints, PickBodiesUpAsStock)
{
    expectAsStock(picking, 3);
}

/// A chain of ball joints with bounds that they never reach, as a safeguard.
Measures boundedChain(SolverScene& scene)
{
    btSphereShape& bead = scene.shape<btSphereShape>(btScalar(0.2));
    btRigidBody* above = &scene.add(bead, 0, vec(0, 10, 0));
    for (int i = 1; i <= 8; ++i)
    {
        btRigidBody& body = addAwake(scene, bead, 1, vec(0.3 * i, 10 - 0.4 * i, 0));
        scene
            .join<btPoint2PointConstraint>(*above, body, i == 1 ? vec(0, 0, 0) : vec(0.15, -0.2, 0),
                                           i == 1 ? vec(-0.3, 0.4, 0) : vec(-0.15, 0.2, 0))
            .m_setting.m_impulseClamp = 1000;
        above = &body;
    }
    scene.enter();
    const double first = scene.totalEnergy();
    double error = 0, energy = 0;
    for (int i = 0; i < 300; ++i)
    {
        scene.step();
        error += scene.pivotError() / 300;
        energy = std::max(energy, scene.totalEnergy());
    }
    return {notMore("mean joint error", error, 0.002), notMore("growth of energy", energy / first, 0.01)};
}

TEST(SolverRareJoints, HoldChainsOfBoundedBallJointsAsStock)
{
    expectAsStock(boundedChain, 3);
}
}  // namespace
}  // namespace cullet::test
