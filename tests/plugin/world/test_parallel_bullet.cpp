// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Bullet's own multithreaded world on cullet. Such a world has threads only in a Bullet that was compiled with BT_THREADSAFE, which
// Debian's is not: `.ci/run bullet` compiles one.
#include "cullet/plugin/convex_dispatcher.h"
#include "cullet/tests/plugin/body_hash.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"

#include <BulletCollision/CollisionDispatch/btCollisionDispatcherMt.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolverMt.h>
#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorldMt.h>
#include <LinearMath/btThreads.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#if BT_THREADSAFE
namespace cullet::test
{
namespace
{
/// Bullet has one scheduler per process, which a thread may not outlive.
btITaskScheduler& scheduler()
{
    static btITaskScheduler* const made = btCreateDefaultTaskScheduler();
    return *made;
}

/// 1, 2 and as many as the machine has.
std::vector<int> threadCounts()
{
    std::vector<int> counts = {1};
    const int most = scheduler().getMaxNumThreads();
    for (const int count : {2, most})
    {
        if (count > counts.back() && count <= most)
            counts.push_back(count);
    }
    return counts;
}

/// The numbers of two bodies, and the bits of their contact points.
using Contacts = std::map<std::pair<int, int>, std::vector<std::uint64_t>>;

enum class Dispatching
{
    BulletsParallel,
    Cullets
};

/// A block of boxes and balls in nine layers on a plane, with towers that stand apart: one island for the solver of large
/// islands, and small ones.
class ParallelWorld
{
public:
    ParallelWorld(Dispatching dispatching, int threads)
    {
        btSetTaskScheduler(&scheduler());
        scheduler().setNumThreads(threads);
        if (dispatching == Dispatching::Cullets)
        {
            DispatcherOptions options;
            options.threads = threads;
            m_dispatcher = std::make_unique<Dispatcher>(&m_configuration, options);
        }
        else
        {
            m_dispatcher = std::make_unique<btCollisionDispatcherMt>(&m_configuration);
        }
        world = std::make_unique<btDiscreteDynamicsWorldMt>(m_dispatcher.get(), &broadphase, &m_pool,
                                                            &m_solver, &m_configuration);
        add(&m_plane, 0, vec(0, 0, 0));
        for (int i = 0; i < 6 * 6 * 9; ++i)
            add(i % 5 == 0 ? static_cast<btCollisionShape*>(&m_ball) : &m_box, 1,
                vec(1.02 * (i % 6) + 0.03 * (i / 36), 0.5 + 1.02 * (i / 36), 1.02 * (i / 6 % 6)));
        for (int i = 0; i < 20 * 3; ++i)
            add(&m_box, 1, vec(20 + 3 * (i % 20), 0.5 + 1.02 * (i / 20), 0));
    }
    ~ParallelWorld()
    {
        for (auto& body : bodies)
            world->removeRigidBody(body.get());
        btSetTaskScheduler(btGetSequentialTaskScheduler());
    }
    ParallelWorld(const ParallelWorld&) = delete;
    ParallelWorld& operator=(const ParallelWorld&) = delete;

    /// Lets the layers of the block slide over each other, without a solver, and finds pairs and contacts.
    void slide(int step)
    {
        for (std::size_t i = 1; i < bodies.size(); ++i)
        {
            const double phase = 0.3 * step + double(i / 36);
            btVector3 at = m_start[i];
            at += vec(0.9 * std::sin(phase), -0.03, 0.9 * std::cos(phase));
            bodies[i]->getWorldTransform().setOrigin(at);
        }
        world->performDiscreteCollisionDetection();
    }

    void step() { world->stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60); }

    /// Bits of all contacts, by the numbers of the bodies: the order of Bullet's parallel dispatcher is that of its threads.
    Contacts contacts() const
    {
        Contacts found;
        for (int i = 0; i < m_dispatcher->getNumManifolds(); ++i)
        {
            const btPersistentManifold& manifold = *m_dispatcher->getManifoldByIndexInternal(i);
            auto& bits = found[{manifold.getBody0()->getUserIndex(), manifold.getBody1()->getUserIndex()}];
            for (int p = 0; p < manifold.getNumContacts(); ++p)
            {
                const btManifoldPoint& point = manifold.getContactPoint(p);
                for (int axis = 0; axis < 3; ++axis)
                {
                    bits.push_back(bitsOf(point.m_positionWorldOnB[axis]));
                    bits.push_back(bitsOf(point.m_normalWorldOnB[axis]));
                }
                bits.push_back(bitsOf(point.getDistance()));
            }
        }
        return found;
    }

    Broadphase broadphase;
    std::unique_ptr<btDiscreteDynamicsWorldMt> world;
    std::vector<std::unique_ptr<btRigidBody>> bodies;

private:
    static std::uint64_t bitsOf(btScalar value)
    {
        std::uint64_t bits = 0;
        std::memcpy(&bits, &value, sizeof(value));
        return bits;
    }

    void add(btCollisionShape* shape, double mass, const btVector3& at)
    {
        btVector3 inertia(0, 0, 0);
        if (mass > 0)
            shape->calculateLocalInertia(btScalar(mass), inertia);
        bodies.push_back(std::make_unique<btRigidBody>(btScalar(mass), nullptr, shape, inertia));
        btRigidBody& body = *bodies.back();
        body.setUserIndex(int(m_start.size()));
        body.setWorldTransform(btTransform(btQuaternion::getIdentity(), at));
        body.setInterpolationWorldTransform(body.getWorldTransform());
        m_start.push_back(at);
        world->addRigidBody(&body);
    }

    btDefaultCollisionConfiguration m_configuration;
    std::unique_ptr<btCollisionDispatcher> m_dispatcher;
    btConstraintSolverPoolMt m_pool{int(BT_MAX_THREAD_COUNT)};
    btSequentialImpulseConstraintSolverMt m_solver;
    std::vector<btVector3> m_start;
    btStaticPlaneShape m_plane{vec(0, 1, 0), 0};
    btBoxShape m_box{vec(0.5, 0.5, 0.5)};
    btSphereShape m_ball{btScalar(0.5)};
};

/// What a step of detection finds.
struct Found
{
    Pairs pairs;
    Contacts contacts;
};

std::vector<Found> findingsOn(int threads)
{
    ParallelWorld world(Dispatching::BulletsParallel, threads);
    std::vector<Found> findings;
    for (int step = 0; step < 20; ++step)
    {
        world.slide(step);
        findings.push_back({pairsOf(world.broadphase), world.contacts()});
    }
    return findings;
}

TEST(ParallelBullet, FindsSamePairsAndContactsWithItsDispatcherOnAnyNumberOfThreads)
{
    const std::vector<int> counts = threadCounts();
    ASSERT_GT(counts.size(), 1u) << "one core: nothing to compare";
    const std::vector<Found> expected = findingsOn(1);
    std::size_t changes = 0;
    for (std::size_t step = 1; step < expected.size(); ++step)
    {
        changes += expected[step].pairs != expected[step - 1].pairs;
        EXPECT_GT(expected[step].contacts.size(), 600u);
    }
    EXPECT_GT(changes, expected.size() / 2);
    for (const int threads : counts)
    {
        const std::vector<Found> findings = findingsOn(threads);
        for (std::size_t step = 0; step < expected.size(); ++step)
        {
            SCOPED_TRACE(std::to_string(threads) + " threads, step " + std::to_string(step));
            ASSERT_EQ(findings[step].pairs, expected[step].pairs);
            ASSERT_TRUE(findings[step].contacts == expected[step].contacts);
        }
    }
}

std::vector<std::uint64_t> transformsOn(int threads)
{
    ParallelWorld world(Dispatching::Cullets, threads);
    std::vector<std::uint64_t> hashes;
    for (int step = 0; step < 60; ++step)
    {
        world.step();
        hashes.push_back(hashOfBodies(world.bodies));
    }
    EXPECT_GT(world.contacts().size(), 600u);
    return hashes;
}

TEST(ParallelBullet, MovesBodiesAlikeWithCulletsDispatcherOnAnyNumberOfThreads)
{
    const std::vector<int> counts = threadCounts();
    ASSERT_GT(counts.size(), 1u) << "one core: nothing to compare";
    const std::vector<std::uint64_t> expected = transformsOn(1);
    EXPECT_NE(expected.front(), expected.back());
    for (const int threads : counts)
        EXPECT_EQ(transformsOn(threads), expected) << threads << " threads";
}
}  // namespace
}  // namespace cullet::test
#endif
