// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/broadphase.h"
#include "cullet/plugin/convex_dispatcher.h"
#include "cullet/plugin/world.h"
#include "cullet/tests/plugin/convex/convex_world.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <future>
#include <memory>
#include <thread>
#include <vector>

namespace cullet::test
{
namespace
{
/// All parts of cullet on a number of threads, and hulls that drift past each other.
class DriftingWorld
{
public:
    /// @param edge hulls along each axis
    DriftingWorld(int threads, int edge)
        : m_hull(makeHullShape(boxPoints(0.5, 0.5, 0.5))),
          m_broadphase(broadphaseOptions(threads)),
          m_dispatcher(&m_configuration, dispatcherOptions(threads)),
          m_world(&m_dispatcher, &m_broadphase, &m_solver, &m_configuration)
    {
        m_world.setUpdateThreads(threads);
        m_world.setGravity(vec(0, 0, 0));
        for (int i = 0; i < edge * edge * edge; ++i)
        {
            m_bodies.push_back(
                std::make_unique<btRigidBody>(btScalar(1), nullptr, m_hull.get(), vec(1, 1, 1)));
            btRigidBody& body = *m_bodies.back();
            const btVector3 at = vec(i % edge, i / edge % edge, i / (edge * edge));
            body.setWorldTransform(btTransform(btQuaternion::getIdentity(), at * btScalar(1.08)));
            body.setLinearVelocity(vec(0.1 * (i % 7), 0.1 * (i % 5), 0));
            m_world.addRigidBody(&body);
        }
    }
    ~DriftingWorld()
    {
        for (const auto& body : m_bodies)
            m_world.removeRigidBody(body.get());
    }

    void step(int count)
    {
        for (int i = 0; i < count; ++i)
            m_world.stepSimulation(btScalar(1) / 60, 0, btScalar(1) / 60);
    }
    std::uint64_t idlePairs() const { return m_dispatcher.idlePairs(); }

private:
    static BroadphaseOptions broadphaseOptions(int threads)
    {
        BroadphaseOptions options;
        options.threads = options.grid.threads = threads;
        return options;
    }
    static DispatcherOptions dispatcherOptions(int threads)
    {
        DispatcherOptions options;
        options.threads = threads;
        return options;
    }

    std::unique_ptr<btConvexHullShape> m_hull;
    btDefaultCollisionConfiguration m_configuration;
    Broadphase m_broadphase;
    Dispatcher m_dispatcher;
    btSequentialImpulseConstraintSolver m_solver;
    World<btDiscreteDynamicsWorld> m_world;
    std::vector<std::unique_ptr<btRigidBody>> m_bodies;
};

#if defined(__linux__)
std::size_t threadsOfThisProcess()
{
    const std::filesystem::directory_iterator tasks("/proc/self/task");
    return static_cast<std::size_t>(std::distance(begin(tasks), end(tasks)));
}

/// A sanitizer starts its own thread with the first thread of a program.
class FirstThread
{
public:
    FirstThread() : m_thread([this] { m_isOver.get_future().wait(); }) {}
    ~FirstThread()
    {
        m_isOver.set_value();
        m_thread.join();
    }
    FirstThread(const FirstThread&) = delete;
    FirstThread& operator=(const FirstThread&) = delete;

private:
    std::promise<void> m_isOver;
    std::thread m_thread;
};

// A step of sixty bodies ends before a thread would join.
TEST(ThreadCounts, RiseForLargeWorldsOnly)
{
    const FirstThread first;
    const std::size_t before = threadsOfThisProcess();
    DriftingWorld small(8, 4);
    small.step(4);
    EXPECT_GT(small.idlePairs(), 100u);
    EXPECT_EQ(threadsOfThisProcess(), before);
    DriftingWorld large(2, 14);
    large.step(4);
    EXPECT_GT(large.idlePairs(), 8000u);
    EXPECT_EQ(threadsOfThisProcess(), before + (std::thread::hardware_concurrency() > 1 ? 1 : 0));
}

TEST(ThreadCounts, FollowBroadphaseOptionsRatherThanThoseOfGrid)
{
    const FirstThread first;
    const std::size_t before = threadsOfThisProcess();
    for (const int threads : {1, 2})
    {
        BroadphaseOptions options;
        options.backend = BackendChoice::Grid;
        options.threads = threads;
        options.grid.threads = 3 - threads;
        Broadphase broadphase(options);
        std::vector<btBroadphaseProxy*> proxies;
        const btVector3 half = vec(0.5, 0.5, 0.5);
        for (int i = 0; i < 20000; ++i)
        {
            const btVector3 at = vec(i % 30, i / 30 % 30, i / 900);
            proxies.push_back(broadphase.createProxy(at - half, at + half, 0, nullptr, 1, -1, nullptr));
        }
        for (int update = 0; update < 3; ++update)
        {
            for (btBroadphaseProxy* proxy : proxies)
                broadphase.setAabb(proxy, proxy->m_aabbMin + vec(0.01, 0, 0),
                                   proxy->m_aabbMax + vec(0.01, 0, 0), nullptr);
            broadphase.calculateOverlappingPairs(nullptr);
        }
        const bool hasThread = threads == 2 && std::thread::hardware_concurrency() > 1;
        EXPECT_EQ(threadsOfThisProcess(), before + (hasThread ? 1 : 0)) << threads << " threads";
    }
}
#endif

// A request for more threads than cores prints nothing to the application's streams.
TEST(ThreadCountsDeathTest, PrintNoWarningWhenTheyExceedCores)
{
    testing::FLAGS_gtest_death_test_style = "threadsafe";
    for (const int threads : {3, 64, 4096})
    {
        EXPECT_EXIT(
            {
                {
                    DriftingWorld world(threads, 12);
                    world.step(3);
                }
                std::exit(0);
            },
            testing::ExitedWithCode(0), "^$")
            << threads;
    }
}
}  // namespace
}  // namespace cullet::test
