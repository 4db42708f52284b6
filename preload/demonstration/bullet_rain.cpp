// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A program on Bullet alone, for times: balls and hulls that rain onto hilly ground. Prints the median time of a step.

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <btBulletDynamicsCommon.h>

#include "preload/demonstration/falling_things.h"
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <random>
#include <vector>

namespace
{
constexpr int kSide = 129;

std::vector<btScalar> hills()
{
    std::vector<btScalar> heights;
    for (int i = 0; i < kSide * kSide; ++i)
        heights.push_back(btScalar(std::sin(0.2 * (i % kSide)) + std::cos(0.2 * (i / kSide))));
    return heights;
}

void makeHull(btConvexHullShape& hull, std::mt19937& random)
{
    std::normal_distribution<btScalar> normal;
    for (int i = 0; i < 32; ++i)
        hull.addPoint(btVector3(normal(random), normal(random), normal(random)).normalized() * btScalar(0.4));
}
}  // namespace

int main(int count, char** arguments)
{
    const int bodyCount = count > 1 ? std::atoi(arguments[1]) : 4000;
    const int steps = count > 2 ? std::atoi(arguments[2]) : 60;
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
    world.setGravity(btVector3(0, -10, 0));

    std::mt19937 random(1);
    std::vector<btScalar> heights = hills();
    btHeightfieldTerrainShape terrain(kSide, kSide, heights.data(), 1, -2, 2, 1, PHY_FLOAT, false);
    btSphereShape ball(btScalar(0.4));
    btConvexHullShape hull;
    makeHull(hull, random);
    std::vector<std::unique_ptr<btRigidBody>> bodies;
    bodies.push_back(std::make_unique<btRigidBody>(btScalar(0), nullptr, &terrain));
    std::uniform_real_distribution<btScalar> across(-60, 60), up(3, 20);
    for (int i = 0; i < bodyCount; ++i)
    {
        btCollisionShape* shape = i % 2 ? static_cast<btCollisionShape*>(&hull) : &ball;
        btVector3 inertia;
        shape->calculateLocalInertia(1, inertia);
        bodies.push_back(std::make_unique<btRigidBody>(btScalar(1), nullptr, shape, inertia));
        const btVector3 at(across(random), up(random), across(random));
        bodies.back()->setWorldTransform(btTransform(btQuaternion::getIdentity(), at));
    }
    for (auto& body : bodies)
        world.addRigidBody(body.get());

    std::vector<double> times;
    for (int i = 0; i < steps; ++i)
    {
        const auto start = std::chrono::steady_clock::now();
        world.stepSimulation(btScalar(1) / 60, 0);
        times.push_back(
            std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
    }
    std::nth_element(times.begin(), times.begin() + steps / 2, times.end());
    std::printf("step %.2f ms\n", times[std::size_t(steps / 2)]);
    Result result;
    for (auto& body : bodies)
    {
        const btVector3 at = body->getWorldTransform().getOrigin();
        result.add(double(at.x()), double(at.y()), double(at.z()));
        world.removeRigidBody(body.get());
    }
    result.print();
}
