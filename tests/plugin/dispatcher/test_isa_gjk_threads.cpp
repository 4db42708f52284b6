// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/convex/convex_contacts.h"
#include "cullet/tests/plugin/dispatcher/contact_log.h"
#include "cullet/tests/support/threads.h"

#include <gtest/gtest.h>

namespace cullet::test
{
namespace
{
/// A cloud of drifting and rotating rods: most boxes overlap, and few rods touch.
std::vector<std::uint64_t> contactsOfRods(unsigned seed, int threads)
{
    constexpr int kRods = 72;
    std::mt19937 engine(seed);
    std::vector<std::unique_ptr<btConvexHullShape>> shapes;
    for (int i = 0; i < 4; ++i)
    {
        std::vector<btVector3> points = ballPoints(24 + 8 * i, 1, seed + unsigned(i));
        for (btVector3& point : points)
            point *= vec(1.6, 0.1 + 0.03 * i, 0.1);
        shapes.push_back(makeHullShape(points));
    }
    shapes.push_back(makeHullShape(boxPoints(1.6, 0.05, 0.1)));
    ContactLog log;
    ConvexWorld world(Narrow::Dispatcher, threads);
    world.world.setGravity(vec(0, 0, 0));
    std::normal_distribution<double> normal;
    const auto anyVector = [&](double size)
    {
        const double x = size * normal(engine), y = size * normal(engine), z = size * normal(engine);
        return vec(x, y, z);
    };
    for (int i = 0; i < kRods; ++i)
    {
        const btVector3 origin = anyVector(1.2);
        const btTransform at(randomRotation(engine), origin);
        btRigidBody& body = world.add(shapes[std::size_t(i) % shapes.size()].get(), 1, at);
        body.setUserIndex(i);
        body.setRestitution(btScalar(0.8));
        body.setActivationState(DISABLE_DEACTIVATION);
        // Some rest until they are hit.
        if (i % 3 > 0)
        {
            body.setLinearVelocity(anyVector(0.7));
            body.setAngularVelocity(anyVector(1));
        }
    }
    auto& dispatcher = static_cast<Dispatcher&>(world.dispatcher());
    std::uint64_t idle = 0, still = 0;
    for (int i = 0; i < 50; ++i)
    {
        world.step();
        log.addManifolds(dispatcher);
        idle += dispatcher.idlePairs();
        still += dispatcher.stillPairs();
    }
    // Enough for several threads.
    EXPECT_GT(idle, 50u * 600u);
    EXPECT_GT(still, idle / 8);
    EXPECT_GT(dispatcher.stats().touchingTotal, 1000u);
    return log.entries();
}
}  // namespace

TEST(IsaGjkThreads, GetSameWorldWhenTheyShareShapes)
{
    const auto shape = makeHullShape(ballPoints(60, 0.5, 8));
    std::vector<std::uint64_t> hashes(4);
    onThreads(hashes.size(),
              [&](std::size_t thread)
              {
                  ConvexWorld world(Narrow::IsaGjk);
                  btBoxShape ground(vec(5, 0.5, 5));
                  world.add(&ground, 0, vec(0, -0.5, 0));
                  for (int i = 0; i < 6; ++i)
                      world.add(shape.get(), 1, vec(0.1 * i, 1 + 1.1 * i, 0));
                  world.step(60);
                  hashes[thread] = world.hash();
              });
    for (const std::uint64_t hash : hashes)
        EXPECT_EQ(hash, hashes[0]);
}

TEST(IsaGjkThreads, BuildEachGraphOnlyOnce)
{
    std::vector<std::unique_ptr<btConvexHullShape>> shapes;
    for (int i = 0; i < 20; ++i)
        shapes.push_back(makeHullShape(ballPoints(40 + i, 0.5, unsigned(100 + i))));
    const std::uint64_t before = hullCacheStats().buildsTotal;
    onThreads(4,
              [&](std::size_t)
              {
                  for (int round = 0; round < 30; ++round)
                  {
                      for (const auto& shape : shapes)
                      {
                          HullUse use;
                          const Hull<btScalar>* hull = use.graphOf(*shape, std::uint64_t(round % 3));
                          EXPECT_EQ(hull->vertexCount(), shape->getNumPoints());
                      }
                  }
              });
    EXPECT_EQ(hullCacheStats().buildsTotal, before + 20);
}

TEST(IsaGjkThreads, BuildOneGraphForEqualPointsThatEachHasWritten)
{
    constexpr int kThreads = 4, kShapes = 20, kRounds = 15, kPoints = 40;
    struct Edited
    {
        explicit Edited(unsigned seed) : shape(makeHullShape(ballPoints(kPoints, 0.5, seed)))
        {
            use.hullOf(*shape, 0);
        }
        void write(const std::vector<btVector3>& points)
        {
            for (int i = 0; i < kPoints; ++i)
                shape->getUnscaledPoints()[i] = points[static_cast<std::size_t>(i)];
        }
        std::unique_ptr<btConvexHullShape> shape;
        HullUse use;
    };
    std::vector<std::unique_ptr<Edited>> edited;
    for (unsigned i = 0; i < kThreads * kShapes; ++i)
        edited.push_back(std::make_unique<Edited>(1000 + i));
    const std::uint64_t before = hullCacheStats().buildsTotal;
    for (unsigned round = 0; round < kRounds; ++round)
    {
        for (std::size_t i = 0; i < edited.size(); ++i)
            edited[i]->write(ballPoints(kPoints, 0.5, 2000 + kShapes * round + unsigned(i % kShapes)));
        onThreads(kThreads,
                  [&](std::size_t thread)
                  {
                      for (std::size_t i = 0; i < kShapes; ++i)
                      {
                          Edited& own = *edited[thread * kShapes + i];
                          EXPECT_EQ(own.use.graphOf(*own.shape, 0)->vertexCount(), kPoints);
                      }
                  });
        ASSERT_EQ(hullCacheStats().buildsTotal, before + kShapes * (round + 1)) << round;
    }
}

TEST(IsaGjkThreads, KeepGraphsInUseWhileOthersForgetThem)
{
    std::vector<std::unique_ptr<btConvexHullShape>> shapes;
    for (int i = 0; i < 12; ++i)
        shapes.push_back(makeHullShape(ballPoints(20 + i, 0.5, unsigned(200 + i))));
    const std::uint64_t before = hullCacheStats().buildsTotal;
    onThreads(4,
              [&](std::size_t thread)
              {
                  for (std::size_t round = 0; round < 400; ++round)
                  {
                      const btConvexHullShape& shape = *shapes[(7 * round + thread) % shapes.size()];
                      HullUse use;
                      const Hull<btScalar>* hull = use.graphOf(shape, 0);
                      if (thread == 0)
                          trimHullCache();
                      else if (thread == 1)
                          invalidate(*shapes[round % shapes.size()]);
                      else if (thread == 2 && round % 3 == 0)
                          prepare(shape);
                      EXPECT_EQ(hull->vertexCount(), shape.getNumPoints());
                  }
              });
    // Some graphs were removed and built again.
    EXPECT_GT(hullCacheStats().buildsTotal, before + shapes.size());
    for (const auto& shape : shapes)
        invalidate(*shape);
}

TEST(IsaGjkThreads, DoNotChangeDispatchersWorldHoweverManyTheyAre)
{
    std::vector<std::unique_ptr<btConvexHullShape>> shapes;
    for (unsigned i = 0; i < 4; ++i)
        shapes.push_back(makeHullShape(ballPoints(30, 0.5, i + 1)));
    btCylinderShape cylinder(vec(0.4, 0.5, 0.4));
    std::vector<std::uint64_t> hashes;
    for (const int threads : {1, 2, 4})
    {
        ConvexWorld world(Narrow::Dispatcher, threads);
        btBoxShape ground(vec(9, 0.5, 9));
        world.add(&ground, 0, vec(0, -0.5, 0));
        std::mt19937 engine(3);
        for (int i = 0; i < 150; ++i)
        {
            btCollisionShape* shape = i % 10 == 9 ? static_cast<btCollisionShape*>(&cylinder)
                                                  : shapes[std::size_t(i) % shapes.size()].get();
            world.add(shape, 1,
                      btTransform(randomRotation(engine),
                                  vec(1.05 * (i % 5), 1 + 1.1 * (i / 25), 1.05 * (i / 5 % 5))));
        }
        std::uint64_t idle = 0;
        for (int i = 0; i < 60; ++i)
        {
            world.step();
            idle += static_cast<Dispatcher&>(world.dispatcher()).idlePairs();
        }
        EXPECT_GT(idle, 10000u);
        // Only near pairs have a manifold.
        EXPECT_LT(world.dispatcher().getNumManifolds(), world.world.getPairCache()->getNumOverlappingPairs());
        EXPECT_GT(world.stats().touchingTotal, 3000u);
        hashes.push_back(world.hash());
    }
    for (const std::uint64_t hash : hashes)
        EXPECT_EQ(hash, hashes[0]);
}

TEST(IsaGjkThreads, DoNotChangeContactsOrCallbacksHoweverManyTheyAre)
{
    for (unsigned seed = 1; seed <= 3; ++seed)
    {
        const std::vector<std::uint64_t> alone = contactsOfRods(seed, 1);
        for (const int threads : {2, 8})
            EXPECT_TRUE(contactsOfRods(seed, threads) == alone) << "seed " << seed << ", threads " << threads;
    }
}
}  // namespace cullet::test
