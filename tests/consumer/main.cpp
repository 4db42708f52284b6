// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Uses cullet like an application: compiles if the headers are found under their installed names, links if the
// libraries include their dependencies, and passes if a ball comes to rest on the ground of a world with cullet's
// classes.

#include <btBulletDynamicsCommon.h>

#include <cmath>
#include <cstdio>
#include <cullet/broad/backend.h>
#include <cullet/plugin/broadphase.h>
#include <cullet/plugin/convex_dispatcher.h>
#include <cullet/plugin/pair_cache/pair_cache.h>
#include <cullet/plugin/world.h>
#include <memory>
#include <string>

int main()
{
    btDefaultCollisionConfiguration configuration;
    cullet::Dispatcher dispatcher(&configuration);
    cullet::PairCache pairs;
    cullet::Broadphase broadphase(&pairs);
    btSequentialImpulseConstraintSolver solver;
    cullet::World<btDiscreteDynamicsWorld> world(&dispatcher, &broadphase, &solver, &configuration);

    btBoxShape groundShape(btVector3(10, 1, 10));
    btRigidBody ground(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, &groundShape));
    ground.translate(btVector3(0, -1, 0));
    btSphereShape ballShape(btScalar(0.5));
    btRigidBody ball(btRigidBody::btRigidBodyConstructionInfo(1, nullptr, &ballShape, btVector3(1, 1, 1)));
    ball.translate(btVector3(0, 3, 0));
    world.addRigidBody(&ground);
    world.addRigidBody(&ball);
    for (int step = 0; step < 300; ++step)
        world.stepSimulation(btScalar(1) / 60, 0);
    const double height = ball.getWorldTransform().getOrigin().y();
    world.removeRigidBody(&ball);
    world.removeRigidBody(&ground);

    std::string why = "a CUDA device answers";
    const std::unique_ptr<cullet::Backend> cuda = cullet::makeCudaPsapBackend({}, &why);
    std::printf("scalar of %zu bytes, ball at %g; CUDA: %s\n", sizeof(btScalar), height, why.c_str());
    // Bullet's default collision margin and its contact slop are a few hundredths.
    return std::abs(height - 0.5) < 0.05 ? 0 : 1;
}
