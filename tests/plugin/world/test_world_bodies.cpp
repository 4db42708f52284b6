// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Loops over bodies on several threads, island managers of the application, and what is read ahead.
#include "cullet/plugin/world.h"
#include "cullet/plugin/world_bodies.h"
#include "cullet/tests/plugin/world/step_stage.h"

#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>
#include <new>
#include <set>
#include <string>
#include <thread>
#include <vector>

namespace cullet::test
{
namespace
{
/// Balls that rest side by side on a floor, far enough from each other.
class BallsOnFloor
{
public:
    BallsOnFloor(btDiscreteDynamicsWorld& world, int balls) : m_world(world)
    {
        add(m_floor, 0, vec(0, -1, 0));
        for (int i = 0; i < balls; ++i)
            add(m_ball, 1, vec(2 * (i % 40) - 40, 0.499, 2 * (i / 40) - 40));
    }
    ~BallsOnFloor() { keep(0); }
    BallsOnFloor(const BallsOnFloor&) = delete;
    BallsOnFloor& operator=(const BallsOnFloor&) = delete;

    void keep(std::size_t count)
    {
        for (; m_bodies.size() > count; m_bodies.pop_back())
            m_world.removeRigidBody(m_bodies.back().get());
    }
    void step(int count)
    {
        for (int i = 0; i < count; ++i)
            m_world.stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
    }

private:
    void add(btCollisionShape& shape, double mass, const btVector3& at)
    {
        btRigidBody::btRigidBodyConstructionInfo info(btScalar(mass), nullptr, &shape, vec(mass, mass, mass));
        info.m_startWorldTransform = btTransform(btQuaternion::getIdentity(), at);
        m_bodies.push_back(std::make_unique<btRigidBody>(info));
        m_world.addRigidBody(m_bodies.back().get());
    }

    btDiscreteDynamicsWorld& m_world;
    btBoxShape m_floor{vec(100, 1, 100)};
    btSphereShape m_ball{btScalar(0.5)};
    std::vector<std::unique_ptr<btRigidBody>> m_bodies;
};

/// Where the first two threads wait for each other.
class Meeting
{
public:
    void attend()
    {
        std::unique_lock<std::mutex> lock(m_mutex);
        m_threads.insert(std::this_thread::get_id());
        m_arrival.notify_all();
        const auto haveMet = [this] { return m_threads.size() > 1 || m_isAlone; };
        m_isAlone = !m_arrival.wait_for(lock, std::chrono::seconds(20), haveMet) || m_isAlone;
    }
    std::size_t threads() const { return m_threads.size(); }

private:
    std::mutex m_mutex;
    std::condition_variable m_arrival;
    std::set<std::thread::id> m_threads;
    bool m_isAlone = false;
};

TEST(WorldBodies, AreMovedByTwoThreadsTogetherInEveryStep)
{
    btSphereShape ball(btScalar(0.5));
    std::vector<std::unique_ptr<btRigidBody>> bodies;
    btAlignedObjectArray<btRigidBody*> list;
    for (int i = 0; i < 1500; ++i)
    {
        bodies.push_back(std::make_unique<btRigidBody>(btScalar(1), nullptr, &ball));
        list.push_back(bodies.back().get());
    }
    WorldBodies loops;
    int before = 0;
    for (const int threads : {2, 2, 1})
    {
        if (threads != before)
            loops.setThreads(threads);
        before = threads;
        std::atomic<int> moved{0};
        Meeting meeting;
        const auto move = [&](btRigidBody**, int count)
        {
            if (threads > 1)
                meeting.attend();
            moved += count;
        };
        loops.integrate(list, WorldBodies::RangeFunction(move));
        EXPECT_EQ(moved, 1500);
        EXPECT_EQ(meeting.threads(), threads == 1 ? 0u : 2u);
        EXPECT_EQ(loops.stats().parallelBodies, threads == 1 ? 0u : 1500u);
    }
}

/// Spoils the spare memory behind the lists of manifolds and islands before each solve.
class SpoilingWorld : public World<btDiscreteDynamicsWorld>
{
public:
    using World<btDiscreteDynamicsWorld>::World;
    void solveConstraints(btContactSolverInfo& info) override
    {
        // Both lists keep their memory when they shrink.
        const int manifolds = getDispatcher()->getNumManifolds();
        m_mostManifolds = std::max(m_mostManifolds, manifolds);
        for (int i = manifolds; i < m_mostManifolds; ++i, ++spoilt)
            getDispatcher()->getInternalManifoldPointer()[i] = reinterpret_cast<btPersistentManifold*>(16);
        btUnionFind& elements = getSimulationIslandManager()->getUnionFind();
        m_mostElements = std::max(m_mostElements, elements.getNumElements());
        for (int i = elements.getNumElements(); i < m_mostElements; ++i, ++spoilt)
            (&elements.getElement(0))[i].m_sz = 1 << 30;
        World::solveConstraints(info);
    }
    int spoilt = 0;

private:
    int m_mostManifolds = 0, m_mostElements = 0;
};

TEST(WorldIslands, FollowNoPointerBehindTheLastManifoldOrElement)
{
    Stage<SpoilingWorld> stage;
    BallsOnFloor balls(stage.world, 200);
    balls.step(3);
    EXPECT_EQ(stage.dispatcher.getNumManifolds(), 200);
    balls.keep(101);
    balls.step(3);
    EXPECT_EQ(stage.dispatcher.getNumManifolds(), 100);
    EXPECT_EQ(stage.world.islandStats().groups > 0, true);
    EXPECT_EQ(stage.world.spoilt, 3 * (100 + 100));
}

/// An island manager of the application.
class OwnManager : public btSimulationIslandManager
{
public:
    void updateActivationState(btCollisionWorld* world, btDispatcher* dispatcher) override
    {
        ++updates;
        btSimulationIslandManager::updateActivationState(world, dispatcher);
    }
    int updates = 0;
};

template <class Base>
class ManagedWorld : public Base
{
public:
    using Base::Base;
    OwnManager& useOwnManager()
    {
        this->m_islandManager->~btSimulationIslandManager();
        btAlignedFree(this->m_islandManager);
        auto* const own = new (btAlignedAlloc(sizeof(OwnManager), 16)) OwnManager;
        this->m_islandManager = own;
        return *own;
    }
};

TEST(WorldIslands, AreThoseOfAnIslandManagerOfTheApplication)
{
    int steps = 0;
    for (const char* const name : {"ManyPiles", "Ragdolls"})
    {
        Stage<ManagedWorld<btDiscreteDynamicsWorld>> bullet;
        Stage<ManagedWorld<World<btDiscreteDynamicsWorld>>> own;
        const OwnManager &inBulletUpdated = bullet.world.useOwnManager(),
                         &inOwnUpdated = own.world.useOwnManager();
        for (const NamedScene& scene : allScenes())
        {
            if (scene.name != std::string(name))
                continue;
            const auto inBullet = scene.make(bullet.world), inOwn = scene.make(own.world);
            for (int step = 0; step < 60; ++step, ++steps)
            {
                inBullet->step(step);
                inOwn->step(step);
                ASSERT_EQ(inOwn->hash(), inBullet->hash()) << name << " " << step;
            }
        }
        EXPECT_EQ(inOwnUpdated.updates, 60);
        EXPECT_EQ(inBulletUpdated.updates, 60);
    }
    EXPECT_EQ(steps, 120);
}
}  // namespace
}  // namespace cullet::test
