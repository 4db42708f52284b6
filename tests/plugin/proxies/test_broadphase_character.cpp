// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <BulletDynamics/Character/btKinematicCharacterController.h>
#include <btBulletDynamicsCommon.h>
#include <gtest/gtest.h>

#include <memory>

namespace cullet::test
{
namespace
{
/// Final position of a character of 1 m diameter that is warped near a wall and walks into it before the world has
/// stepped.
///
/// The wall's near side is at x = 15. The controller reads its ghost's pairs right after moving the ghost: with a broad
/// phase that finds pairs only in calculateOverlappingPairs() it passes through the wall.
double walkIntoAWall(btBroadphaseInterface& broadphase)
{
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    btSequentialImpulseConstraintSolver solver;
    btGhostPairCallback ghostCallback;
    broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(&ghostCallback);
    btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);

    btBoxShape wallShape(vec(1, 5, 5));
    btCollisionObject wall;
    wall.setCollisionShape(&wallShape);
    wall.getWorldTransform().setOrigin(vec(16, 0, 0));
    world.addCollisionObject(&wall, btBroadphaseProxy::StaticFilter, btBroadphaseProxy::AllFilter);

    btCapsuleShape capsule(btScalar(0.5), btScalar(1));
    btPairCachingGhostObject ghost;
    ghost.setWorldTransform(btTransform::getIdentity());
    ghost.setCollisionShape(&capsule);
    ghost.setCollisionFlags(btCollisionObject::CF_CHARACTER_OBJECT);
    world.addCollisionObject(&ghost, btBroadphaseProxy::CharacterFilter, btBroadphaseProxy::AllFilter);
    btKinematicCharacterController character(&ghost, &capsule, btScalar(0.35), vec(0, 1, 0));
    character.setGravity(vec(0, 0, 0));
    world.stepSimulation(btScalar(1) / 60, 0);

    character.warp(vec(14.2, 0, 0));
    for (int i = 0; i < 5; ++i)
    {
        character.setWalkDirection(vec(0.3, 0, 0));
        character.preStep(&world);
        character.playerStep(&world, btScalar(1) / 60);
    }
    const double x = ghost.getWorldTransform().getOrigin().x();
    world.removeCollisionObject(&ghost);
    world.removeCollisionObject(&wall);
    return x;
}

TEST(BroadphaseCharacter, StopsAtAWallWithoutAWorldStep)
{
    Broadphase broadphase;
    EXPECT_NEAR(walkIntoAWall(broadphase), 14.50, 0.01);
}

TEST(BroadphaseCharacter, StopsAtAWallWithBulletsHashedCacheToo)
{
    btHashedOverlappingPairCache cache;
    Broadphase broadphase(&cache);
    EXPECT_NEAR(walkIntoAWall(broadphase), 14.50, 0.01);
}

TEST(BroadphaseCharacter, StopsAtWallInDbvtUnlessItsPairsAreDeferred)
{
    btDbvtBroadphase stock;
    EXPECT_NEAR(walkIntoAWall(stock), 14.50, 0.01);
    btDbvtBroadphase deferred;
    deferred.m_deferedcollide = true;
    EXPECT_NEAR(walkIntoAWall(deferred), 15.70, 0.01);
}
}  // namespace
}  // namespace cullet::test
