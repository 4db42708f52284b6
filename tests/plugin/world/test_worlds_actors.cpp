// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Active objects: vehicles, characters, fast bodies, zones, and applications that change bodies while the world runs.
// Each has one moving body, so that no order of pairs matters and numbers can be compared.

#include "cullet/tests/plugin/small_world.h"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletDynamics/Character/btKinematicCharacterController.h>
#include <BulletDynamics/Vehicle/btRaycastVehicle.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace cullet::test
{
namespace
{
/// Hills of a metre, 64 m wide.
struct Hills
{
    static constexpr int kSide = 65;
    static std::vector<btScalar> heights()
    {
        std::vector<btScalar> result;  // PHY_FLOAT means btScalar
        for (int z = 0; z < kSide; ++z)
        {
            for (int x = 0; x < kSide; ++x)
                result.push_back(btScalar(0.5 * std::sin(0.3 * x) + 0.5 * std::cos(0.25 * z)));
        }
        return result;
    }
    std::vector<btScalar> samples = heights();
    btHeightfieldTerrainShape shape{kSide,       kSide, samples.data(), 1,    btScalar(-1),
                                    btScalar(1), 1,     PHY_FLOAT,      false};
};

/// Position of a car with four wheels after three seconds of full throttle over the hills, and the state of its wheels.
std::vector<double> driveOverHills(btBroadphaseInterface& broadphase)
{
    Hills hills;
    SmallWorld scene(broadphase);
    scene.add(hills.shape, 0, vec(0, 0, 0));
    btRigidBody& chassis = scene.add(scene.shape<btBoxShape>(vec(1, 0.4, 2)), 800, vec(0, 2.5, -20));
    chassis.setActivationState(DISABLE_DEACTIVATION);
    btDefaultVehicleRaycaster raycaster(&scene.world);
    btRaycastVehicle::btVehicleTuning tuning;
    btRaycastVehicle vehicle(tuning, &chassis, &raycaster);
    vehicle.setCoordinateSystem(0, 1, 2);
    scene.world.addVehicle(&vehicle);
    for (const double x : {-1.0, 1.0})
    {
        for (const double z : {-1.6, 1.6})
            vehicle.addWheel(vec(x, 0, z), vec(0, -1, 0), vec(-1, 0, 0), btScalar(0.6), btScalar(0.5), tuning,
                             z > 0);
    }
    double wheelsOnTheGround = 0;
    for (int i = 0; i < 180; ++i)
    {
        for (int wheel = 0; wheel < 4; ++wheel)
            vehicle.applyEngineForce(1500, wheel);
        scene.step();
        for (int wheel = 0; wheel < 4; ++wheel)
            wheelsOnTheGround += vehicle.getWheelInfo(wheel).m_raycastInfo.m_isInContact ? 1 : 0;
    }
    scene.world.removeVehicle(&vehicle);
    const btVector3 at = chassis.getWorldTransform().getOrigin();
    EXPECT_GT(at.z(), btScalar(-10)) << "the car has not driven";
    EXPECT_GT(at.y(), btScalar(-1)) << "the car fell through the hills";
    EXPECT_GT(wheelsOnTheGround, 200);
    return {double(at.x()), double(at.y()), double(at.z()), wheelsOnTheGround / 100};
}

TEST(WorldsActors, MatchDbvtWhenVehicleDrivesOverHeightfield)
{
    expectAsWithDbvt(driveOverHills, 1e-3);
}

/// Positions of a character that walks up five stairs, by steps of the world.
std::vector<double> climbStairs(btBroadphaseInterface& broadphase)
{
    btGhostPairCallback ghostCallback;
    broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(&ghostCallback);
    std::vector<double> result;
    {
        SmallWorld scene(broadphase);
        btBoxShape& stair = scene.shape<btBoxShape>(vec(0.5, 0.1, 2));
        scene.add(scene.shape<btBoxShape>(vec(10, 1, 10)), 0, vec(0, -1, 0));
        for (int i = 0; i < 5; ++i)
            scene.add(stair, 0, vec(2 + i, 0.1 + 0.2 * i, 0));
        // Along z, since the controller rotates the ghost from z up to y up.
        btCapsuleShapeZ capsule(btScalar(0.3), btScalar(1));
        btPairCachingGhostObject ghost;
        ghost.setWorldTransform(btTransform(btQuaternion::getIdentity(), vec(0, 1, 0)));
        ghost.setCollisionShape(&capsule);
        ghost.setCollisionFlags(btCollisionObject::CF_CHARACTER_OBJECT);
        scene.world.addCollisionObject(&ghost, btBroadphaseProxy::CharacterFilter,
                                       btBroadphaseProxy::StaticFilter | btBroadphaseProxy::DefaultFilter);
        btKinematicCharacterController character(&ghost, &capsule, btScalar(0.35), vec(0, 1, 0));
        scene.world.addAction(&character);
        for (int i = 0; i < 130; ++i)
        {
            character.setWalkDirection(vec(i < 30 ? 0 : 0.05, 0, 0));
            scene.step();
        }
        const btVector3 at = ghost.getWorldTransform().getOrigin();
        EXPECT_NEAR(double(at.x()), 5.0, 0.3) << "on the fourth stair";
        EXPECT_NEAR(double(at.y()), 0.8 + 0.8, 0.2);
        result = {double(at.x()), double(at.y()), double(at.z()), double(character.onGround())};
        scene.world.removeAction(&character);
        scene.world.removeCollisionObject(&ghost);
    }
    broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(nullptr);
    return result;
}

TEST(WorldsActors, MatchDbvtWhenCharacterClimbsStairs)
{
    expectAsWithDbvt(climbStairs, 1e-3);
}

/// Final position of a bullet of 10 cm that flies at 240 m/s towards a wall of 2 cm at x = 10.
double shoot(btBroadphaseInterface& broadphase, bool isContinuous)
{
    SmallWorld scene(broadphase);
    scene.world.setGravity(vec(0, 0, 0));
    scene.add(scene.shape<btBoxShape>(vec(0.01, 3, 3)), 0, vec(10, 0, 0));
    btRigidBody& bullet = scene.add(scene.shape<btSphereShape>(btScalar(0.05)), 1, vec(0.3, 0, 0));
    bullet.setLinearVelocity(vec(240, 0, 0));
    if (isContinuous)
    {
        bullet.setCcdMotionThreshold(btScalar(0.05));
        bullet.setCcdSweptSphereRadius(btScalar(0.04));
    }
    scene.step(20);
    return double(bullet.getWorldTransform().getOrigin().x());
}

TEST(WorldsActors, MatchDbvtWhenThinWallStopsProjectileWithCcd)
{
    Broadphase tunnel;
    EXPECT_GT(shoot(tunnel, false), 20.0) << "the wall stops it anyway: nothing is shown";
    Broadphase own;
    EXPECT_LT(shoot(own, true), 10.0);
    expectAsWithDbvt([](btBroadphaseInterface& broadphase) -> std::vector<double>
                     { return {shoot(broadphase, true)}; },
                     1e-3);
}

/// The first and the last step in which a zone reports a body that falls through it.
std::vector<double> fallThroughAZone(btBroadphaseInterface& broadphase)
{
    btGhostPairCallback ghostCallback;
    broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(&ghostCallback);
    double first = -1, last = -1;
    {
        SmallWorld scene(broadphase);
        btGhostObject zone;
        zone.setCollisionShape(&scene.shape<btBoxShape>(vec(2, 2, 2)));
        zone.setCollisionFlags(btCollisionObject::CF_NO_CONTACT_RESPONSE);
        scene.world.addCollisionObject(&zone, btBroadphaseProxy::SensorTrigger, btBroadphaseProxy::AllFilter);
        scene.add(scene.shape<btSphereShape>(btScalar(0.5)), 1, vec(0, 8, 0));
        int transitions = 0, before = 0;
        for (int i = 0; i < 180; ++i)
        {
            scene.step();
            const int now = zone.getNumOverlappingObjects();
            transitions += now != before ? 1 : 0;
            before = now;
            first = now > 0 && first < 0 ? i : first;
            last = now > 0 ? i : last;
        }
        EXPECT_EQ(transitions, 2) << "in once, out once";
        scene.world.removeCollisionObject(&zone);
    }
    broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(nullptr);
    return {first, last};
}

TEST(WorldsActors, MatchDbvtWhenGhostZoneReportsFallingBody)
{
    // Its box leaves DBVT's enlarged leaf a little later.
    expectAsWithDbvt(fallThroughAZone, 2.0);
}

/// Heights of a box whose group the application changes while it rests on a floor: before, after the change alone, and
/// after a refresh of its proxy.
std::vector<double> changeMaskAtRest(btBroadphaseInterface& broadphase)
{
    SmallWorld scene(broadphase);
    scene.add(scene.shape<btBoxShape>(vec(5, 1, 5)), 0, vec(0, -1, 0), 1, 2);
    btRigidBody& box = scene.add(scene.shape<btBoxShape>(vec(0.5, 0.5, 0.5)), 1, vec(0, 0.6, 0), 2, 1);
    box.setActivationState(DISABLE_DEACTIVATION);
    std::vector<double> heights;
    const auto remember = [&]
    {
        scene.step(30);
        heights.push_back(heightOf(box));
    };
    remember();
    box.getBroadphaseProxy()->m_collisionFilterGroup = 4;
    remember();
    EXPECT_NEAR(heights.back(), 0.5, 0.05) << "pairs that are there stay";
    scene.world.refreshBroadphaseProxy(&box);
    remember();
    EXPECT_LT(heights.back(), 0.0) << "it falls";
    box.getBroadphaseProxy()->m_collisionFilterGroup = 2;
    box.getWorldTransform().setOrigin(vec(0, 0.6, 0));
    box.setLinearVelocity(vec(0, 0, 0));
    remember();
    EXPECT_NEAR(heights.back(), 0.5, 0.05) << "the floor carries it again";
    return heights;
}

TEST(WorldsActors, MatchDbvtWhenFilterGroupOfRestingBodyChanges)
{
    expectAsWithDbvt(changeMaskAtRest, 1e-3);
}

/// Heights of a box at rest whose shape is replaced by a larger one and then scaled.
std::vector<double> changeShapeAtRest(btBroadphaseInterface& broadphase)
{
    SmallWorld scene(broadphase);
    scene.add(scene.shape<btBoxShape>(vec(5, 1, 5)), 0, vec(0, -1, 0));
    btRigidBody& box = scene.add(scene.shape<btBoxShape>(vec(0.5, 0.5, 0.5)), 1, vec(0, 0.6, 0));
    box.setActivationState(DISABLE_DEACTIVATION);
    std::vector<double> heights;
    const auto remember = [&]
    {
        broadphase.getOverlappingPairCache()->cleanProxyFromPairs(box.getBroadphaseProxy(),
                                                                  &scene.dispatcher);
        scene.step(90);
        heights.push_back(heightOf(box));
    };
    remember();
    box.setCollisionShape(&scene.shape<btSphereShape>(btScalar(0.8)));
    remember();
    EXPECT_NEAR(heights.back(), 0.8, 0.05);
    btBoxShape& scaled = scene.shape<btBoxShape>(vec(0.5, 0.5, 0.5));
    scaled.setLocalScaling(vec(2, 2, 2));
    box.setCollisionShape(&scaled);
    remember();
    EXPECT_NEAR(heights.back(), 1.0, 0.05);
    return heights;
}

TEST(WorldsActors, MatchDbvtWhenShapeOfRestingBodyIsReplaced)
{
    expectAsWithDbvt(changeShapeAtRest, 1e-2);
}
}  // namespace
}  // namespace cullet::test
