// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/broadphase/exact_oracle.h"
#include "cullet/tests/support/random.h"
#include "cullet/tests/support/threads.h"

#include <btBulletCollisionCommon.h>
#include <gtest/gtest.h>

#include <atomic>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr int kThreads = 8;

std::vector<btBroadphaseProxy*> addRow(btBroadphaseInterface& broadphase, int count)
{
    std::vector<btBroadphaseProxy*> proxies;
    for (int i = 0; i < count; ++i)
        proxies.push_back(addCube(broadphase, vec(2 * i, 0, 0)));
    return proxies;
}

TEST(BroadphaseThreads, RunQueriesConcurrentlyWithPendingUpdates)
{
    Broadphase broadphase(bruteOptions());
    const std::vector<btBroadphaseProxy*> proxies = addRow(broadphase, 500);
    for (int round = 0; round < 20; ++round)
    {
        for (std::size_t i = 0; i < proxies.size(); i += 3)
            moveCube(broadphase, proxies[i], vec(2.0 * double(i), 0.01 * round, 0));
        std::atomic<int> wrongCount{0};
        onThreads(kThreads,
                  [&](int thread)
                  {
                      for (int i = 0; i < 30; ++i)
                      {
                          const int at = (thread * 61 + i * 7) % 500;
                          const btVector3 centre = vec(2 * at, 0, 0);
                          const Ids expected = {std::uint32_t(at + 1)};
                          wrongCount +=
                              rayHits(broadphase, centre - vec(0, 9, 0), centre + vec(0, 9, 0)) != expected;
                          wrongCount += boxHits(broadphase, centre, centre + vec(0.1, 0.1, 0.1)) != expected;
                          wrongCount += rayHits(broadphase, vec(-9, 0.2, 0), vec(9999, 0.2, 0)).size() != 500;
                      }
                  });
        ASSERT_EQ(wrongCount, 0);
    }
}

TEST(BroadphaseThreads, RunConvexSweepsOfOneWorldConcurrently)
{
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    Broadphase broadphase;
    btCollisionWorld world(&dispatcher, &broadphase, &configuration);
    btBoxShape shape(vec(0.5, 0.5, 0.5));
    std::vector<std::unique_ptr<btCollisionObject>> objects;
    for (int i = 0; i < 100; ++i)
    {
        objects.push_back(std::make_unique<btCollisionObject>());
        objects.back()->setCollisionShape(&shape);
        objects.back()->getWorldTransform().setOrigin(vec(3 * i, 0, 0));
        world.addCollisionObject(objects.back().get());
    }
    std::atomic<int> wrongCount{0};
    onThreads(kThreads,
              [&](int thread)
              {
                  for (int i = thread; i < 100; i += kThreads)
                  {
                      btTransform from = btTransform::getIdentity();
                      btTransform to = from;
                      from.setOrigin(vec(3 * i, 5, 0));
                      to.setOrigin(vec(3 * i, -5, 0));
                      btSphereShape ball(btScalar(0.25));
                      btCollisionWorld::ClosestConvexResultCallback result(from.getOrigin(), to.getOrigin());
                      world.convexSweepTest(&ball, from, to, result);
                      wrongCount += result.m_hitCollisionObject != objects[std::size_t(i)].get();
                  }
              });
    EXPECT_EQ(wrongCount, 0);
    for (auto& object : objects)
        world.removeCollisionObject(object.get());
}

TEST(BroadphaseThreads, SetAabbsOfDifferentProxiesConcurrently)
{
    Broadphase broadphase(bruteOptions());
    const std::vector<btBroadphaseProxy*> proxies = addRow(broadphase, 2000);
    broadphase.calculateOverlappingPairs(nullptr);
    for (int round = 1; round < 10; ++round)
    {
        onThreads(kThreads,
                  [&](int thread)
                  {
                      // Neighbouring proxies belong to different threads: they share blocks of the table's dirty flags.
                      for (std::size_t i = std::size_t(thread); i < proxies.size(); i += kThreads)
                          moveCube(broadphase, proxies[i],
                                   vec(1.9 * double(i) / round, 0.4 * double(i % 3), 0));
                  });
        ASSERT_EQ(rayHits(broadphase, vec(-9, 0.4, 0), vec(99999, 0.4, 0)).size(), 2000u);
        broadphase.calculateOverlappingPairs(nullptr);
        ASSERT_TRUE(containsAll(pairsOf(broadphase), exactPairs(proxies)));
    }
}

TEST(BroadphaseThreads, FindSamePairsWhenEachStepsItsOwnBroadphase)
{
    std::vector<Pairs> results(kThreads);
    onThreads(kThreads,
              [&](int thread)
              {
                  Broadphase broadphase;
                  Random random(1);
                  std::vector<btBroadphaseProxy*> proxies = addRow(broadphase, 200);
                  for (int step = 0; step < 20; ++step)
                  {
                      for (btBroadphaseProxy* proxy : proxies)
                          moveCube(broadphase, proxy, vec(random.point(0, 9)));
                      broadphase.calculateOverlappingPairs(nullptr);
                  }
                  results[std::size_t(thread)] = pairsOf(broadphase);
              });
    EXPECT_GT(results[0].size(), 100u);
    for (const auto& result : results)
        EXPECT_EQ(result, results[0]);
}
}  // namespace
}  // namespace cullet::test
