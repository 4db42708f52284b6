// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/convex/manifold_record.h"

#include <LinearMath/btPoolAllocator.h>
#include <btBulletDynamicsCommon.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <new>
#include <random>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
/// A dispatcher of Bullet with bodies that name its manifolds.
struct RecordedWorld
{
    RecordedWorld()
    {
        for (int i = 0; i < 2000; ++i)
            bodies.emplace_back().setCollisionShape(&sphere);
    }

    /// The names of all manifolds in their order.
    std::vector<int> order()
    {
        std::vector<int> names;
        for (int i = 0; i < dispatcher.getNumManifolds(); ++i)
        {
            const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
            EXPECT_EQ(manifold.m_index1a, i);
            names.push_back(int(static_cast<const btCollisionObject*>(manifold.getBody0()) - bodies.data()));
        }
        return names;
    }

    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    btSphereShape sphere{btScalar(1)};
    std::vector<btCollisionObject> bodies;
};
}  // namespace

// One dispatcher does at once what the other one repeats from three records.
TEST(ManifoldRecord, RepeatsBulletsOrderOfCreationsAndReleases)
{
    const unsigned seed = 17;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 engine(seed);
    RecordedWorld direct, later;
    std::vector<btPersistentManifold*> ofDirect, ofLater;
    int made = 0, shortLives = 0;
    for (int round = 0; round < 40; ++round)
    {
        ManifoldRecord records[3];
        const std::size_t before = ofDirect.size();
        for (int i = 0; i < 30; ++i)
        {
            const auto of = i / 10 == 1 ? Recording::Of::Job : Recording::Of::Pass;
            Recording recording(later.dispatcher, records[i / 10], of);
            if (ofDirect.empty() || engine() % 9 < 5)
            {
                const btCollisionObject &a = direct.bodies[std::size_t(made)],
                                        &b = later.bodies[std::size_t(made)];
                ofDirect.push_back(direct.dispatcher.getNewManifold(&a, &a));
                ofLater.push_back(&recording.create(b, b, btScalar(0.02)));
                ++made;
                continue;
            }
            const std::size_t which = engine() % ofDirect.size();
            shortLives += which >= before ? 1 : 0;
            direct.dispatcher.releaseManifold(ofDirect[which]);
            recording.release(*ofLater[which]);
            ofDirect.erase(ofDirect.begin() + std::ptrdiff_t(which));
            ofLater.erase(ofLater.begin() + std::ptrdiff_t(which));
        }
        for (ManifoldRecord& record : records)
        {
            EXPECT_FALSE(record.isEmpty());
            record.replay(later.dispatcher);
            EXPECT_TRUE(record.isEmpty());
        }
        EXPECT_EQ(later.order(), direct.order());
    }
    EXPECT_GT(shortLives, 25);
    EXPECT_GT(ofDirect.size(), 50u);
    for (btPersistentManifold* const manifold : ofLater)
        later.dispatcher.releaseManifold(manifold);
    for (btPersistentManifold* const manifold : ofDirect)
        direct.dispatcher.releaseManifold(manifold);
    EXPECT_EQ(later.configuration.getPersistentManifoldPool()->getUsedCount(), 0);
}

TEST(ManifoldRecord, TakesMemoryFromPoolInPassAndFromHeapInJob)
{
    RecordedWorld world;
    btPoolAllocator& manifolds = *world.configuration.getPersistentManifoldPool();
    btPoolAllocator& algorithms = *world.configuration.getCollisionAlgorithmPool();
    const btCollisionObject& body = world.bodies[0];
    ManifoldRecord record;
    void* const ofPool = algorithms.allocate(16);
    {
        Recording pass(world.dispatcher, record, Recording::Of::Pass);
        EXPECT_TRUE(manifolds.validPtr(&pass.create(body, body, btScalar(0.02))));
        EXPECT_FALSE(Recording::isInJob(&world.dispatcher));
        Recording job(world.dispatcher, record, Recording::Of::Job);
        EXPECT_FALSE(manifolds.validPtr(&job.create(body, body, btScalar(0.02))));
        EXPECT_TRUE(Recording::isInJob(&world.dispatcher));
        void* const ofHeap = Recording::allocate(16);
        EXPECT_FALSE(algorithms.validPtr(ofHeap));
        job.free(ofHeap);
        job.free(ofPool);
        EXPECT_EQ(algorithms.getUsedCount(), 1);
    }
    EXPECT_EQ(Recording::ofThisThread(&world.dispatcher), nullptr);
    EXPECT_EQ(world.dispatcher.getNumManifolds(), 0);
    record.replay(world.dispatcher);
    EXPECT_EQ(world.dispatcher.getNumManifolds(), 2);
    EXPECT_EQ(algorithms.getUsedCount(), 0);
    while (world.dispatcher.getNumManifolds() > 0)
        world.dispatcher.releaseManifold(world.dispatcher.getManifoldByIndexInternal(0));
    EXPECT_EQ(manifolds.getUsedCount(), 0);
}

// The allocator of an application throws when the array of manifolds grows.
TEST(ManifoldRecord, RemainsWhenArrayFindsNoMemory)
{
    constexpr int kCount = 40;
    static bool isFull;
    isFull = false;
    btAlignedAllocSetCustom(
        [](std::size_t size)
        {
            if (isFull && size < sizeof(btPersistentManifold))
                throw std::bad_alloc();
            return std::malloc(size);
        },
        std::free);
    {
        RecordedWorld world;
        ManifoldRecord record;
        std::vector<btPersistentManifold*> made;
        for (int i = 0; i < kCount; ++i)
        {
            const btCollisionObject& body = world.bodies[std::size_t(i)];
            made.push_back(
                &Recording(world.dispatcher, record, Recording::Of::Job).create(body, body, btScalar(0.02)));
        }
        isFull = true;
        EXPECT_THROW(record.replay(world.dispatcher), std::bad_alloc);
        EXPECT_EQ(world.dispatcher.getNumManifolds(), 0);
        // What follows is recorded too.
        Recording(world.dispatcher, record, Recording::Of::Pass).release(*made[0]);
        isFull = false;
        record.replay(world.dispatcher);
        EXPECT_EQ(world.order().size(), std::size_t(kCount - 1));
        EXPECT_EQ(world.order()[0], kCount - 1);
        while (world.dispatcher.getNumManifolds() > 0)
            world.dispatcher.releaseManifold(world.dispatcher.getManifoldByIndexInternal(0));
    }
    btAlignedAllocSetCustom(nullptr, nullptr);
}

// A callback in a job may use another world on the same thread.
TEST(ManifoldRecord, BelongsToOneDispatcher)
{
    RecordedWorld world, other;
    ManifoldRecord record, recordOfOther;
    Recording outer(world.dispatcher, record, Recording::Of::Job);
    EXPECT_EQ(Recording::ofThisThread(&other.dispatcher), nullptr);
    const Recording inner(other.dispatcher, recordOfOther, Recording::Of::Pass);
    EXPECT_EQ(Recording::ofThisThread(&world.dispatcher), &outer);
    EXPECT_TRUE(Recording::isInJob(&world.dispatcher));
    EXPECT_FALSE(Recording::isInJob(&other.dispatcher));
}
}  // namespace cullet::test
