// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// A program without cullet that makes worlds of Bullet's classes. The arguments select which and how, and the number of
// boxes.

#include "cullet/tests/plugin/body_hash.h"
#include "cullet/tests/preload/plain_bodies.h"
#include "cullet/tests/preload/repeated.h"

#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorldMt.h>
#include <BulletDynamics/Dynamics/btSimpleDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <LinearMath/btThreads.h>
#include <btBulletDynamicsCommon.h>

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <typeinfo>

namespace cullet::test
{
namespace
{
/// What all worlds need.
struct Parts
{
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    btDbvtBroadphase broadphase;
    btMultiBodyConstraintSolver solver;
    btSequentialImpulseConstraintSolver plainSolver;
};

/// A class of the program with a member and a function of its own.
class DerivedWorld : public btDiscreteDynamicsWorld
{
public:
    explicit DerivedWorld(Parts& parts)
        : btDiscreteDynamicsWorld(&parts.dispatcher, &parts.broadphase, &parts.plainSolver,
                                  &parts.configuration)
    {
    }
    void updateActivationState(btScalar timeStep) override
    {
        ++m_steps;
        btDiscreteDynamicsWorld::updateActivationState(timeStep);
    }
    int steps() const { return m_steps; }

private:
    int m_steps = 0;
};

/// Towers of two boxes on a plane, enough for several threads.
class Towers
{
public:
    explicit Towers(btDynamicsWorld& world, int count) : m_world(world)
    {
        world.setGravity(btVector3(0, -10, 0));
        addPlainBody(m_world, m_bodies, m_ground, 0, btVector3(0, 0, 0));
        for (int i = 0; i < count; ++i)
            addPlainBody(m_world, m_bodies, m_box, 1,
                         btVector3(btScalar(2 * (i / 2 % 40)), btScalar(0.75 + 1.25 * (i % 2)),
                                   btScalar(2 * (i / 80))));
    }
    ~Towers()
    {
        for (auto& body : m_bodies)
            m_world.removeCollisionObject(body.get());
    }
    Towers(const Towers&) = delete;
    Towers& operator=(const Towers&) = delete;

    void run()
    {
        for (int i = 0; i < 40; ++i)
            m_world.stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
        std::printf("hash %016llx\n", static_cast<unsigned long long>(hashOfBodies(m_bodies)));
        std::printf("type %s\n", typeid(m_world).name());
        std::printf("discrete %d\n", dynamic_cast<btDiscreteDynamicsWorld*>(&m_world) != nullptr);
        std::fflush(stdout);
    }

private:
    btDynamicsWorld& m_world;
    btStaticPlaneShape m_ground{btVector3(0, 1, 0), 0};
    btBoxShape m_box{btVector3(btScalar(0.5), btScalar(0.5), btScalar(0.5))};
    PlainBodies m_bodies;
};

int g_boxes = 600;

void runTowers(btDynamicsWorld& world)
{
    Towers(world, g_boxes).run();
}

template <class World, class Solver>
void runNew(Solver Parts::*solver)
{
    Parts parts;
    const std::unique_ptr<btDynamicsWorld> world(
        new World(&parts.dispatcher, &parts.broadphase, &(parts.*solver), &parts.configuration));
    runTowers(*world);
}

void runOnStack()
{
    Parts parts;
    btDiscreteDynamicsWorld world(&parts.dispatcher, &parts.broadphase, &parts.plainSolver,
                                  &parts.configuration);
    runTowers(world);
}

void runDerived()
{
    Parts parts;
    const auto world = std::make_unique<DerivedWorld>(parts);
    runTowers(*world);
    std::printf("steps %d\n", world->steps());
}

void runMt()
{
    btSetTaskScheduler(btGetSequentialTaskScheduler());
    Parts parts;
    btConstraintSolverPoolMt pool(1);
    btDiscreteDynamicsWorldMt world(&parts.dispatcher, &parts.broadphase, &pool, nullptr,
                                    &parts.configuration);
    runTowers(world);
}

/// Makes and destroys worlds, and prints the bytes in use that are left of half of them.
void runMany()
{
    const auto makeSome = []
    {
        for (int i = 0; i < 50; ++i)
        {
            Parts parts;
            const std::unique_ptr<btDynamicsWorld> world(new btDiscreteDynamicsWorld(
                &parts.dispatcher, &parts.broadphase, &parts.plainSolver, &parts.configuration));
            world->stepSimulation(1);
        }
    };
    printBytesLeft(makeSome);
}
}  // namespace
}  // namespace cullet::test

int main(int count, char** arguments)
{
    using namespace cullet::test;
    const std::string kind = arguments[1];
    if (count > 2)
        g_boxes = std::atoi(arguments[2]);
    if (kind == "heap")
        runNew<btDiscreteDynamicsWorld>(&Parts::plainSolver);
    else if (kind == "stack")
        runOnStack();
    else if (kind == "simple")
        runNew<btSimpleDynamicsWorld>(&Parts::plainSolver);
    else if (kind == "multi-body")
        runNew<btMultiBodyDynamicsWorld>(&Parts::solver);
    else if (kind == "derived")
        runDerived();
    else if (kind == "mt")
        runMt();
    else if (kind == "many")
        runMany();
    else if (kind == "threads")
        runInFourThreads(runOnStack);
}
