// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// An application compiled with -fno-rtti: its classes have no type_info for cullet to compare.
#include "cullet/plugin/convex_dispatcher.h"
#include "cullet/plugin/world.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/convex/convex_contacts.h"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <btBulletCollisionCommon.h>
#include <gtest/gtest.h>

#ifdef __GXX_RTTI
#error "to be compiled with -fno-rtti"
#endif

namespace cullet::test
{
namespace
{
/// A convex algorithm of the application, which counts its calls and reports no contacts.
class OwnAlgorithm : public btCollisionAlgorithm
{
public:
    using btCollisionAlgorithm::btCollisionAlgorithm;
    void processCollision(const btCollisionObjectWrapper*, const btCollisionObjectWrapper*,
                          const btDispatcherInfo&, btManifoldResult*) override
    {
        ++calls;
    }
    btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                   btManifoldResult*) override
    {
        return 1;
    }
    void getAllContactManifolds(btManifoldArray&) override {}

    struct CreateFunc : btCollisionAlgorithmCreateFunc
    {
        btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                       const btCollisionObjectWrapper*,
                                                       const btCollisionObjectWrapper*) override
        {
            return new (info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(OwnAlgorithm)))
                OwnAlgorithm(info);
        }
    };

    static int calls;
};
int OwnAlgorithm::calls = 0;

class OwnConfiguration : public btDefaultCollisionConfiguration
{
public:
    btCollisionAlgorithmCreateFunc* getCollisionAlgorithmCreateFunc(int a, int b) override
    {
        if (a == CONVEX_HULL_SHAPE_PROXYTYPE && b == CONVEX_HULL_SHAPE_PROXYTYPE)
            return &m_own;
        return btDefaultCollisionConfiguration::getCollisionAlgorithmCreateFunc(a, b);
    }

private:
    OwnAlgorithm::CreateFunc m_own;
};

template <class Cache>
class OwnCache : public Cache
{
public:
    btBroadphasePair* addOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b) override
    {
        ++added;
        return Cache::addOverlappingPair(a, b);
    }
    int added = 0;
};

struct OwnBroadphase : btDbvtBroadphase
{
};

struct OwnBox : btBoxShape
{
    using btBoxShape::btBoxShape;
    const char* getName() const override { return "own"; }
};

template <class Cache>
class NoRttiCache : public testing::Test
{
};
using Caches = testing::Types<btHashedOverlappingPairCache, btSortedOverlappingPairCache, btNullPairCache>;
TYPED_TEST_SUITE(NoRttiCache, Caches);
}  // namespace

TYPED_TEST(NoRttiCache, ReceivesAndLosesPairsFromBroadphase)
{
    constexpr bool kStores = !std::is_same_v<TypeParam, btNullPairCache>;
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    OwnCache<TypeParam> cache;
    Broadphase broadphase(&cache);
    btBroadphaseProxy* const a = addCube(broadphase, vec(0, 0, 0));
    btBroadphaseProxy* const b = addCube(broadphase, vec(0.5, 0, 0));
    btBroadphaseProxy* const c = addCube(broadphase, vec(0, 0.5, 0));
    broadphase.calculateOverlappingPairs(&dispatcher);
    EXPECT_EQ(cache.getNumOverlappingPairs(), kStores ? 3 : 0);
    moveCube(broadphase, b, vec(50, 0, 0));
    broadphase.calculateOverlappingPairs(&dispatcher);
    EXPECT_EQ(cache.getNumOverlappingPairs(), kStores ? 1 : 0);
    broadphase.destroyProxy(c, &dispatcher);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 0);
    broadphase.destroyProxy(a, &dispatcher);
    broadphase.destroyProxy(b, &dispatcher);
    EXPECT_GT(cache.added, 0);
}

TEST(NoRttiApplication, HasItsRegisteredAlgorithmCalledByDispatcher)
{
    btDefaultCollisionConfiguration configuration;
    Dispatcher dispatcher(&configuration);
    OwnAlgorithm::CreateFunc own;
    dispatcher.registerCollisionCreateFunc(BOX_SHAPE_PROXYTYPE, BOX_SHAPE_PROXYTYPE, &own);
    OwnBroadphase broadphase;
    btCollisionWorld world(&dispatcher, &broadphase, &configuration);
    OwnBox box(vec(1, 1, 1));
    btCollisionObject a, b;
    for (btCollisionObject* body : {&a, &b})
    {
        body->setCollisionShape(&box);
        world.addCollisionObject(body);
    }
    OwnAlgorithm::calls = 0;
    for (int step = 0; step < 2; ++step)
        world.performDiscreteCollisionDetection();
    EXPECT_EQ(OwnAlgorithm::calls, 2);
    world.removeCollisionObject(&a);
    world.removeCollisionObject(&b);
}

TEST(NoRttiApplication, RegistersIsaGjkOverItsOwnConvexAlgorithm)
{
    OwnConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    const IsaGjkRegistration& registration = registerIsaGjk(dispatcher);
    const auto hull = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    ConvexPairProbe probe(dispatcher, *hull, *hull);
    probe.place(vec(0, 1.05, 0), vec(0, 0, 0));
    EXPECT_EQ(probe.step()->getNumContacts(), 4);
    EXPECT_EQ(registration.stats().touchingTotal, 1u);
}

TEST(NoRttiApplication, ReceivesPointsBeyondBreakingThresholdInItsOwnResult)
{
    ConvexBench bench;
    const auto hull = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    ConvexPairProbe probe(bench.dispatcher, *hull, *hull);
    // Beyond the breaking threshold, where points are removed.
    probe.place(vec(0, 1.2, 0), vec(0, 0, 0));
    EXPECT_EQ(probe.step()->getNumContacts(), 0);
    EXPECT_FALSE(probe.query(0.5).empty());
}

TEST(NoRttiApplication, HasAabbsOfItsShapesComputedOnCallingThread)
{
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    OwnBroadphase broadphase;
    World<btCollisionWorld> world(&dispatcher, &broadphase, &configuration);
    OwnBox box(vec(1, 1, 1));
    std::vector<btCollisionObject> objects(2 * WorldBoxes::kGrain);
    for (std::size_t i = 0; i < objects.size(); ++i)
    {
        objects[i].setCollisionShape(&box);
        objects[i].getWorldTransform().setIdentity();
        objects[i].getWorldTransform().setOrigin(vec(3.0 * double(i), 0, 0));
        world.addCollisionObject(&objects[i]);
    }
    world.updateAabbs();
    EXPECT_EQ(world.updateStats().serialBoxes, objects.size());
    for (btCollisionObject& object : objects)
        world.removeCollisionObject(&object);
}
}  // namespace cullet::test
