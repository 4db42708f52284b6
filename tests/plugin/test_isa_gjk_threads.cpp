// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "tests/plugin/convex_contacts.h"

#include <gtest/gtest.h>

#include <thread>

namespace cullet::test
{
TEST(IsaGjkThreads, WorldsOfDifferentThreadsShareTheirShapes)
{
    const auto shape = makeHullShape(ballPoints(60, 0.5, 8));
    std::vector<std::uint64_t> hashes(4);
    std::vector<std::thread> threads;
    for (std::uint64_t& hash : hashes)
    {
        threads.emplace_back(
            [&hash, &shape]
            {
                ConvexWorld world(Narrow::IsaGjk);
                btBoxShape ground(vec(5, 0.5, 5));
                world.add(&ground, 0, vec(0, -0.5, 0));
                for (int i = 0; i < 6; ++i)
                    world.add(shape.get(), 1, vec(0.1 * i, 1 + 1.1 * i, 0));
                world.step(60);
                hash = world.hash();
            });
    }
    for (std::thread& thread : threads)
        thread.join();
    for (const std::uint64_t hash : hashes)
        EXPECT_EQ(hash, hashes[0]);
}

TEST(IsaGjkThreads, GraphsAreBuiltOnceWhoeverAsks)
{
    std::vector<std::unique_ptr<btConvexHullShape>> shapes;
    for (int i = 0; i < 20; ++i)
        shapes.push_back(makeHullShape(ballPoints(40 + i, 0.5, unsigned(100 + i))));
    const std::uint64_t before = hullCacheStats().buildsTotal;
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t)
    {
        threads.emplace_back(
            [&shapes]
            {
                for (int round = 0; round < 30; ++round)
                {
                    for (const auto& shape : shapes)
                    {
                        HullUse use;
                        const Hull<btScalar>* hull = use.hullOf(*shape, std::uint64_t(round % 3));
                        EXPECT_EQ(hull->vertexCount(), shape->getNumPoints());
                    }
                }
            });
    }
    for (std::thread& thread : threads)
        thread.join();
    EXPECT_EQ(hullCacheStats().buildsTotal, before + 20);
}

TEST(IsaGjkThreads, DispatcherGivesTheSameWorldOnAnyNumberOfThreads)
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
        // Only pairs that came close have one.
        EXPECT_LT(world.dispatcher().getNumManifolds(), world.world.getPairCache()->getNumOverlappingPairs());
        EXPECT_GT(world.stats().touchingTotal, 3000u);
        hashes.push_back(world.hash());
    }
    for (const std::uint64_t hash : hashes)
        EXPECT_EQ(hash, hashes[0]);
}
}  // namespace cullet::test
