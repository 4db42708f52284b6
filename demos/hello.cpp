// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A Bullet program with cullet: a pile of boxes falls on a plane. Against stock Bullet two lines differ, marked with
// (*).

#include "cullet/plugin/broadphase.h"  // (*) <cullet/plugin/broadphase.h> outside of this source tree

#include <btBulletDynamicsCommon.h>

#include <cstdio>
#include <memory>
#include <vector>

int main()
{
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    cullet::Broadphase broadphase;  // (*) was btDbvtBroadphase: a GPU when one answers, else the CPU
    btSequentialImpulseConstraintSolver solver;
    btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);

    btStaticPlaneShape ground(btVector3(0, 1, 0), 0);
    btRigidBody::btRigidBodyConstructionInfo groundInfo(0, nullptr, &ground);
    btRigidBody groundBody(groundInfo);
    world.addRigidBody(&groundBody);

    btBoxShape box(btVector3(0.5, 0.5, 0.5));
    btVector3 inertia;
    box.calculateLocalInertia(1, inertia);
    std::vector<std::unique_ptr<btRigidBody>> bodies;
    for (int i = 0; i < 1000; ++i)
    {
        btRigidBody::btRigidBodyConstructionInfo info(1, nullptr, &box, inertia);
        const int column = i % 10;
        const int row = i / 10 % 10;
        const int layer = i / 100;
        info.m_startWorldTransform.setOrigin(
            btVector3(btScalar(1.1 * column), btScalar(1 + 1.1 * layer), btScalar(1.1 * row)));
        bodies.push_back(std::make_unique<btRigidBody>(info));
        world.addRigidBody(bodies.back().get());
    }

    for (int step = 0; step < 120; ++step)
        world.stepSimulation(btScalar(1.0 / 60.0), 0);

    btScalar lowest = BT_LARGE_FLOAT;
    for (const auto& body : bodies)
        lowest = btMin(lowest, body->getWorldTransform().getOrigin().y());
    std::printf("after 2 s: %d pairs, %d manifolds, lowest centre %.3f m above the ground\n",
                world.getPairCache()->getNumOverlappingPairs(), dispatcher.getNumManifolds(),
                static_cast<double>(lowest));

    for (const auto& body : bodies)
        world.removeRigidBody(body.get());
    world.removeRigidBody(&groundBody);
    return lowest > btScalar(0.3) ? 0 : 1;
}
