// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// What applications read of joints and expect of them: impulses, feedback, breaking, motors, limits, springs.
#include "cullet/tests/plugin/solver/solver_scene.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

namespace cullet::test
{
namespace
{

btTransform turned(const btVector3& axis, double angle, const btVector3& place)
{
    return btTransform(btQuaternion(axis, btScalar(angle)), place);
}

/// A load of 3 kg hangs below a fixed body, from a joint that makeJoint(scene, anchor, load) makes.
template <class MakeJoint>
Measures hangingLoad(SolverScene& scene, const MakeJoint& makeJoint)
{
    btRigidBody& anchor = scene.add(scene.box(0.5, 0.5, 0.5), 0, vec(0, 5, 0));
    btRigidBody& load = scene.add(scene.box(0.5, 0.5, 0.5), 3, vec(0, 3, 0));
    load.setActivationState(DISABLE_DEACTIVATION);
    btTypedConstraint& joint = makeJoint(scene, anchor, load);
    btJointFeedback feedback{};
    joint.setJointFeedback(&feedback);
    joint.enableFeedback(true);
    scene.step(240);
    const double weight = 3 * kGravity;
    return {equal("height", heightOfBody(load), 0.005),
            equal("applied impulse", double(joint.getAppliedImpulse()), 0.01 * weight * scene.dt()),
            equal("force on A", double(feedback.m_appliedForceBodyA.y()), 0.01 * weight),
            equal("force on B", double(feedback.m_appliedForceBodyB.y()), 0.01 * weight),
            equal("torque on A", double(feedback.m_appliedTorqueBodyA.length()), 0.02 * weight),
            equal("torque on B", double(feedback.m_appliedTorqueBodyB.length()), 0.02 * weight)};
}

/// @param makeJoint called with a scene and two bodies
template <class MakeJoint>
void expectLoadHangsAsStock(const MakeJoint& makeJoint)
{
    expectAsStock([&](SolverScene& scene) { return hangingLoad(scene, makeJoint); });
}

TEST(SolverJoints, ReportImpulsesAndFeedbackAsStock)
{
    const btTransform below = at(0, -1, 0), above = at(0, 1, 0);
    expectLoadHangsAsStock([&](SolverScene & in, btRigidBody & a, btRigidBody & b) -> auto& {
        return in.join<btPoint2PointConstraint>(a, b, below.getOrigin(), above.getOrigin());
    });
    expectLoadHangsAsStock([&](SolverScene & in, btRigidBody & a, btRigidBody & b) -> auto& {
        return in.join<btHingeConstraint>(a, b, below, above);
    });
    expectLoadHangsAsStock([&](SolverScene & in, btRigidBody & a, btRigidBody & b) -> auto& {
        return in.join<btFixedConstraint>(a, b, below, above);
    });
    expectLoadHangsAsStock([&](SolverScene & in, btRigidBody & a, btRigidBody & b) -> auto& {
        return in.join<btGeneric6DofConstraint>(a, b, below, above, true);
    });
    expectLoadHangsAsStock([&](SolverScene & in, btRigidBody & a, btRigidBody & b) -> auto& {
        auto& joint = in.join<btGeneric6DofSpring2Constraint>(a, b, below, above);
        joint.setLinearLowerLimit(vec(0, 0, 0));
        joint.setLinearUpperLimit(vec(0, 0, 0));
        return joint;
    });
    expectLoadHangsAsStock([&](SolverScene & in, btRigidBody & a, btRigidBody & b) -> auto& {
        return in.join<btConeTwistConstraint>(a, b, below, above);
    });
    expectLoadHangsAsStock([&](SolverScene & in, btRigidBody & a, btRigidBody & b) -> auto& {
        return in.join<btSliderConstraint>(a, b, below, above, true);
    });
    expectLoadHangsAsStock([&](SolverScene & in, btRigidBody & a, btRigidBody & b) -> auto& {
        return in.join<btHingeAccumulatedAngleConstraint>(a, b, below, above);
    });
    expectLoadHangsAsStock([](SolverScene & in, btRigidBody & a, btRigidBody & b) -> auto& {
        return in.join<btUniversalConstraint>(a, b, vec(0, 4, 0), vec(1, 0, 0), vec(0, 0, 1));
    });
    expectLoadHangsAsStock([](SolverScene & in, btRigidBody & a, btRigidBody & b) -> auto& {
        btVector3 anchor = vec(0, 4, 0), steering = vec(0, 1, 0), axle = vec(1, 0, 0);
        auto& joint = in.join<btHinge2Constraint>(a, b, anchor, steering, axle);
        joint.setStiffness(2, 400);
        joint.setDamping(2, 10);
        return joint;
    });
}

/// Whether a joint holds a load of this mass.
bool holds(Contender contender, double mass, double threshold)
{
    SolverScene scene(contender);
    btRigidBody& anchor = scene.add(scene.box(0.5, 0.5, 0.5), 0, vec(0, 5, 0));
    btRigidBody& load = scene.add(scene.box(0.5, 0.5, 0.5), mass, vec(0, 3, 0));
    load.setActivationState(DISABLE_DEACTIVATION);
    auto& joint = scene.join<btPoint2PointConstraint>(anchor, load, vec(0, -1, 0), vec(0, 1, 0));
    joint.setBreakingImpulseThreshold(btScalar(threshold));
    scene.step(120);
    EXPECT_EQ(joint.isEnabled(), heightOfBody(load) > 2) << mass;
    return joint.isEnabled();
}

TEST(SolverJoints, BreakAtSameLoadAsStock)
{
    const double threshold = 2 * kGravity / 60;  // 2 kg
    for (const Contender contender : {Contender::Stock, Contender::Bullet, Contender::Soft})
    {
        SCOPED_TRACE(nameOf(contender));
        EXPECT_TRUE(holds(contender, 1.96, threshold));
        EXPECT_FALSE(holds(contender, 2.04, threshold));
    }
}

/// A door with a motor, free of gravity, and one that its limit stops.
Measures doors(SolverScene& scene)
{
    scene.world().setGravity(vec(0, 0, 0));
    Measures measures;
    btBoxShape& leaf = scene.box(0.5, 1, 0.05);
    std::vector<btHingeConstraint*> hinges;
    std::vector<btRigidBody*> leaves;
    for (int i = 0; i < 3; ++i)
    {
        btRigidBody& body = scene.add(leaf, 2, vec(0, 0, 3 * i));
        body.setActivationState(DISABLE_DEACTIVATION);
        leaves.push_back(&body);
        hinges.push_back(&scene.join<btHingeConstraint>(body, vec(-0.5, 0, 0), vec(0, 1, 0)));
    }
    hinges[0]->enableAngularMotor(true, 3, 100);
    hinges[1]->enableAngularMotor(true, 3, btScalar(0.01));  // too weak to be there in a second
    hinges[2]->enableAngularMotor(true, 3, 1);
    hinges[2]->setLimit(btScalar(-0.5), btScalar(0.5));
    scene.step(60);
    measures.push_back(equal("speed", double(leaves[0]->getAngularVelocity().y()), 0.03));
    measures.push_back(equal("speed of weak motor", double(leaves[1]->getAngularVelocity().y()), 0.02));
    scene.step(60);
    measures.push_back(equal("angle at limit", double(hinges[2]->getHingeAngle()), 0.01));
    measures.push_back(equal("speed at limit", double(leaves[2]->getAngularVelocity().y()), 0.02));
    measures.push_back(equal("impulse at limit", double(hinges[2]->getAppliedImpulse()), 0.02));
    return measures;
}

TEST(SolverJoints, DriveHingesAsStock)
{
    expectAsStock(doors);
}

Measures sliders(SolverScene& scene)
{
    btBoxShape& cube = scene.box(0.25, 0.25, 0.25);
    std::vector<btSliderConstraint*> joints;
    std::vector<btRigidBody*> cubes;
    for (int i = 0; i < 3; ++i)
    {
        // The x axis of the frame points up.
        const btTransform frame = turned(vec(0, 0, 1), SIMD_HALF_PI, vec(0, 0, 0));
        btRigidBody& body = scene.add(cube, 2, vec(0, 3, 3 * i));
        body.setActivationState(DISABLE_DEACTIVATION);
        btRigidBody& anchor = scene.add(cube, 0, vec(0, 3, 3 * i));
        body.setIgnoreCollisionCheck(&anchor, true);
        cubes.push_back(&body);
        joints.push_back(&scene.join<btSliderConstraint>(anchor, body, frame, frame, true));
        joints.back()->setLowerLinLimit(-1);
        joints.back()->setUpperLinLimit(1);
    }
    joints[0]->setPoweredLinMotor(true);
    joints[0]->setTargetLinMotorVelocity(btScalar(0.5));
    joints[0]->setMaxLinMotorForce(100);
    joints[1]->setPoweredLinMotor(true);
    joints[1]->setTargetLinMotorVelocity(btScalar(0.5));
    joints[1]->setMaxLinMotorForce(5);  // a quarter of the weight
    scene.step(60);
    Measures measures;
    measures.push_back(equal("lifted", heightOfBody(*cubes[0]), 0.02));
    scene.step(180);
    measures.push_back(equal("at upper limit", heightOfBody(*cubes[0]), 0.01));
    measures.push_back(notMore("from lower limit, weak motor", std::abs(heightOfBody(*cubes[1]) - 2), 0.005));
    measures.push_back(notMore("from lower limit", std::abs(heightOfBody(*cubes[2]) - 2), 0.005));
    measures.push_back(
        notMore("aside", std::abs(double(cubes[0]->getWorldTransform().getOrigin().x())), 0.002));
    return measures;
}

TEST(SolverJoints, DriveSlidersAsStock)
{
    expectAsStock(sliders);
}

/// Loads on springs of 200 N/m with little damping, of both kinds.
Measures springs(SolverScene& scene)
{
    btBoxShape& cube = scene.box(0.25, 0.25, 0.25);
    std::vector<btRigidBody*> cubes;
    for (int i = 0; i < 2; ++i)
    {
        btRigidBody& anchor = scene.add(cube, 0, vec(3 * i, 5, 0));
        btRigidBody& body = scene.add(cube, 2, vec(3 * i, 3, 0));
        body.setActivationState(DISABLE_DEACTIVATION);
        cubes.push_back(&body);
        if (i == 0)
        {
            auto& joint =
                scene.join<btGeneric6DofSpringConstraint>(anchor, body, at(0, -1, 0), at(0, 1, 0), true);
            joint.setLinearLowerLimit(vec(0, 1, 0));
            joint.setLinearUpperLimit(vec(0, -1, 0));
            joint.setAngularLowerLimit(vec(0, 0, 0));
            joint.setAngularUpperLimit(vec(0, 0, 0));
            joint.enableSpring(1, true);
            joint.setStiffness(1, 200);
            joint.setDamping(1, 1);  // none
            joint.setEquilibriumPoint(1, 0);
        }
        else
        {
            auto& joint = scene.join<btGeneric6DofSpring2Constraint>(anchor, body, at(0, -1, 0), at(0, 1, 0));
            joint.setLinearLowerLimit(vec(0, 1, 0));
            joint.setLinearUpperLimit(vec(0, -1, 0));
            joint.setAngularLowerLimit(vec(0, 0, 0));
            joint.setAngularUpperLimit(vec(0, 0, 0));
            joint.enableSpring(1, true);
            joint.setStiffness(1, 200);
            joint.setDamping(1, 4);
            joint.setEquilibriumPoint(1, 0);
        }
    }
    Measures measures;
    scene.step(20);
    measures.push_back(equal("spring, early", heightOfBody(*cubes[0]), 0.01));
    measures.push_back(equal("spring 2, early", heightOfBody(*cubes[1]), 0.01));
    scene.step(520);
    double low = 10, high = 0;
    for (int i = 0; i < 60; ++i)
    {
        scene.step();
        low = std::min(low, heightOfBody(*cubes[0]));
        high = std::max(high, heightOfBody(*cubes[0]));
    }
    measures.push_back(notMore("amplitude of spring", high - low, 0.004));
    measures.push_back(equal("spring 2, at last", heightOfBody(*cubes[1]), 0.005));
    return measures;
}

TEST(SolverJoints, ExtendSpringsAsStockWithModelBullet)
{
    expectAsStock(springs, 1, {Contender::Bullet});
}

TEST(SolverJoints, ExtendSpringsAsStockWithModelSoft)
{
    expectAsStock(springs, 1, {Contender::Soft});
}

/// A servo motor, a motor, a limit with bounce and a free axis of generic joints.
Measures genericJoints(SolverScene& scene)
{
    scene.world().setGravity(vec(0, 0, 0));
    btBoxShape& cube = scene.box(0.25, 0.25, 0.25);
    Measures measures;
    btRigidBody& anchor = scene.add(cube, 0, vec(0, 5, 0));
    btRigidBody& servo = scene.add(cube, 2, vec(0, 3, 0));
    servo.setActivationState(DISABLE_DEACTIVATION);
    auto& first = scene.join<btGeneric6DofSpring2Constraint>(anchor, servo, at(0, -1, 0), at(0, 1, 0));
    first.setLinearLowerLimit(vec(1, 0, 0));
    first.setLinearUpperLimit(vec(-1, 0, 0));
    first.setAngularLowerLimit(vec(0, 0, 0));
    first.setAngularUpperLimit(vec(0, 0, 0));
    first.enableMotor(0, true);
    first.setServo(0, true);
    first.setServoTarget(0, 1);
    first.setTargetVelocity(0, 2);
    first.setMaxMotorForce(0, 50);
    btRigidBody& second = scene.add(cube, 0, vec(5, 5, 0));
    btRigidBody& wheel = scene.add(cube, 2, vec(5, 3, 0));
    wheel.setActivationState(DISABLE_DEACTIVATION);
    auto& motor = scene.join<btGeneric6DofConstraint>(second, wheel, at(0, -2, 0), at(0, 0, 0), true);
    motor.setAngularLowerLimit(vec(1, 0, 0));
    motor.setAngularUpperLimit(vec(-1, 0, 0));
    motor.getRotationalLimitMotor(0)->m_enableMotor = true;
    motor.getRotationalLimitMotor(0)->m_targetVelocity = 4;
    motor.getRotationalLimitMotor(0)->m_maxMotorForce = 10;
    scene.step(20);
    measures.push_back(equal("servo on its way", double(servo.getWorldTransform().getOrigin().x()), 0.02));
    scene.step(100);
    measures.push_back(equal("servo at its target", double(servo.getWorldTransform().getOrigin().x()), 0.01));
    measures.push_back(equal("spin", double(wheel.getAngularVelocity().x()), 0.04));
    measures.push_back(notMore("servo aside", std::abs(heightOfBody(servo) - 3), 0.002));
    measures.push_back(notMore("wheel from its place",
                               double((wheel.getWorldTransform().getOrigin() - vec(5, 3, 0)).length()),
                               0.002));
    return measures;
}

TEST(SolverJoints, DriveGenericJointsAsStock)
{
    expectAsStock(genericJoints);
}

/// A pendulum with a cone limit falls to its side, and one with a gear turns another.
Measures conesAndGears(SolverScene& scene)
{
    btBoxShape& rod = scene.box(0.1, 0.5, 0.1);
    btRigidBody& pendulum = scene.add(rod, 1, vec(0, 0.5, 0));
    pendulum.setActivationState(DISABLE_DEACTIVATION);
    // The twist axis, x of the frame, points up; Bullet takes the origin as the pivot in the world.
    const btTransform frame = turned(vec(0, 0, 1), SIMD_HALF_PI, vec(0, -0.5, 0));
    auto& cone = scene.join<btConeTwistConstraint>(pendulum, frame);
    cone.setLimit(btScalar(0.6), btScalar(0.6), btScalar(0.2));
    pendulum.setAngularVelocity(vec(0.5, 0, 0.3));
    btCylinderShape& disc = scene.shape<btCylinderShape>(vec(0.5, 0.1, 0.5));
    btRigidBody& driver = scene.add(disc, 1, vec(3, 1, 0));
    btRigidBody& driven = scene.add(disc, 1, vec(5, 1, 0));
    for (btRigidBody* body : {&driver, &driven})
    {
        body->setActivationState(DISABLE_DEACTIVATION);
        scene.join<btHingeConstraint>(*body, vec(0, 0, 0), vec(0, 1, 0));
    }
    scene.join<btGearConstraint>(driver, driven, vec(0, 1, 0), vec(0, 1, 0), btScalar(2));
    driver.setAngularVelocity(vec(0, 6, 0));
    scene.step(300);
    const btVector3 up = pendulum.getWorldTransform().getBasis().getColumn(1);
    const double spinA = double(driver.getAngularVelocity().y()),
                 spinB = double(driven.getAngularVelocity().y());
    return {equal("lean of pendulum", std::acos(double(up.y())), 0.03),
            notMore("pivot of pendulum", double((pendulum.getWorldTransform() * vec(0, -0.5, 0)).length()),
                    0.003),
            equal("spin of driver", spinA, 0.02 * std::abs(spinA)),
            equal("spin of driven", spinB, 0.02 * std::abs(spinB))};
}

TEST(SolverJoints, LimitConesAndTurnGearsAsStock)
{
    expectAsStock(conesAndGears);
}

/// A chain of 20 links hangs from a fixed body and swings; each third link is heavy.
void addChain(SolverScene& scene)
{
    btCapsuleShape& link = scene.shape<btCapsuleShape>(btScalar(0.1), btScalar(0.3));
    btRigidBody* above = &scene.add(scene.box(0.1, 0.1, 0.1), 0, vec(0, 20, 0));
    btVector3 pivot = vec(0, 0, 0);
    for (int i = 0; i < 20; ++i)
    {
        btRigidBody& body = scene.add(link, i % 3 == 0 ? 2 : 1,
                                      turned(vec(0, 0, 1), SIMD_HALF_PI, vec(0.25 + 0.5 * i, 20, 0)));
        body.setActivationState(DISABLE_DEACTIVATION);
        scene.join<btPoint2PointConstraint>(*above, body, pivot, vec(0, 0.25, 0));
        pivot = vec(0, -0.25, 0);
        above = &body;
    }
}

Measures chain(SolverScene& scene)
{
    addChain(scene);
    double worst = 0, sum = 0;
    for (int i = 0; i < 300; ++i)
    {
        scene.step();
        worst = std::max(worst, scene.pivotError());
        sum += scene.pivotError() / 300;
    }
    return {notMore("largest joint error", worst, 0.01), notMore("mean joint error", sum, 0.005),
            notMore("energy", scene.totalEnergy(), 20)};
}

TEST(SolverJoints, HoldChainsAsStockWithModelBullet)
{
    expectAsStock(chain, 5, {Contender::Bullet});
}

/// The soft model takes less of a chain's energy than stock Bullet, which counts as friction there.
Measures chainWithItsEnergy(SolverScene& scene)
{
    addChain(scene);
    scene.enter();
    const double first = scene.totalEnergy();
    double worst = 0, sum = 0, energy = 0;
    for (int i = 0; i < 300; ++i)
    {
        scene.step();
        worst = std::max(worst, scene.pivotError());
        sum += scene.pivotError() / 300;
        energy = std::max(energy, scene.totalEnergy());
    }
    return {notMore("largest joint error", worst, 0.01), notMore("mean joint error", sum, 0.005),
            notMore("growth of energy", energy / first, 0.01)};
}

TEST(SolverJoints, HoldChainsWithoutGainOfEnergyWithModelSoft)
{
    expectAsStock(chainWithItsEnergy, 3, {Contender::Soft});
}

/// Four bodies in a row that float and turn a little: joints with arms longer than the bodies and no load at all.
///
/// @return the most energy in four seconds, as a part of that after the first step
double growthOfFloatingChain(Contender contender, JointKind kind, Random& random)
{
    SolverScene scene(contender);
    btRigidBody* before = nullptr;
    for (int i = 0; i < 4; ++i)
    {
        const btVector3 half = vec(random.point(0.1f, 0.5f));
        const btQuaternion turn = randomTurn(random);
        btRigidBody& body =
            scene.add(scene.box(double(half.x()), double(half.y()), double(half.z())),
                      double(random.between(0.5f, 4)), btTransform(turn, btVector3(0, btScalar(-i), 0)));
        body.setActivationState(DISABLE_DEACTIVATION);
        body.setLinearVelocity(vec(random.point(-0.2f, 0.2f)));
        body.setAngularVelocity(vec(random.point(-1, 1)));
        if (before != nullptr)
            scene.joinOfKind(kind, *before, body);
        before = &body;
    }
    scene.world().setGravity(btVector3(0, 0, 0));
    scene.step();
    const double first = scene.kineticEnergy();
    double most = first;
    for (int i = 0; i < 240; ++i)
    {
        scene.step();
        most = std::max(most, scene.kineticEnergy());
    }
    EXPECT_GT(first, 0.01) << "nothing moves";
    return most / first;
}

TEST(SolverJoints, GiveChainsThatFloatNoEnergy)
{
    constexpr std::uint32_t kSeed = 20261127;
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    for (const Contender contender : {Contender::Stock, Contender::Bullet, Contender::Soft})
    {
        for (const JointKind kind :
             {JointKind::Ball, JointKind::Hinge, JointKind::Slider, JointKind::Generic, JointKind::Fixed})
        {
            Random random(kSeed);
            for (int i = 0; i < 20; ++i)
                EXPECT_LT(growthOfFloatingChain(contender, kind, random), 1.01)
                    << nameOf(contender) << ", " << nameOf(kind) << ", chain " << i;
        }
    }
}

/// A plank bridge with boxes that fall on it.
Measures bridge(SolverScene& scene)
{
    btBoxShape& plank = scene.box(0.45, 0.1, 1);
    btBoxShape& bank = scene.box(0.5, 0.1, 1);
    btRigidBody* before = &scene.add(bank, 0, vec(-1, 5, 0));
    double reach = 0.5;
    for (int i = 0; i < 20; ++i)
    {
        btRigidBody& body = scene.add(plank, 1, vec(i, 5, 0));
        for (const double z : {-1.0, 1.0})
            scene.join<btPoint2PointConstraint>(*before, body, vec(reach, 0, z), vec(-0.5, 0, z));
        before = &body;
        reach = 0.5;
    }
    btRigidBody& last = scene.add(bank, 0, vec(20, 5, 0));
    for (const double z : {-1.0, 1.0})
        scene.join<btPoint2PointConstraint>(*before, last, vec(0.5, 0, z), vec(-0.5, 0, z));
    btBoxShape& load = scene.box(0.3, 0.3, 0.3);
    scene.step(120);
    const double emptyError = scene.pivotError();
    double lowest = 10;
    for (int i = 1; i <= 20; ++i)
        lowest = std::min(lowest, heightOfBody(*scene.bodies()[std::size_t(i)]));
    for (int i = 0; i < 3; ++i)
    {
        btRigidBody& plankBelow = *scene.bodies()[std::size_t(9 + i)];
        btRigidBody& body =
            scene.add(load, 2, plankBelow.getWorldTransform().getOrigin() + vec(0, 0.45, 0.5 * (i - 1)));
        scene.world().addRigidBody(&body);
    }
    scene.step(180);
    double onBridge = 0;
    for (std::size_t i = scene.bodies().size() - 3; i < scene.bodies().size(); ++i)
        onBridge += heightOfBody(*scene.bodies()[i]) > 0;
    return {notMore("joint error of empty bridge", emptyError, 0.005),
            notMore("joint error", scene.pivotError(), 0.01), notLess("lowest plank", lowest, 0.1),
            notLess("loads on bridge", onBridge, 0)};
}

TEST(SolverJoints, HoldBridgesNoWorseThanStock)
{
    expectAsStock(bridge, 5);
}

/// One joint with many iterations of its own among others with few.
Measures ownIterations(SolverScene& scene)
{
    scene.info().m_numIterations = 4;
    btSphereShape& bead = scene.shape<btSphereShape>(btScalar(0.1));
    btRigidBody* above = &scene.add(bead, 0, vec(0, 20, 0));
    for (int i = 0; i < 12; ++i)
    {
        btRigidBody& body = scene.add(bead, i == 11 ? 4 : 1, vec(0, 20 - 0.5 * (i + 1), 0.02 * i));
        body.setActivationState(DISABLE_DEACTIVATION);
        scene.join<btPoint2PointConstraint>(*above, body, vec(0, i == 0 ? 0.0 : -0.25, 0), vec(0, 0.25, 0))
            .setOverrideNumSolverIterations(200);
        above = &body;
    }
    scene.step(120);
    return {notMore("joint error", scene.pivotError(), 0.01)};
}

TEST(SolverJoints, TakeIterationsOfTheirOwnAsStock)
{
    expectAsStock(ownIterations, 5);
}

TEST(SolverJoints, TakeIterationsOfTheWorldUnlessTheyHaveMoreThanNone)
{
    const btTransform below = at(0, -1, 0), above = at(0, 1, 0);
    expectLoadHangsAsStock([&](SolverScene & in, btRigidBody & a, btRigidBody & b) -> auto& {
        auto& joint = in.join<btPoint2PointConstraint>(a, b, below.getOrigin(), above.getOrigin());
        joint.setOverrideNumSolverIterations(0);
        return joint;
    });
}

/// A chain that hangs from a fixed bead sideways by a little, and swings.
Measures hangingBeads(SolverScene& scene)
{
    btSphereShape& bead = scene.shape<btSphereShape>(btScalar(0.25));
    btRigidBody* above = &scene.add(bead, 0, vec(0, 20, 0));
    for (int i = 0; i < 12; ++i)
    {
        btRigidBody& body = scene.add(bead, 1, vec(0, 20 - 0.5 * (i + 1), 0.02 * i));
        body.setActivationState(DISABLE_DEACTIVATION);
        scene.join<btPoint2PointConstraint>(*above, body, vec(0, i == 0 ? 0.0 : -0.25, 0), vec(0, 0.25, 0));
        above = &body;
    }
    scene.step(180);
    double most = 0;
    for (int i = 0; i < 120; ++i)
    {
        scene.step();
        most = std::max(most, scene.kineticEnergy());
    }
    return {notMore("most kinetic energy after 3 s", most, 0.1)};
}

TEST(SolverJoints, LetHangingChainsComeToRestAsStock)
{
    expectAsStock(hangingBeads, 3);
}
}  // namespace
}  // namespace cullet::test
