// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/comparison/backends.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/falling_heap.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <LinearMath/btPoolAllocator.h>
#include <btBulletDynamicsCommon.h>
#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <memory>
#include <vector>

namespace cullet::test
{
namespace
{
template <class World>
class BroadphaseWorld : public testing::Test
{
};
using Worlds = testing::Types<DiscreteWorld, SimpleWorld, MultiBodyWorld, MtWorld>;
TYPED_TEST_SUITE(BroadphaseWorld, Worlds);

TYPED_TEST(BroadphaseWorld, BringsHeapToRestAsWithDbvt)
{
    double heights[2] = {};
    for (const int isStock : {0, 1})
    {
        std::unique_ptr<btBroadphaseInterface> broadphase;
        if (isStock)
        {
            broadphase = std::make_unique<btDbvtBroadphase>();
        }
        else
        {
            broadphase = std::make_unique<Broadphase>();
        }
        TypeParam stage(std::move(broadphase));
        stage.world.setGravity(vec(0, -10, 0));
        Heap heap(stage.world);
        heap.step(240);
        heights[isStock] = heap.meanHeight();
    }
    EXPECT_GT(heights[0], 0.49);
    // A chaotic heap: results are similar, not equal.
    EXPECT_NEAR(heights[0], heights[1], 0.35 * heights[1]);
}

TYPED_TEST(BroadphaseWorld, GivesSameBitsInEveryRunAndWithEveryBackend)
{
    std::vector<std::uint64_t> hashes;
    for (int run = 0; run < 5; ++run)
    {
        BroadphaseOptions options;
        options.backend = run < 2 ? BackendChoice::Brute : BackendChoice::Grid;
        options.threads = run < 3 ? 1 : 3;
        options.grid.flatLimit = run == 3 ? 0 : GridOptions::kMeasured;
        auto broadphase = std::make_unique<Broadphase>(options);
        if (run == 4)
            broadphase->setBackend(makeCellGridBackend());
        TypeParam stage(std::move(broadphase));
        stage.world.setGravity(vec(0, -10, 0));
        Heap heap(stage.world);
        heap.step(120);
        hashes.push_back(heap.hash());
    }
    for (const std::uint64_t hash : hashes)
        EXPECT_EQ(hash, hashes[0]);
}

TEST(BroadphaseWorlds, GiveSameBitsWithEveryBackendWhenPairsAreDeterministic)
{
    std::vector<std::uint64_t> hashes;
    for (const BackendChoice backend : {BackendChoice::Brute, BackendChoice::Grid})
    {
        BroadphaseOptions options;
        options.backend = backend;
        DiscreteWorld stage(std::make_unique<Broadphase>(options));
        stage.world.getDispatchInfo().m_deterministicOverlappingPairs = true;
        stage.world.setGravity(vec(0, -10, 0));
        Heap heap(stage.world);
        heap.step(120);
        hashes.push_back(heap.hash());
    }
    EXPECT_EQ(hashes[0], hashes[1]);
}

TEST(BroadphaseWorlds, KeepPileStandingAndAlgorithmsOfItsPairs)
{
    DiscreteWorld stage(std::make_unique<Broadphase>());
    stage.world.setGravity(vec(0, -10, 0));
    Heap pile(stage.world, true);
    for (auto& body : pile.bodies)
        body->setActivationState(DISABLE_DEACTIVATION);
    pile.step(60);
    std::map<std::uint64_t, btCollisionAlgorithm*> before;
    for (int step = 0; step < 1000; ++step)
    {
        pile.step(1);
        const btBroadphasePairArray& pairs = stage.world.getPairCache()->getOverlappingPairArray();
        ASSERT_EQ(pairs.size(), 9) << "five on the plane, four neighbours";
        for (int i = 0; i < pairs.size(); ++i)
        {
            auto& known = before[pairKey({idOf(pairs[i].m_pProxy0), idOf(pairs[i].m_pProxy1)})];
            if (step > 0)
            {
                ASSERT_EQ(pairs[i].m_algorithm, known);
            }
            known = pairs[i].m_algorithm;
        }
    }
    EXPECT_EQ(before.size(), 9u);
    EXPECT_NEAR(double(pile.bodies[5]->getWorldTransform().getOrigin().y()), 4.5, 0.1);
}

TEST(BroadphaseWorlds, KeepPairOfLargeBoxesWithinTheirContactThreshold)
{
    // Contacts of 10 m boxes persist up to a gap of 0.17 m, but boxes are inflated by 0.02 m only; the margin
    // compensates for that.
    Broadphase broadphase(bruteOptions());
    btBroadphaseProxy* upper = addCube(broadphase, vec(0, 10.02, 0), 5.02);
    addCube(broadphase, vec(0, 0, 0), 5.02);
    ASSERT_EQ(updatedPairs(broadphase).size(), 1u);
    for (int i = 0; i < 100; ++i)
    {
        moveCube(broadphase, upper, vec(0, 10.04 + 0.09 * (i % 2), 0), 5.02);
        ASSERT_EQ(updatedPairs(broadphase).size(), 1u);
    }
}

TEST(BroadphaseWorlds, KeepBoxAndPairsOfBodyWhosePositionBecomesNan)
{
    DiscreteWorld stage(std::make_unique<Broadphase>());
    Heap pile(stage.world, true);
    stage.world.performDiscreteCollisionDetection();
    const int pairCount = stage.world.getPairCache()->getNumOverlappingPairs();
    ASSERT_EQ(pairCount, 9);
    btRigidBody& body = *pile.bodies[5];
    const btVector3 boxMin = body.getBroadphaseHandle()->m_aabbMin;
    btTransform nowhere = body.getWorldTransform();
    nowhere.setOrigin(vec(std::numeric_limits<double>::quiet_NaN(), 0, 0));
    body.setWorldTransform(nowhere);
    for (int i = 0; i < 3; ++i)
        stage.world.performDiscreteCollisionDetection();
    EXPECT_EQ(body.getActivationState(), DISABLE_SIMULATION);
    EXPECT_EQ(body.getBroadphaseHandle()->m_aabbMin, boxMin);
    EXPECT_EQ(stage.world.getPairCache()->getNumOverlappingPairs(), pairCount);
}

TEST(BroadphaseWorlds, WakeSleepingPileOnHitWithoutForcedAabbUpdates)
{
    DiscreteWorld stage(std::make_unique<Broadphase>());
    stage.world.setGravity(vec(0, -10, 0));
    stage.world.setForceUpdateAllAabbs(false);
    Heap pile(stage.world, true);
    pile.step(300);
    EXPECT_EQ(pile.bodies[3]->getActivationState(), ISLAND_SLEEPING);
    btSphereShape ballShape(btScalar(0.5));
    pile.add(&ballShape, 50, vec(-3, 3, 0));
    pile.bodies.back()->setLinearVelocity(vec(30, 2, 0));
    pile.step(20);
    EXPECT_EQ(pile.bodies[3]->getActivationState(), ACTIVE_TAG) << "hit and woken";
    pile.step(200);
    pile.meanHeight();
    stage.world.removeRigidBody(pile.bodies.back().get());
    pile.bodies.pop_back();
}

TEST(BroadphaseWorlds, KeepPairsWhenTickCallbackRemovesAndAddsBody)
{
    DiscreteWorld stage(std::make_unique<Broadphase>());
    Heap pile(stage.world, true);
    const auto callback = [](btDynamicsWorld* world, btScalar)
    {
        auto& bodies = static_cast<Heap*>(world->getWorldUserInfo())->bodies;
        for (int i = 0; i < 3; ++i)
        {
            world->removeRigidBody(bodies[4].get());
            world->addRigidBody(bodies[4].get());
        }
    };
    for (const bool isPreTick : {true, false})
    {
        stage.world.setInternalTickCallback(callback, &pile, isPreTick);
        pile.step(10);
        stage.broadphase->calculateOverlappingPairs(&stage.dispatcher);
        EXPECT_EQ(pairsOf(*stage.broadphase).size(), 9u);
        stage.world.setInternalTickCallback(nullptr, nullptr, isPreTick);
    }
    while (pile.bodies.size() > 1)
    {
        stage.world.removeRigidBody(pile.bodies.back().get());
        pile.bodies.pop_back();
    }
    EXPECT_EQ(pairsOf(*stage.broadphase).size(), 0u);
}

TEST(BroadphaseWorlds, GiveRefreshedBodyNewestIdAndItsPairsAgain)
{
    DiscreteWorld stage(std::make_unique<Broadphase>());
    Heap pile(stage.world, true);
    stage.world.performDiscreteCollisionDetection();
    const int oldId = pile.bodies[1]->getBroadphaseHandle()->m_uniqueId;
    stage.world.refreshBroadphaseProxy(pile.bodies[1].get());
    stage.world.performDiscreteCollisionDetection();
    EXPECT_EQ(oldId, 2);
    EXPECT_EQ(pile.bodies[1]->getBroadphaseHandle()->m_uniqueId, 7);
    EXPECT_TRUE(hasPair(*stage.broadphase, pile.bodies[1]->getBroadphaseHandle(),
                        pile.bodies[2]->getBroadphaseHandle()));
    pairsOf(*stage.broadphase);
}

TEST(BroadphaseWorlds, SerialiseSameIdsAsWithDbvt)
{
    std::vector<int> ids[2];
    for (const int isStock : {0, 1})
    {
        std::unique_ptr<btBroadphaseInterface> broadphase;
        if (isStock)
        {
            broadphase = std::make_unique<btDbvtBroadphase>();
        }
        else
        {
            broadphase = std::make_unique<Broadphase>();
        }
        DiscreteWorld stage(std::move(broadphase));
        Heap pile(stage.world, true);
        stage.world.removeRigidBody(pile.bodies[3].get());
        stage.world.addRigidBody(pile.bodies[3].get());
        btDefaultSerializer serializer;
        for (auto& body : pile.bodies)
        {
            btCollisionObjectData data;
            body->btCollisionObject::serialize(&data, &serializer);
            ids[isStock].push_back(data.m_uniqueId);
        }
    }
    EXPECT_EQ(ids[0], ids[1]);
    EXPECT_EQ(ids[0][3], 7);
}

/// A world of two objects that touch, which belong to the caller.
struct PairWorld
{
    PairWorld()
    {
        for (btCollisionObject& object : objects)
        {
            object.setCollisionShape(&shape);
            world->addCollisionObject(&object);
        }
        world->performDiscreteCollisionDetection();
        EXPECT_EQ(pairsOf(*broadphase), (Pairs{{1, 2}}));
        EXPECT_EQ(dispatcher.getNumManifolds(), 1);
        EXPECT_EQ(configuration.getCollisionAlgorithmPool()->getUsedCount(), 1);
    }
    ~PairWorld() { expectNothingLeft(); }
    PairWorld(const PairWorld&) = delete;
    PairWorld& operator=(const PairWorld&) = delete;

    void empty()
    {
        for (btCollisionObject& object : objects)
            world->removeCollisionObject(&object);
        expectNothingLeft();
    }

    /// Expects that the pair's algorithm and manifold are freed, and that no object has a proxy.
    void expectNothingLeft()
    {
        EXPECT_EQ(dispatcher.getNumManifolds(), 0);
        EXPECT_EQ(configuration.getCollisionAlgorithmPool()->getUsedCount(), 0);
        EXPECT_EQ(configuration.getPersistentManifoldPool()->getUsedCount(), 0);
        for (const btCollisionObject& object : objects)
            EXPECT_EQ(object.getBroadphaseHandle(), nullptr);
        if (broadphase != nullptr)
        {
            EXPECT_EQ(pairsOf(*broadphase), Pairs{});
            EXPECT_EQ(broadphase->stats().bodies, 0u);
        }
    }

    btSphereShape shape{1};
    btCollisionObject objects[2];
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    std::unique_ptr<Broadphase> broadphase = std::make_unique<Broadphase>();
    std::unique_ptr<btCollisionWorld> world =
        std::make_unique<btCollisionWorld>(&dispatcher, broadphase.get(), &configuration);
};

TEST(BroadphaseWorlds, EndBeforeBroadphaseOrAfterItWhenEmptied)
{
    PairWorld full;
    full.world.reset();
    full.expectNothingLeft();
    full.broadphase.reset();

    PairWorld first;
    first.empty();
    first.world.reset();
    first.expectNothingLeft();
    first.broadphase.reset();

    PairWorld last;
    last.empty();
    last.broadphase.reset();
    last.world.reset();
}

TEST(BroadphaseWorlds, LandMultiBodyOnPlane)
{
    MultiBodyWorld stage(std::make_unique<Broadphase>());
    stage.world.setGravity(vec(0, -10, 0));
    Heap pile(stage.world, true);
    btSphereShape shape(btScalar(0.5));
    btMultiBody body(0, 1, vec(0.4, 0.4, 0.4), false, true);
    body.setBasePos(vec(5, 3, 0));
    btMultiBodyLinkCollider collider(&body, -1);
    collider.setCollisionShape(&shape);
    collider.setWorldTransform(btTransform(btQuaternion::getIdentity(), vec(5, 3, 0)));
    body.setBaseCollider(&collider);
    body.finalizeMultiDof();
    stage.world.addMultiBody(&body);
    stage.world.addCollisionObject(&collider, btBroadphaseProxy::DefaultFilter, btBroadphaseProxy::AllFilter);
    pile.step(200);
    EXPECT_NEAR(double(body.getBasePos().y()), 0.5, 0.1);
    stage.world.removeCollisionObject(&collider);
    stage.world.removeMultiBody(&body);
}
}  // namespace
}  // namespace cullet::test
