// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/compound/compound_scene.h"
#include "cullet/tests/plugin/dispatcher/compound_world.h"

#include <BulletCollision/CollisionDispatch/btCompoundCompoundCollisionAlgorithm.h>
#include <LinearMath/btPoolAllocator.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <mutex>
#include <new>
#include <set>
#include <string>

namespace cullet::test
{
namespace
{
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
constexpr int kCompoundSteps = 60;
#else
constexpr int kCompoundSteps = 240;
#endif

void expectManifoldsKnowTheirPlaces(btCollisionDispatcher& dispatcher)
{
    for (int i = 0; i < dispatcher.getNumManifolds(); ++i)
    {
        EXPECT_EQ(dispatcher.getManifoldByIndexInternal(i)->m_index1a, i);
        EXPECT_EQ(dispatcher.getManifoldByIndexInternal(i)->m_companionIdA, 0);
        EXPECT_EQ(dispatcher.getManifoldByIndexInternal(i)->m_companionIdB, 0);
    }
}

/// Nothing that belongs to a pair is left in Bullet's pools and the array of manifolds.
void expectNothingIsLeft(CompoundWorld& world, bool mayLeakAlgorithms = false)
{
    world.removeBodies();
    EXPECT_EQ(world.dispatcher().getNumManifolds(), 0);
    EXPECT_EQ(world.configuration().getPersistentManifoldPool()->getUsedCount(), 0);
    if (!mayLeakAlgorithms)
    {
        EXPECT_EQ(world.configuration().getCollisionAlgorithmPool()->getUsedCount(), 0);
    }
}

/// Bullet's memory, of which one allocation during a dispatch on any thread fails: of a manifold or the array of manifolds.
class OneAllocationThrows
{
public:
    explicit OneAllocationThrows(int after)
    {
        left() = after;
        btAlignedAllocSetCustom(allocate, deallocate);
    }
    /// Frees what is left, after the world. Bullet leaks the memory of an algorithm whose constructor throws.
    ~OneAllocationThrows()
    {
        btAlignedAllocSetCustom(nullptr, nullptr);
        EXPECT_LE(blocks().size(), 1u);
        for (void* const memory : blocks())
            std::free(memory);
        blocks().clear();
    }
    OneAllocationThrows(const OneAllocationThrows&) = delete;
    OneAllocationThrows& operator=(const OneAllocationThrows&) = delete;

    static bool hasHappened() { return left() < 0; }
    static void begin() { isOn() = true; }
    static void end() { isOn() = false; }

private:
    static std::atomic<int>& left()
    {
        static std::atomic<int> allocations;
        return allocations;
    }
    static std::atomic<bool>& isOn()
    {
        static std::atomic<bool> on;
        return on;
    }
    static void* allocate(std::size_t size)
    {
        if (isOn() && size >= sizeof(btPersistentManifold) && left()-- == 0)
            throw std::bad_alloc();
        void* const memory = std::malloc(size);
        const std::lock_guard<std::mutex> lock(mutex());
        blocks().insert(memory);
        return memory;
    }
    static void deallocate(void* memory)
    {
        {
            const std::lock_guard<std::mutex> lock(mutex());
            blocks().erase(memory);
        }
        std::free(memory);
    }
    static std::mutex& mutex()
    {
        static std::mutex lock;
        return lock;
    }
    static std::set<void*>& blocks()
    {
        static std::set<void*> all;
        return all;
    }
};
}  // namespace

TEST(CompoundJobs, LeaveOutPairsThatHaveNotMovedOnAnyNumberOfThreads)
{
    constexpr int kBodies = 60;
    for (const int threads : {1, 2, 8})
    {
        SCOPED_TRACE(std::to_string(threads) + " threads");
        btBoxShape box(vec(0.3, 0.3, 0.3));
        btStaticPlaneShape plane(vec(0, 1, 0), 0);
        btCompoundShape compound;
        compound.addChildShape(at(-0.5, 0, 0), &box);
        compound.addChildShape(at(0.5, 0, 0), &box);
        CompoundScene scene(CompoundLoop::Own, threads);
        scene.add(plane, at(0, 0, 0), true);
        btCollisionObject* last = nullptr;
        for (int i = 0; i < kBodies; ++i)
            last = &scene.add(compound, at(3 * i, 1, 0));
        const auto step = [&]
        {
            scene.step();
            return scene.dispatcher().idlePairs();
        };
        EXPECT_EQ(step(), 0u);
        EXPECT_EQ(step(), 0u);
        EXPECT_EQ(step(), std::uint64_t(kBodies));
        EXPECT_EQ(scene.dispatcher().contactStats().jobsTotal > 0, threads > 1);
        last->setWorldTransform(at(3 * kBodies, 0.3, 0));
        EXPECT_EQ(step(), std::uint64_t(kBodies - 1));
        EXPECT_EQ(scene.contacts().size(), 2u);
        scene.clear();
    }
}

// The reference takes Bullet's own near callback, pair by pair.
TEST(CompoundJobs, GiveBulletsManifoldsInBulletsOrderOnAnyNumberOfThreads)
{
    for (const unsigned seed : {1u, 2u})
    {
        SCOPED_TRACE("seed " + std::to_string(seed));
        const auto bullets = makeCompounds<DerivedDispatcher>(seed, onThreadCount(1));
        const std::vector<std::uint64_t> expected = bullets->run(kCompoundSteps);
        EXPECT_GT(bullets->points, kCompoundSteps * 40);
        EXPECT_GT(bullets->edits, kCompoundSteps);
        EXPECT_GT(bullets->mostManifolds, 60);
        for (const int threads : {1, 2, 3, 8})
        {
            SCOPED_TRACE(std::to_string(threads) + " threads");
            const auto own = makeCompounds(seed, onThreadCount(threads));
            const std::vector<std::uint64_t> hashes = own->run(kCompoundSteps);
            EXPECT_TRUE(hashes == expected)
                << "differs in step "
                << std::mismatch(hashes.begin(), hashes.end(), expected.begin()).first - hashes.begin();
            expectManifoldsKnowTheirPlaces(own->dispatcher());
            if (threads > 1)
            {
                EXPECT_GT(own->stats().jobsTotal, own->stats().inOrderTotal * 20);
                EXPECT_GT(own->stats().dividedTotal, own->stats().jobsTotal / 2);
                EXPECT_EQ(own->stats().barriersTotal, 0u);
            }
            expectNothingIsLeft(*own);
        }
    }
}

// Children that one thread created have memory of the pools, which other threads must not give back.
TEST(CompoundJobs, ReleaseMemoryOfPoolsOnThreadOfDispatch)
{
    const auto world = makeCompounds(3, onThreadCount(3));
    gCompoundChildShapePairCallback = [](const btCollisionShape*, const btCollisionShape*) { return true; };
    world->run(kCompoundSteps / 3);
    const btPoolAllocator& manifolds = *world->configuration().getPersistentManifoldPool();
    const btPoolAllocator& algorithms = *world->configuration().getCollisionAlgorithmPool();
    const int manifoldsBefore = manifolds.getUsedCount(), algorithmsBefore = algorithms.getUsedCount();
    gCompoundChildShapePairCallback = nullptr;
    for (const auto& body : world->bodies)
        body->setLinearVelocity(btVector3(0, 8, 0));
    world->run(kCompoundSteps / 3);
    EXPECT_LT(manifolds.getUsedCount(), manifoldsBefore);
    EXPECT_LT(algorithms.getUsedCount(), algorithmsBefore);
    expectNothingIsLeft(*world);
}

TEST(CompoundJobs, AreNotDividedWhenCallbackOfChildrenIsNotThreadSafe)
{
    static std::atomic<int> calls;
    std::vector<std::uint64_t> hashes[2];
    int callsOf[2];
    for (const bool isSafe : {false, true})
    {
        calls = 0;
        gCompoundChildShapePairCallback = [](const btCollisionShape*, const btCollisionShape* child)
        {
            ++calls;
            return child->getShapeType() != SPHERE_SHAPE_PROXYTYPE;
        };
        gCompoundCompoundChildShapePairCallback = gCompoundChildShapePairCallback;
        DispatcherOptions options = onThreadCount(3);
        options.callbacksAreThreadSafe = isSafe;
        const auto world = makeCompounds(4, options);
        hashes[isSafe] = world->run(kCompoundSteps / 4);
        callsOf[isSafe] = calls;
        EXPECT_EQ(world->stats().barriersTotal == 0, isSafe);
        gCompoundChildShapePairCallback = gCompoundCompoundChildShapePairCallback = nullptr;
    }
    EXPECT_TRUE(hashes[0] == hashes[1]);
    EXPECT_EQ(callsOf[0], callsOf[1]);
    EXPECT_GT(callsOf[0], 1000);
}

// A ball of the application counts its calls without a lock, at any depth of a compound.
TEST(CompoundJobs, AreInOrderWhenAPartIsOfADerivedClass)
{
    for (const bool isNested : {false, true})
    {
        OwnBall ball(btScalar(0.3));
        btSphereShape known(btScalar(0.2));
        btCompoundShape inner, outer;
        inner.addChildShape(btTransform::getIdentity(), &ball);
        // Parts are examined in their order: this one must not make the first one known.
        inner.addChildShape(btTransform::getIdentity(), &known);
        outer.addChildShape(btTransform::getIdentity(), &inner);
        std::uint64_t inOrder[2];
        for (const bool isOwn : {false, true})
        {
            const auto world = makeCompounds(5, onThreadCount(3));
            btTransform at = btTransform::getIdentity();
            for (int i = 0; i < (isOwn ? 6 : 0); ++i)
            {
                at.setOrigin(btVector3(btScalar(2 * i - 5), btScalar(1.5), 0));
                world->add(isNested ? &outer : &inner, 1, at);
            }
            world->run(30);
            inOrder[isOwn] = world->stats().inOrderTotal;
            EXPECT_EQ(world->stats().barriersTotal, 0u);
            world->removeBodies();
        }
        EXPECT_GT(inOrder[1], inOrder[0] + 100);
    }
}

// An allocator of the application may throw. Bullet leaks the memory of the algorithm whose constructor throws. It may
// crash later if that happens to a compound without a tree, after a change of its children, or in a list of its children.
TEST(CompoundJobs, LeaveManifoldsConsistentWhenAnyAllocationThrows)
{
    constexpr int kBefore = 25;
    int failures = 0, thrown = 0;
    bool hasHappened = true;
    for (int after = 0; hasHappened; after += after < 20 ? 1 : 5)
    {
        SCOPED_TRACE(after);
        const OneAllocationThrows failing(after);
        const auto world = makeCompounds(6, onThreadCount(3), Trees::InAll);
        world->run(kBefore);
        // The second dispatch repeats what the first one could not.
        for (int i = 0; i < 2; ++i)
        {
            for (const auto& body : world->bodies)
                body->setWorldTransform(
                    btTransform(body->getWorldTransform().getBasis(),
                                body->getWorldTransform().getOrigin() * btVector3(btScalar(0.7), 1, 1)));
            world->world.updateAabbs();
            world->world.computeOverlappingPairs();
            OneAllocationThrows::begin();
            try
            {
                world->dispatcher().dispatchAllCollisionPairs(
                    world->world.getPairCache(), world->world.getDispatchInfo(), &world->dispatcher());
            }
            catch (const std::bad_alloc&)
            {
                ++thrown;
            }
            OneAllocationThrows::end();
        }
        hasHappened = OneAllocationThrows::hasHappened();
        failures += hasHappened ? 1 : 0;
        world->run(2);
        expectManifoldsKnowTheirPlaces(world->dispatcher());
        expectNothingIsLeft(*world, true);
    }
    EXPECT_GT(failures, 20);
    EXPECT_EQ(thrown, failures);
}
}  // namespace cullet::test
