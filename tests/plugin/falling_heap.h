// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/plugin/body_hash.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <BulletCollision/CollisionDispatch/btCollisionDispatcherMt.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolverMt.h>
#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorldMt.h>
#include <BulletDynamics/Dynamics/btSimpleDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <LinearMath/btThreads.h>
#include <btBulletDynamicsCommon.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace cullet::test
{
/// Sixty boxes that fall into a heap on a plane.
class Heap
{
public:
    Heap(btDynamicsWorld& world, bool withOnePile = false) : m_world(world)
    {
        add(&m_plane, 0, vec(0, 0, 0));
        for (int i = 0; i < (withOnePile ? 5 : 60); ++i)
            add(&m_box, 1,
                withOnePile
                    ? vec(0, 0.5 + i, 0)
                    : vec(1.04 * (i % 4) + 0.07 * (i / 16), 0.6 + 1.1 * (i / 16), 1.04 * (i / 4 % 4)));
    }
    ~Heap()
    {
        for (auto& body : bodies)
            m_world.removeRigidBody(body.get());
    }
    Heap(const Heap&) = delete;
    Heap& operator=(const Heap&) = delete;

    void add(btCollisionShape* shape, double mass, const btVector3& at)
    {
        btVector3 inertia(0, 0, 0);
        if (mass > 0)
            shape->calculateLocalInertia(btScalar(mass), inertia);
        bodies.push_back(std::make_unique<btRigidBody>(btScalar(mass), nullptr, shape, inertia));
        bodies.back()->setWorldTransform(btTransform(btQuaternion::getIdentity(), at));
        bodies.back()->setInterpolationWorldTransform(bodies.back()->getWorldTransform());
        m_world.addRigidBody(bodies.back().get());
    }
    void step(int count)
    {
        for (int i = 0; i < count; ++i)
            m_world.stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
    }
    /// Mean height of the boxes; all must be above the plane.
    double meanHeight() const
    {
        double sum = 0;
        for (std::size_t i = 1; i < bodies.size(); ++i)
        {
            const double height = bodies[i]->getWorldTransform().getOrigin().y();
            EXPECT_GT(height, 0.3) << "fell through the plane";
            sum += height;
        }
        return sum / double(bodies.size() - 1);
    }
    /// Fingerprint of all transforms, bit by bit.
    std::uint64_t hash() const { return hashOfBodies(bodies); }

    std::vector<std::unique_ptr<btRigidBody>> bodies;

private:
    btDynamicsWorld& m_world;
    btStaticPlaneShape m_plane{vec(0, 1, 0), 0};
    btBoxShape m_box{vec(0.5, 0.5, 0.5)};
};

/// The objects that every world needs besides a broad phase.
struct Stage
{
    explicit Stage(std::unique_ptr<btBroadphaseInterface> made) : broadphase(std::move(made)) {}
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    std::unique_ptr<btBroadphaseInterface> broadphase;
};

struct DiscreteWorld : Stage
{
    using Stage::Stage;
    btSequentialImpulseConstraintSolver solver;
    btDiscreteDynamicsWorld world{&dispatcher, broadphase.get(), &solver, &configuration};
};
struct SimpleWorld : Stage
{
    using Stage::Stage;
    btSequentialImpulseConstraintSolver solver;
    btSimpleDynamicsWorld world{&dispatcher, broadphase.get(), &solver, &configuration};
};
struct MultiBodyWorld : Stage
{
    using Stage::Stage;
    btMultiBodyConstraintSolver solver;
    btMultiBodyDynamicsWorld world{&dispatcher, broadphase.get(), &solver, &configuration};
};
struct MtWorld
{
    explicit MtWorld(std::unique_ptr<btBroadphaseInterface> made) : broadphase(std::move(made)) {}
    struct Scheduler
    {
        Scheduler() { btSetTaskScheduler(btGetSequentialTaskScheduler()); }
    } scheduler;
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcherMt dispatcher{&configuration};
    btConstraintSolverPoolMt pool{1};
    btSequentialImpulseConstraintSolverMt solver;
    std::unique_ptr<btBroadphaseInterface> broadphase;
    btDiscreteDynamicsWorldMt world{&dispatcher, broadphase.get(), &pool, &solver, &configuration};
};
}  // namespace cullet::test
