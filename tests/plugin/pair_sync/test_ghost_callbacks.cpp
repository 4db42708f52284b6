// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/pair_sync/ghost_world.h"

namespace cullet::test
{
namespace
{
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
