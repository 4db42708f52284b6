// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/proxy_table.h"
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/plugin/broadphase/exact_oracle.h"
#include "cullet/tests/support/random.h"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <btBulletCollisionCommon.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <vector>

namespace cullet::test
{
namespace
{
/// A btGhostPairCallback that also checks that each pair enters once and leaves once.
struct CheckedGhostCallback final : btGhostPairCallback
{
    btBroadphasePair* addOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b) override
    {
        EXPECT_EQ(++live[pairKey({idOf(a), idOf(b)})], 1) << "added twice";
        ++addedCount;
        return btGhostPairCallback::addOverlappingPair(a, b);
    }
    void* removeOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b, btDispatcher* dispatcher) override
    {
        EXPECT_EQ(live.erase(pairKey({idOf(a), idOf(b)})), 1u) << "removed without having been added";
        ++removedCount;
        sawNullDispatcher = sawNullDispatcher || dispatcher == nullptr;
        return btGhostPairCallback::removeOverlappingPair(a, b, dispatcher);
    }
    void removeOverlappingPairsContainingProxy(btBroadphaseProxy*, btDispatcher*) override { ADD_FAILURE(); }
    std::map<std::uint64_t, int> live;
    int addedCount = 0;
    int removedCount = 0;
    bool sawNullDispatcher = false;
};

/// A collision world with a sphere shape; objects remove themselves before the world is destroyed.
class GhostWorld
{
public:
    explicit GhostWorld(btOverlappingPairCache* cache = nullptr) : broadphase(cache, bruteOptions())
    {
        world.getPairCache()->setInternalGhostPairCallback(&callback);
    }
    ~GhostWorld()
    {
        while (world.getNumCollisionObjects() > 0)
            world.removeCollisionObject(world.getCollisionObjectArray()[0]);
    }
    GhostWorld(const GhostWorld&) = delete;
    GhostWorld& operator=(const GhostWorld&) = delete;

    template <class Object>
    Object* add(const btVector3& at)
    {
        auto object = std::make_unique<Object>();
        object->setCollisionShape(&shape);
        object->getWorldTransform().setOrigin(at);
        world.addCollisionObject(object.get());
        Object* raw = object.get();
        objects.push_back(std::move(object));
        return raw;
    }
    void move(btCollisionObject* object, const btVector3& to)
    {
        object->getWorldTransform().setOrigin(to);
        world.updateSingleAabb(object);
    }

    std::vector<std::unique_ptr<btCollisionObject>> objects;
    btSphereShape shape{btScalar(0.5)};
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    CheckedGhostCallback callback;
    Broadphase broadphase;
    btCollisionWorld world{&dispatcher, &broadphase, &configuration};
};

TEST(BroadphaseGhosts, HaveOverlapsRightAfterAddingAndMovingWithoutUpdate)
{
    GhostWorld scene;
    scene.add<btCollisionObject>(vec(0, 0, 0));
    auto* body = scene.add<btCollisionObject>(vec(5, 0, 0));
    auto* ghost = scene.add<btPairCachingGhostObject>(vec(0.5, 0, 0));
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 1) << "a new ghost";
    EXPECT_EQ(ghost->getOverlappingPairCache()->getNumOverlappingPairs(), 1);
    scene.move(ghost, vec(2.5, 0, 0));
    scene.move(ghost, vec(4.5, 0, 0));
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 2)
        << "a ghost that moves; what it left stays until the update";
    auto* born = scene.add<btCollisionObject>(vec(4, 0, 0));
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 3) << "a new body at a ghost";
    auto* comer = scene.add<btCollisionObject>(vec(50, 0, 0));
    scene.move(comer, vec(4.2, 0, 0));
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 4) << "a body that moves to a ghost";
    scene.broadphase.calculateOverlappingPairs(&scene.dispatcher);
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 3);
    scene.world.removeCollisionObject(born);
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 2) << "removal is seen at once";
    scene.world.removeCollisionObject(body);
    scene.world.removeCollisionObject(comer);
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 0);
}

TEST(BroadphaseGhosts, OverlapEachOtherWithoutUpdate)
{
    GhostWorld scene;
    auto* one = scene.add<btGhostObject>(vec(0, 0, 0));
    auto* other = scene.add<btGhostObject>(vec(9, 0, 0));
    scene.move(other, vec(0.5, 0, 0));
    EXPECT_EQ(one->getNumOverlappingObjects(), 1);
    EXPECT_EQ(other->getNumOverlappingObjects(), 1);
}

TEST(BroadphaseGhosts, LoseEachOverlapOnceHoweverItEnds)
{
    GhostWorld scene;
    auto* ghost = scene.add<btPairCachingGhostObject>(vec(0, 0, 0));
    auto* leaves = scene.add<btCollisionObject>(vec(0.5, 0, 0));
    auto* refreshed = scene.add<btCollisionObject>(vec(-0.5, 0, 0));
    auto* destroyed = scene.add<btCollisionObject>(vec(0, 0.5, 0));
    ASSERT_EQ(ghost->getNumOverlappingObjects(), 3);
    scene.move(leaves, vec(9, 0, 0));
    scene.broadphase.calculateOverlappingPairs(&scene.dispatcher);
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 2);
    const int addedBefore = scene.callback.addedCount;
    scene.world.refreshBroadphaseProxy(refreshed);
    EXPECT_GT(scene.callback.addedCount, addedBefore) << "out and in again";
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 2);
    scene.world.removeCollisionObject(destroyed);
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 1);
    scene.world.removeCollisionObject(ghost);
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 0);
    scene.world.removeCollisionObject(refreshed);
    scene.world.removeCollisionObject(leaves);
    EXPECT_TRUE(scene.callback.live.empty());
    EXPECT_FALSE(scene.callback.sawNullDispatcher);
}

TEST(BroadphaseGhosts, LoseRemainingPairsOnceWhenWorldIsDestroyed)
{
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    CheckedGhostCallback callback;
    Broadphase broadphase(bruteOptions());
    broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(&callback);
    btSphereShape shape(1);
    btPairCachingGhostObject ghost;
    btCollisionObject body, other;
    {
        btCollisionWorld world(&dispatcher, &broadphase, &configuration);
        for (btCollisionObject* object : {static_cast<btCollisionObject*>(&ghost), &body, &other})
        {
            object->setCollisionShape(&shape);
            world.addCollisionObject(object);
        }
        world.performDiscreteCollisionDetection();
        EXPECT_EQ(callback.live.size(), 3u);
    }
    EXPECT_EQ(callback.removedCount, 3);
    EXPECT_TRUE(callback.live.empty());
    EXPECT_FALSE(callback.sawNullDispatcher);
    EXPECT_EQ(ghost.getNumOverlappingObjects(), 0);
}

TEST(BroadphaseGhosts, TurnProvisionalPairsIntoOrdinaryOnesInUpdate)
{
    GhostWorld scene;
    auto* body = scene.add<btCollisionObject>(vec(0, 0, 0));
    auto* ghost = scene.add<btGhostObject>(vec(0.5, 0, 0));
    EXPECT_EQ(scene.broadphase.stats().ghosts, 1u);
    EXPECT_EQ(scene.broadphase.stats().provisionalPairs, 1u);
    scene.broadphase.calculateOverlappingPairs(&scene.dispatcher);
    EXPECT_EQ(scene.broadphase.stats().provisionalPairs, 0u);
    EXPECT_EQ(scene.callback.addedCount, 1);
    // Touched and left between two updates, but not farther than the margin: the pair stays until they separate.
    scene.move(ghost, vec(9, 0, 0));
    scene.broadphase.calculateOverlappingPairs(&scene.dispatcher);
    scene.move(ghost, vec(1.0, 0, 0));
    scene.move(ghost, vec(1.1, 0, 0));  // a gap of 0.08
    scene.broadphase.calculateOverlappingPairs(&scene.dispatcher);
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 1);
    EXPECT_EQ(scene.broadphase.stats().provisionalPairs, 1u);
    scene.move(body, vec(-0.1, 0, 0));
    scene.broadphase.calculateOverlappingPairs(&scene.dispatcher);
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 0);
    EXPECT_EQ(scene.broadphase.stats().provisionalPairs, 0u);
}

TEST(BroadphaseGhosts, LoseProvisionalPairsOfRemovedProxy)
{
    GhostWorld scene;
    auto* body = scene.add<btCollisionObject>(vec(0, 0, 0));
    auto* ghost = scene.add<btGhostObject>(vec(0.5, 0, 0));
    scene.add<btCollisionObject>(vec(0.8, 0, 0));
    EXPECT_EQ(scene.broadphase.stats().provisionalPairs, 2u);
    scene.world.removeCollisionObject(body);
    EXPECT_EQ(scene.broadphase.stats().provisionalPairs, 1u);
    scene.world.removeCollisionObject(ghost);
    EXPECT_EQ(scene.broadphase.stats().provisionalPairs, 0u);
}

TEST(BroadphaseGhosts, LeaveNoGhostStateToBodyThatReusesTheirRow)
{
    GhostWorld scene;
    auto* ghost = scene.add<btGhostObject>(vec(0, 0, 0));
    scene.add<btGhostObject>(vec(50, 0, 0));
    const std::uint32_t rows = scene.broadphase.table().size();
    scene.world.removeCollisionObject(ghost);
    EXPECT_EQ(scene.broadphase.stats().ghosts, 1u);
    scene.broadphase.calculateOverlappingPairs(&scene.dispatcher);
    auto* body = scene.add<btCollisionObject>(vec(0, 0, 0));
    ASSERT_EQ(scene.broadphase.table().size(), rows) << "it has the row of the ghost";
    auto* other = scene.add<btCollisionObject>(vec(0.5, 0, 0));
    scene.move(body, vec(0.2, 0, 0));
    scene.move(other, vec(0.4, 0, 0));
    EXPECT_EQ(scene.broadphase.stats().ghosts, 1u);
    EXPECT_TRUE(pairsOf(scene.broadphase).empty()) << "pairs of bodies come in the update";
    EXPECT_EQ(updatedPairs(scene.broadphase).size(), 1u);
}

#ifdef BT_USE_DOUBLE_PRECISION
TEST(BroadphaseGhosts, GainPendingPairAtOnceWhenBoxesOverlapExactly)
{
    GhostWorld scene;
    // A float has a spacing of 1 m there.
    const double far = 1e7;
    auto* body = scene.add<btCollisionObject>(vec(far, 0, 0));
    auto* ghost = scene.add<btGhostObject>(vec(far + 1.2, 0, 0));
    scene.broadphase.calculateOverlappingPairs(&scene.dispatcher);
    ASSERT_EQ(scene.broadphase.stats().pendingPairs, 1u) << "the rounded boxes overlap";
    ASSERT_EQ(ghost->getNumOverlappingObjects(), 0);
    scene.move(ghost, vec(far + 0.9, 0, 0));
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 1);
    EXPECT_TRUE(hasPair(scene.broadphase, body->getBroadphaseHandle(), ghost->getBroadphaseHandle()));
}
#endif

TEST(BroadphaseGhosts, ApplyFilterMasksAtOnce)
{
    GhostWorld scene;
    auto* body = scene.add<btCollisionObject>(vec(0, 0, 0));
    auto* ghost = scene.add<btGhostObject>(vec(5, 0, 0));
    ghost->getBroadphaseHandle()->m_collisionFilterMask = 0;
    scene.move(ghost, vec(0.5, 0, 0));
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 0);
    scene.broadphase.calculateOverlappingPairs(&scene.dispatcher);
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 0);
    ghost->getBroadphaseHandle()->m_collisionFilterMask = kAllGroups;
    scene.move(body, vec(0.1, 0, 0));
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 1);
    scene.broadphase.calculateOverlappingPairs(&scene.dispatcher);
    EXPECT_EQ(scene.callback.addedCount, 1);
}

TEST(BroadphaseGhosts, CountOnlyWhileCallbackIsInstalled)
{
    GhostWorld scene;
    scene.world.getPairCache()->setInternalGhostPairCallback(nullptr);
    scene.add<btCollisionObject>(vec(0, 0, 0));
    auto* ghost = scene.add<btGhostObject>(vec(0.5, 0, 0));
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 0);
    EXPECT_EQ(scene.broadphase.stats().ghosts, 0u);
    scene.world.getPairCache()->setInternalGhostPairCallback(&scene.callback);
    auto* late = scene.add<btCollisionObject>(vec(9, 0, 0));
    EXPECT_EQ(scene.broadphase.stats().ghosts, 1u);
    scene.move(late, vec(0.6, 0, 0));
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 1);
    scene.broadphase.calculateOverlappingPairs(&scene.dispatcher);
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 2);
    // Without the callback the ghost is an ordinary body.
    scene.world.getPairCache()->setInternalGhostPairCallback(nullptr);
    scene.broadphase.calculateOverlappingPairs(&scene.dispatcher);
    EXPECT_EQ(scene.broadphase.stats().ghosts, 0u);
}

TEST(BroadphaseGhosts, WorkInBulletsHashedCacheToo)
{
    btHashedOverlappingPairCache cache;
    GhostWorld scene(&cache);
    scene.add<btCollisionObject>(vec(0, 0, 0));
    auto* ghost = scene.add<btGhostObject>(vec(0.5, 0, 0));
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 1);
    scene.move(ghost, vec(9, 0, 0));
    scene.broadphase.calculateOverlappingPairs(&scene.dispatcher);
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 0);
}

TEST(BroadphaseGhosts, WorkInBulletsSortedCacheWhichItselfNeverReportsRemovals)
{
    btSortedOverlappingPairCache cache;
    GhostWorld scene(&cache);
    auto* body = scene.add<btCollisionObject>(vec(0, 0, 0));
    auto* other = scene.add<btCollisionObject>(vec(0.2, 0, 0));
    auto* ghost = scene.add<btGhostObject>(vec(0.5, 0, 0));
    for (int i = 0; i < 3; ++i)
    {
        scene.move(ghost, vec(0.5 + 0.1 * i, 0, 0));
        scene.broadphase.calculateOverlappingPairs(&scene.dispatcher);
    }
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 2);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 3) << "no duplicates";
    scene.world.removeCollisionObject(body);
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 1) << "no dangling pointer to a removed body";
    scene.move(ghost, vec(9, 0, 0));
    scene.broadphase.calculateOverlappingPairs(&scene.dispatcher);
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 0);
    scene.world.removeCollisionObject(other);
}

TEST(BroadphaseGhosts, HaveAtLeastTheirExactOverlapsAtAnyTime)
{
    GhostWorld scene;
    Random random(23);
    const auto place = [&] { return vec(random.point(0, 6)); };
    std::vector<btCollisionObject*> all;
    std::vector<btGhostObject*> ghosts;
    for (int i = 0; i < 100; ++i)
        all.push_back(scene.add<btCollisionObject>(place()));
    for (int i = 0; i < 20; ++i)
    {
        ghosts.push_back(scene.add<btGhostObject>(place()));
        all.push_back(ghosts.back());
    }
    int overlapCount = 0;
    for (int step = 0; step < 300; ++step)
    {
        const btVector3 to = place();
        scene.move(all[random.below(120)], to);
        if (random.chance(0.2f))
            scene.broadphase.calculateOverlappingPairs(&scene.dispatcher);
        for (btGhostObject* ghost : ghosts)
        {
            for (btCollisionObject* object : all)
            {
                if (object == ghost ||
                    !overlapNow(*ghost->getBroadphaseHandle(), *object->getBroadphaseHandle()))
                    continue;
                ++overlapCount;
                ASSERT_LT(ghost->getOverlappingPairs().findLinearSearch(object),
                          ghost->getNumOverlappingObjects());
            }
        }
    }
    EXPECT_GT(overlapCount, 10000);
    EXPECT_GT(scene.callback.removedCount, 100);
}

/// Removes entering objects from the world.
class Collector final : public btGhostObject
{
public:
    void addOverlappingObjectInternal(btBroadphaseProxy* other, btBroadphaseProxy* own) override
    {
        btGhostObject::addOverlappingObjectInternal(other, own);
        ++collectedCount;
        world->removeCollisionObject(static_cast<btCollisionObject*>(other->m_clientObject));
    }

    btCollisionWorld* world = nullptr;
    int collectedCount = 0;
};

TEST(BroadphaseGhosts, RemoveEnteringBodyFromWorldInCallback)
{
    GhostWorld scene;
    auto* collector = scene.add<Collector>(vec(0, 0, 0));
    collector->world = &scene.world;
    for (int body = 1; body <= 4; ++body)
    {
        // Immediately, and in an update.
        auto* object = scene.add<btCollisionObject>(vec(9, 0, 0));
        if (body % 2 == 0)
            scene.move(object, vec(0.5, 0, 0));
        else
            object->getWorldTransform().setOrigin(vec(0.5, 0, 0));
        scene.world.performDiscreteCollisionDetection();
        EXPECT_EQ(collector->collectedCount, body);
        EXPECT_EQ(scene.world.getNumCollisionObjects(), 1);
        EXPECT_EQ(collector->getNumOverlappingObjects(), 0) << "no body that is gone";
        EXPECT_EQ(pairsOf(scene.broadphase), Pairs{});
        EXPECT_TRUE(scene.callback.live.empty());
    }
}

/// Moves entering objects slightly.
class Pusher final : public btGhostObject
{
public:
    void addOverlappingObjectInternal(btBroadphaseProxy* other, btBroadphaseProxy* own) override
    {
        btGhostObject::addOverlappingObjectInternal(other, own);
        auto* object = static_cast<btCollisionObject*>(other->m_clientObject);
        object->getWorldTransform().getOrigin() += vec(0.01, 0, 0);
        world->updateSingleAabb(object);
    }

    btCollisionWorld* world = nullptr;
};

TEST(BroadphaseGhosts, ReportBodyOnceWhenTheyMoveItOnEntry)
{
    GhostWorld scene;
    auto* pusher = scene.add<Pusher>(vec(0, 0, 0));
    pusher->world = &scene.world;
    auto* body = scene.add<btCollisionObject>(vec(9, 0, 0));
    for (int visit = 1; visit <= 3; ++visit)
    {
        scene.move(body, vec(0.5, 0, 0));
        EXPECT_EQ(pusher->getNumOverlappingObjects(), 1);
        EXPECT_EQ(scene.callback.addedCount, visit);
        scene.move(body, vec(9, 0, 0));
        scene.broadphase.calculateOverlappingPairs(&scene.dispatcher);
        EXPECT_EQ(pusher->getNumOverlappingObjects(), 0);
        EXPECT_EQ(scene.callback.removedCount, visit);
    }
}

TEST(BroadphaseGhosts, KeepNoPairWhenTeleportedInAndOutAfterRefusal)
{
    struct Gate final : btOverlapFilterCallback
    {
        bool needBroadphaseCollision(btBroadphaseProxy*, btBroadphaseProxy*) const override { return isOpen; }
        bool isOpen = false;
    } gate;
    GhostWorld scene;
    scene.world.getPairCache()->setOverlapFilterCallback(&gate);
    scene.add<btCollisionObject>(vec(0, 0, 0));
    auto* ghost = scene.add<btGhostObject>(vec(0.5, 0, 0));
    scene.world.performDiscreteCollisionDetection();
    for (int update = 0; update < 2; ++update)
    {
        scene.move(ghost, vec(10, 0, 0));
        scene.world.performDiscreteCollisionDetection();
    }
    gate.isOpen = true;
    scene.move(ghost, vec(0.5, 0, 0));
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 1);
    scene.move(ghost, vec(20, 0, 0));
    scene.world.performDiscreteCollisionDetection();
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 0);
    EXPECT_EQ(pairsOf(scene.broadphase), Pairs{});
    scene.world.getPairCache()->setOverlapFilterCallback(nullptr);
}

constexpr auto kInfinity = std::numeric_limits<btScalar>::infinity();

TEST(BroadphaseGhosts, OverlapInfiniteBoxOnlyWhenTheirOwnBoxIsValid)
{
    const btVector3 infinite(kInfinity, kInfinity, kInfinity);
    for (int ghostCount = 1; ghostCount <= 9; ++ghostCount)
    {
        GhostWorld scene;
        std::vector<btGhostObject*> ghosts;
        for (int i = 0; i < ghostCount; ++i)
            ghosts.push_back(scene.add<btGhostObject>(vec(4 * i, 0, 0)));
        auto* inverted = scene.add<btGhostObject>(vec(0, 9, 0));
        scene.broadphase.setAabb(inverted->getBroadphaseHandle(), vec(1, 9, 1), vec(-1, 8, -1), nullptr);
        auto* body = scene.add<btCollisionObject>(vec(0, 50, 0));
        scene.broadphase.setAabb(body->getBroadphaseHandle(), -infinite, infinite, nullptr);
        for (int update = 0; update < 2; ++update)
        {
            for (const btGhostObject* ghost : ghosts)
                EXPECT_EQ(ghost->getNumOverlappingObjects(), 1) << ghostCount;
            EXPECT_EQ(inverted->getNumOverlappingObjects(), 0);
            scene.broadphase.calculateOverlappingPairs(&scene.dispatcher);
        }
    }
}

TEST(BroadphaseGhosts, LoseProvisionalPairWhenTheirBoxBecomesInvalid)
{
    const btVector3 infinite(kInfinity, kInfinity, kInfinity);
    GhostWorld scene;
    auto* body = scene.add<btCollisionObject>(vec(0, 50, 0));
    scene.broadphase.setAabb(body->getBroadphaseHandle(), -infinite, infinite, nullptr);
    auto* ghost = scene.add<btGhostObject>(vec(0, 0, 0));
    ASSERT_EQ(ghost->getNumOverlappingObjects(), 1);
    scene.broadphase.setAabb(ghost->getBroadphaseHandle(), vec(1, 1, 1), vec(-1, -1, -1), nullptr);
    scene.broadphase.calculateOverlappingPairs(&scene.dispatcher);
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 0);
}

/// Queries overlaps and moves a ghost whenever a pair of a body is removed.
struct Busybody final : btGhostPairCallback
{
    void* removeOverlappingPair(btBroadphaseProxy* a, btBroadphaseProxy* b, btDispatcher* dispatcher) override
    {
        btGhostPairCallback::removeOverlappingPair(a, b, dispatcher);
        if ((a != dying && b != dying) || ++removals > 20)
            return nullptr;
        BoxHits hits;
        broadphase->aabbTest(vec(-9, -9, -9), vec(9, 9, 9), hits);
        wasFound = wasFound || std::count(hits.ids.begin(), hits.ids.end(), idOf(dying)) != 0;
        moveCube(*broadphase, ghost, vec(0.001 * removals, 0, 0));
        return nullptr;
    }
    Broadphase* broadphase = nullptr;
    btBroadphaseProxy *dying = nullptr, *ghost = nullptr;
    int removals = 0;
    bool wasFound = false;
};

TEST(BroadphaseGhosts, GainNoPairWithProxyThatIsBeingDestroyed)
{
    Broadphase broadphase(bruteOptions());
    Busybody callback;
    btGhostObject ghost;
    btCollisionObject first, second;
    broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(&callback);
    callback.broadphase = &broadphase;
    callback.ghost = addCube(broadphase, vec(0, 0, 0), 0.5, 1, kAllGroups, &ghost);
    addCube(broadphase, vec(0.2, 0, 0), 0.5, 1, kAllGroups, &first);
    callback.dying = addCube(broadphase, vec(0.1, 0, 0), 0.5, 1, kAllGroups, &second);
    ASSERT_EQ(updatedPairs(broadphase).size(), 3u);
    broadphase.destroyProxy(callback.dying, nullptr);
    EXPECT_EQ(callback.removals, 2);
    EXPECT_FALSE(callback.wasFound);
    EXPECT_EQ(pairsOf(broadphase), (Pairs{{1, 2}}));
    EXPECT_EQ(updatedPairs(broadphase), (Pairs{{1, 2}}));
    broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(nullptr);
}
}  // namespace
}  // namespace cullet::test
