// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Contacts whose outcome a formula gives: slopes, bounces, weights at rest.
#include "cullet/tests/plugin/solver/solver_scene.h"
#include "cullet/tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr double kRadian = 0.017453292519943295;  ///< of a degree

/// A flat box on a slope; the direction of gravity is what leans, so that the contact is the same at each angle.
btRigidBody& addSledge(SolverScene& scene, double angle, double friction)
{
    btRigidBody& floor = scene.addFloor();
    floor.setFriction(1);
    btRigidBody& sledge = scene.add(scene.box(1, 0.25, 1), 2, vec(0, 0.25, 0));
    sledge.setFriction(btScalar(friction));
    sledge.setActivationState(DISABLE_DEACTIVATION);
    scene.world().setGravity(vec(kGravity * std::sin(angle), -kGravity * std::cos(angle), 0));
    return sledge;
}

double slideSpeed(Contender contender, double angle, double friction, int steps)
{
    SolverScene scene(contender);
    const btRigidBody& sledge = addSledge(scene, angle, friction);
    scene.step(steps);
    return double(sledge.getLinearVelocity().x());
}

class SolverFormulas : public testing::TestWithParam<Contender>
{
};

std::string nameOfCase(const testing::TestParamInfo<Contender>& info)
{
    return info.param == Contender::Bullet ? "Bullet" : "Soft";
}

INSTANTIATE_TEST_SUITE_P(, SolverFormulas, testing::Values(Contender::Bullet, Contender::Soft), nameOfCase);

TEST_P(SolverFormulas, SlipWithinTwoPercentOfFrictionAngle)
{
    for (const double friction : {0.2, 0.5, 0.8})
    {
        const double slip = std::atan(friction);
        EXPECT_LT(std::abs(slideSpeed(GetParam(), slip * 0.98, friction, 120)), 0.005) << friction;
        const double excess = kGravity * (std::sin(slip * 1.02) - friction * std::cos(slip * 1.02));
        EXPECT_GT(slideSpeed(GetParam(), slip * 1.02, friction, 120), 0.5 * excess * 2) << friction;
    }
}

/// Expects the speed of the formula after 2 s on slopes 10 degrees steeper than needed.
void expectSlideByFormula(Contender contender)
{
    for (const double friction : {0.0, 0.2, 0.5})
    {
        const double angle = std::atan(friction) + 10 * kRadian;
        const double speed = 2 * kGravity * (std::sin(angle) - friction * std::cos(angle));
        EXPECT_NEAR(slideSpeed(contender, angle, friction, 120) / speed, 1, 0.02) << friction;
    }
}

TEST(SolverContacts, AccelerateBySlopeLessFrictionWithModelBullet)
{
    expectSlideByFormula(Contender::Bullet);
}

TEST(SolverContacts, AccelerateBySlopeLessFrictionWithModelSoft)
{
    expectSlideByFormula(Contender::Soft);
}

/// Height of a ball over its height of rest after its first bounce, as a share of the height of its fall.
double bounce(Contender contender, double restitution, int stepsPerSecond)
{
    SolverScene scene(contender);
    scene.setStepsPerSecond(stepsPerSecond);
    scene.addFloor().setRestitution(1);
    constexpr double kFall = 2;
    btRigidBody& ball = scene.add(scene.shape<btSphereShape>(btScalar(0.5)), 1, vec(0, 0.5 + kFall, 0));
    ball.setRestitution(btScalar(restitution));
    double top = 0;
    bool hasTouched = false;
    for (int step = 0; step < 4 * stepsPerSecond; ++step)
    {
        scene.step();
        const double speed = double(ball.getLinearVelocity().y());
        if (hasTouched && speed < 0)
            break;
        hasTouched |= speed > 0;
        if (hasTouched)
            top = std::max(top, heightOfBody(ball) - 0.5);
    }
    return top / kFall;
}

TEST(SolverContacts, BounceAsStockWithModelBullet)
{
    for (const double restitution : {0.3, 0.5, 0.8, 1.0})
    {
        for (const int stepsPerSecond : {60, 120, 240})
        {
            const double stock = bounce(Contender::Stock, restitution, stepsPerSecond);
            EXPECT_NEAR(bounce(Contender::Bullet, restitution, stepsPerSecond) / stock, 1, 0.02)
                << restitution << " at " << stepsPerSecond;
        }
    }
}

// Stock bounces too high or too low where a step is shorter than the way to a predicted contact.
TEST(SolverContacts, BounceByFormulaWithModelSoft)
{
    for (const double restitution : {0.3, 0.5, 0.8, 1.0})
    {
        const double height = restitution * restitution;
        const double stock = std::abs(bounce(Contender::Stock, restitution, 60) - height);
        EXPECT_NEAR(bounce(Contender::Soft, restitution, 60), height, stock + 0.02 * height) << restitution;
        EXPECT_NEAR(bounce(Contender::Soft, restitution, 1000), height, 0.02 * height) << restitution;
    }
}

TEST_P(SolverFormulas, ReportWeightAsSumOfNormalImpulses)
{
    for (const int count : {1, 2, 5})
    {
        SolverScene scene(GetParam());
        const btRigidBody& floor = scene.addFloor();
        double mass = 0;
        for (int i = 0; i < count; ++i)
        {
            scene.add(scene.box(0.5, 0.5, 0.5), 1 + i, vec(0, 0.5 + i, 0))
                .setActivationState(DISABLE_DEACTIVATION);
            mass += 1 + i;
        }
        scene.step(240);
        EXPECT_NEAR(scene.normalImpulse(floor) / (mass * kGravity * scene.dt()), 1, 0.01) << count;
    }
}

TEST_P(SolverFormulas, ReportFrictionOnSlopeAsLateralImpulses)
{
    SolverScene scene(GetParam());
    const double angle = 15 * kRadian;
    const btRigidBody& sledge = addSledge(scene, angle, 0.5);
    scene.step(120);
    const double weight = 2 * kGravity * scene.dt();
    EXPECT_NEAR(scene.normalImpulse(sledge) / (weight * std::cos(angle)), 1, 0.01);
    EXPECT_NEAR(std::abs(double(scene.frictionImpulse(sledge).x())) / (weight * std::sin(angle)), 1, 0.01);
}

btRigidBody& addRollingBall(SolverScene& scene, double rolling, double spinning)
{
    scene.addFloor().setFriction(1);
    btRigidBody& ball = scene.add(scene.shape<btSphereShape>(btScalar(0.5)), 1, vec(0, 0.5, 0));
    ball.setRollingFriction(btScalar(rolling));
    ball.setSpinningFriction(btScalar(spinning));
    ball.setActivationState(DISABLE_DEACTIVATION);
    return ball;
}

/// How far speed and way of a rolling ball are from constant deceleration.
Measures rollingBall(SolverScene& scene, double rolling)
{
    btRigidBody& ball = addRollingBall(scene, rolling, 0);
    ball.setAngularVelocity(vec(0, 0, -6));
    ball.setLinearVelocity(vec(3, 0, 0));
    // The torque is rolling * m g, the moment of inertia about the contact 1.4 m r^2.
    const double deceleration = rolling * kGravity / (1.4 * 0.5 * 0.5) * 0.5;
    const double time = deceleration > 0 ? std::min(5.0, 3 / deceleration) : 5;
    const double way = time * (3 - deceleration * time / 2);
    scene.step(60);
    const double speed = double(ball.getLinearVelocity().x()) - (3 - deceleration);
    scene.step(240);
    const double place = double(ball.getWorldTransform().getOrigin().x());
    return {notMore("error of speed after 1 s", std::abs(speed), 0.02 * (3 - deceleration)),
            notMore("error of way after 5 s", std::abs(place - way), 0.02 * way)};
}

TEST(SolverFriction, SlowsRollingNoWorseThanStock)
{
    for (const double rolling : {0.0, 0.02, 0.1})
        expectAsStock([=](SolverScene& scene) { return rollingBall(scene, rolling); });
}

/// Bullet slows spinning only where there is rolling friction.
Measures spinningBall(SolverScene& scene, double spinning)
{
    btRigidBody& ball = addRollingBall(scene, 0.001, spinning);
    ball.setAngularVelocity(vec(0, 20, 0));
    scene.step(60);
    const double spin = double(ball.getAngularVelocity().y());
    scene.step(240);
    return {equal("spin after 1 s", spin, 0.4),
            equal("last spin", double(ball.getAngularVelocity().y()), 0.4)};
}

TEST(SolverFriction, SlowsSpinningAsStock)
{
    for (const double spinning : {0.0, 0.02, 0.1})
        expectAsStock([=](SolverScene& scene) { return spinningBall(scene, spinning); });
}

/// A box slides with 45 degrees over a floor with less friction along x.
Measures skate(SolverScene& scene, int mode)
{
    scene.info().m_solverMode |= mode;
    scene.addFloor().setFriction(1);
    btRigidBody& box = scene.add(scene.box(1, 0.25, 1), 1, vec(0, 0.25, 0));
    box.setFriction(btScalar(0.5));
    box.setAnisotropicFriction(vec(0.1, 1, 1), btCollisionObject::CF_ANISOTROPIC_FRICTION);
    box.setLinearVelocity(vec(4, 0, 4));
    scene.step(60);
    return {equal("x", double(box.getWorldTransform().getOrigin().x()), 0.15),
            equal("z", double(box.getWorldTransform().getOrigin().z()), 0.15)};
}

TEST(SolverFriction, FollowsAnisotropyAsStock)
{
    expectAsStock([](SolverScene& scene) { return skate(scene, 0); }, 1, {Contender::Bullet});
}

TEST(SolverFriction, FollowsAnisotropyWithTwoDirectionsAsStock)
{
    expectAsStock([](SolverScene& scene) { return skate(scene, SOLVER_USE_2_FRICTION_DIRECTIONS); }, 1,
                  {Contender::Bullet});
}

/// A box slides over an ordinary floor, not along an axis.
Measures slideAcross(SolverScene& scene)
{
    scene.addFloor().setFriction(1);
    btRigidBody& box = scene.add(scene.box(1, 0.25, 1), 1, vec(0, 0.25, 0));
    box.setLinearVelocity(vec(4, 0, 4));
    scene.step(120);
    const btVector3 place = box.getWorldTransform().getOrigin();
    const double way = 32 / (2 * 0.5 * kGravity);
    return {notMore("error of way", std::abs(std::hypot(double(place.x()), double(place.z())) - way),
                    0.02 * way)};
}

TEST(SolverFriction, StopsInFormulasWayInAnyDirectionWithModelBullet)
{
    expectAsStock(slideAcross, 1, {Contender::Bullet});
}

TEST(SolverFriction, StopsInFormulasWayInAnyDirectionWithModelSoft)
{
    expectAsStock(slideAcross, 1, {Contender::Soft});
}

/// Sets m_contactMotion1 and a direction of friction in each point, as an application does for conveyor belts.
bool runBelt(btManifoldPoint& point, const btCollisionObjectWrapper*, int, int,
             const btCollisionObjectWrapper*, int, int)
{
    point.m_lateralFrictionDir1 = btVector3(1, 0, 0);
    point.m_lateralFrictionDir2 = btVector3(0, 0, 1);
    point.m_contactMotion1 = 2;
    point.m_contactPointFlags |= BT_CONTACT_FLAG_LATERAL_FRICTION_INITIALIZED;
    return false;
}

class ContactCallback
{
public:
    explicit ContactCallback(ContactAddedCallback callback) { gContactAddedCallback = callback; }
    ~ContactCallback() { gContactAddedCallback = nullptr; }
    ContactCallback(const ContactCallback&) = delete;
    ContactCallback& operator=(const ContactCallback&) = delete;
};

Measures belt(SolverScene& scene)
{
    scene.info().m_solverMode |= SOLVER_ENABLE_FRICTION_DIRECTION_CACHING | SOLVER_USE_2_FRICTION_DIRECTIONS;
    btRigidBody& floor = scene.addFloor();
    floor.setCollisionFlags(floor.getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
    btRigidBody& box = scene.add(scene.box(0.5, 0.5, 0.5), 1, vec(0, 0.5, 0));
    box.setActivationState(DISABLE_DEACTIVATION);
    scene.step(120);
    return {equal("speed", double(box.getLinearVelocity().x()), 0.05),
            equal("aside", double(box.getWorldTransform().getOrigin().z()), 0.02),
            equal("way", double(box.getWorldTransform().getOrigin().x()), 0.1)};
}

TEST(SolverFriction, CarriesBoxesOnConveyorBelts)
{
    const ContactCallback callback(runBelt);
    expectAsStock(belt);
}

/// A platform that moves carries what stands on it.
Measures ferry(SolverScene& scene)
{
    btRigidBody& platform = scene.addKinematic(scene.box(3, 0.5, 3), vec(0, -0.5, 0));
    platform.setFriction(1);
    btRigidBody& box = scene.add(scene.box(0.5, 0.5, 0.5), 1, vec(0, 0.5, 0));
    btRigidBody& ball = scene.add(scene.shape<btCapsuleShape>(btScalar(0.4), btScalar(1)), 1, vec(2, 0.9, 0));
    ball.setAngularFactor(0);
    ball.setFriction(1);
    box.setActivationState(DISABLE_DEACTIVATION);
    ball.setActivationState(DISABLE_DEACTIVATION);
    double time = 0;
    scene.setScript(
        [&]
        {
            time += scene.dt();
            platform.setWorldTransform(at(2 - 2 * std::cos(time), -0.5 + 0.25 * std::sin(2 * time), 0));
        });
    scene.step(300);
    const double x = double(platform.getWorldTransform().getOrigin().x());
    const double y = double(platform.getWorldTransform().getOrigin().y());
    scene.setScript({});
    return {
        notMore("box from its place", std::abs(double(box.getWorldTransform().getOrigin().x()) - x), 0.01),
        notMore("capsule from its place", std::abs(double(ball.getWorldTransform().getOrigin().x()) - 2 - x),
                0.01),
        equal("box over platform", heightOfBody(box) - y, 0.01),
        equal("capsule over platform", heightOfBody(ball) - y, 0.01)};
}

TEST(SolverContacts, CarryBodiesOnPlatforms)
{
    expectAsStock(ferry);
}

/// Small cylinders that strike the floor with their rims turn faster than a pose can follow in a step.
TEST(SolverContacts, KeepFastSmallCylindersAboveTheFloorWithModelSoft)
{
    constexpr int kSide = 50, kSeed = 41;
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    Random random(kSeed);
    SolverScene scene(Contender::Soft);
    scene.add(scene.box(100, 2, 100), 0, vec(0, -2, 0));
    std::vector<btRigidBody*> cylinders;
    for (int i = 0; i < kSide * kSide; ++i)
    {
        const double size = double(random.between(0.14f, 0.35f));
        btCollisionShape& shape = scene.shape<btCylinderShape>(vec(random.point(0.5f, 1)) * btScalar(size));
        const btVector3 axis = vec(random.point(-1, 1));
        const btTransform place(btQuaternion(axis.x(), axis.y(), axis.z(), 1).normalized(),
                                vec(3 * (i % kSide) - 75, random.between(0.8f, 1.2f), 3 * (i / kSide) - 75));
        btRigidBody& cylinder = scene.add(shape, double(random.between(0.5f, 4)), place);
        cylinder.setLinearVelocity(vec(random.point(-3, 3)) - vec(0, random.between(16, 20), 0));
        cylinders.push_back(&cylinder);
    }
    double fastest = 0;
    for (int i = 0; i < 45; ++i)
    {
        scene.step();
        for (const btRigidBody* cylinder : cylinders)
            fastest = std::max(fastest, double(cylinder->getAngularVelocity().length()));
    }
    EXPECT_GT(fastest, 40) << "none turns fast";
    const auto sunk = std::count_if(cylinders.begin(), cylinders.end(),
                                    [](const btRigidBody* cylinder) { return heightOfBody(*cylinder) < 0; });
    EXPECT_EQ(sunk, 0);
}

/// A kinematic wall pushes boxes over the floor.
Measures push(SolverScene& scene)
{
    scene.addFloor();
    btRigidBody& wall = scene.addKinematic(scene.box(0.5, 1, 3), vec(-2, 1, 0));
    for (int i = 0; i < 3; ++i)
        scene.add(scene.box(0.5, 0.5, 0.5), 1, vec(1.2 * i, 0.5, 0));
    double x = -2;
    scene.setScript([&] { wall.setWorldTransform(at(x += scene.dt(), 1, 0)); });
    scene.step(240);
    scene.setScript({});
    double overlap = 0;
    for (int i = 0; i < 3; ++i)
        overlap = std::max(
            overlap,
            x + 1 + i - double(scene.bodies()[2 + std::size_t(i)]->getWorldTransform().getOrigin().x()));
    return {notMore("overlap", overlap, 0.02),
            equal("speed", double(scene.bodies()[4]->getLinearVelocity().x()), 0.1)};
}

TEST(SolverContacts, PushRows)
{
    expectAsStock(push);
}

/// Two balls hit a box that can neither move along x nor turn about x or z.
Measures lockedBox(SolverScene& scene)
{
    scene.addFloor();
    btRigidBody& box = scene.add(scene.box(0.5, 0.5, 0.5), 1, vec(0, 2, 0));
    box.setLinearFactor(vec(0, 1, 1));
    box.setAngularFactor(vec(0, 1, 0));
    btSphereShape& sphere = scene.shape<btSphereShape>(btScalar(0.3));
    scene.add(sphere, 3, vec(-3, 0.7, 0.3)).setLinearVelocity(vec(9, 4, 0));
    scene.add(sphere, 3, vec(0.3, 0.7, -3)).setLinearVelocity(vec(0, 4, 9));
    double locked = 0, turned = 0;
    for (int i = 0; i < 90; ++i)
    {
        scene.step();
        const btVector3 spin = box.getAngularVelocity();
        locked = std::max(locked, std::abs(double(spin.x())) + std::abs(double(spin.z())));
        turned = std::max(turned, std::abs(double(spin.y())));
    }
    return {equal("x", double(box.getWorldTransform().getOrigin().x()), 1e-6),
            equal("locked spin", locked, 1e-6), notLess("free spin", std::min(turned, 1.0), 0),
            notLess("z", std::min(1.0, double(box.getWorldTransform().getOrigin().z())), 0.2)};
}

TEST(SolverContacts, KeepLinearAndAngularFactors)
{
    expectAsStock(lockedBox);
}

/// A ball is laid on the floor.
Measures sinkBall(SolverScene& scene)
{
    btRigidBody& ball = scene.add(scene.shape<btSphereShape>(btScalar(0.5)), 1, vec(0, 0.5, 0));
    ball.setActivationState(DISABLE_DEACTIVATION);
    scene.step(10);
    const double early = heightOfBody(ball);
    scene.step(290);
    return {equal("height after 10 steps", early, 0.002), equal("last height", heightOfBody(ball), 0.001)};
}

/// A body on a point with spring and damper.
Measures springyFloor(SolverScene& scene)
{
    scene.addFloor().setContactStiffnessAndDamping(400, 20);
    return sinkBall(scene);
}

TEST(SolverContacts, FollowStiffnessAndDampingAsStock)
{
    expectAsStock(springyFloor);
}

bool makeSoftPoint(btManifoldPoint& point, const btCollisionObjectWrapper*, int, int,
                   const btCollisionObjectWrapper*, int, int)
{
    point.m_contactPointFlags |= BT_CONTACT_FLAG_HAS_CONTACT_CFM | BT_CONTACT_FLAG_HAS_CONTACT_ERP;
    point.m_contactCFM = btScalar(0.01);
    point.m_contactERP = btScalar(0.4);
    return false;
}

Measures softPoint(SolverScene& scene)
{
    btRigidBody& floor = scene.addFloor();
    floor.setCollisionFlags(floor.getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
    return sinkBall(scene);
}

TEST(SolverContacts, FollowSoftnessOfPointsAsStock)
{
    const ContactCallback callback(makeSoftPoint);
    expectAsStock(softPoint);
}

Measures anchored(SolverScene& scene)
{
    btRigidBody& floor = scene.addFloor();
    floor.setCollisionFlags(floor.getCollisionFlags() | btCollisionObject::CF_HAS_FRICTION_ANCHOR);
    floor.setFriction(1);
    btRigidBody& box = scene.add(scene.box(0.5, 0.25, 0.5), 1, vec(0, 0.25, 0));
    box.setActivationState(DISABLE_DEACTIVATION);
    scene.world().setGravity(vec(3, -10, 0));
    scene.step(600);
    return {notMore("creep", std::abs(double(box.getWorldTransform().getOrigin().x())), 0.003)};
}

TEST(SolverFriction, HoldsAnchorsAsStock)
{
    expectAsStock(anchored);
}
/// How far a body swings on a spring whose force the application sets before each step.
Measures ownSpring(SolverScene& scene)
{
    btRigidBody& body = scene.add(scene.box(0.25, 0.25, 0.25), 2, vec(0, 3, 0));
    body.setActivationState(DISABLE_DEACTIVATION);
    scene.setScript([&] { body.applyCentralForce(vec(0, 200 * (3 - heightOfBody(body)), 0)); });
    scene.step(540);
    double low = 3, high = 0;
    for (int i = 0; i < 60; ++i)
    {
        scene.step();
        low = std::min(low, heightOfBody(body));
        high = std::max(high, heightOfBody(body));
    }
    scene.setScript({});
    return {notMore("amplitude", high - low, 0.01)};
}

TEST(SolverForces, KeepEnergyOfOwnSpringsAsStockWithModelBullet)
{
    expectAsStock(ownSpring, 1, {Contender::Bullet});
}

TEST(SolverForces, KeepEnergyOfOwnSpringsAsStockWithModelSoft)
{
    expectAsStock(ownSpring, 1, {Contender::Soft});
}
}  // namespace
}  // namespace cullet::test
