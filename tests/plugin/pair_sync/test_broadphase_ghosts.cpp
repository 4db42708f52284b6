// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/pair_sync/ghost_world.h"

namespace cullet::test
{
namespace
{
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
    // Most bodies are at the origin, which therefore stays that of the table.
    for (int i = 0; i < 3; ++i)
        scene.add<btCollisionObject>(vec(0, 10 * i, 0));
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

/// Ghosts and bodies that walk, jump, come and go in a cube of some edge.
class RestlessGhosts
{
public:
    explicit RestlessGhosts(double edge) : m_edge(static_cast<float>(edge))
    {
        for (int i = 0; i < 100; ++i)
            m_bodies.push_back(m_scene.add<btCollisionObject>(anywhere()));
        for (int i = 0; i < 40; ++i)
            m_ghosts.push_back(m_scene.add<btGhostObject>(anywhere()));
    }

    void changeOne()
    {
        const bool isGhost = m_random.chance(0.5f);
        btCollisionObject*& object = isGhost ? m_ghosts[m_random.below(40)] : m_bodies[m_random.below(100)];
        if (m_random.chance(0.05f))
        {
            m_scene.world.removeCollisionObject(object);
            object =
                isGhost ? m_scene.add<btGhostObject>(anywhere()) : m_scene.add<btCollisionObject>(anywhere());
            return;
        }
        const bool jumps = m_random.chance(0.1f);
        const btVector3 from = object->getWorldTransform().getOrigin();
        m_scene.move(object, jumps ? anywhere() : from + vec(m_random.point(-0.1f, 0.1f)));
        if (m_random.chance(0.02f))
            m_scene.broadphase.calculateOverlappingPairs(&m_scene.dispatcher);
    }

    /// The overlaps of all ghosts now, each of which the ghost must know.
    int countOverlaps() const
    {
        int overlaps = 0;
        for (const btCollisionObject* ghost : m_ghosts)
        {
            for (const std::vector<btCollisionObject*>* others : {&m_bodies, &m_ghosts})
            {
                for (btCollisionObject* other : *others)
                    overlaps += isKnown(*static_cast<const btGhostObject*>(ghost), *other);
            }
        }
        return overlaps;
    }

    BroadphaseStats stats() const { return m_scene.broadphase.stats(); }

private:
    btVector3 anywhere() { return vec(m_random.point(0, m_edge)); }

    static bool isKnown(const btGhostObject& ghost, btCollisionObject& other)
    {
        if (&ghost == &other || !overlapNow(*ghost.getBroadphaseHandle(), *other.getBroadphaseHandle()))
            return false;
        const auto& known = const_cast<btGhostObject&>(ghost).getOverlappingPairs();
        EXPECT_LT(known.findLinearSearch(&other), known.size());
        return true;
    }

    GhostWorld m_scene;
    Random m_random{40};
    float m_edge;
    std::vector<btCollisionObject*> m_bodies, m_ghosts;
};

TEST(BroadphaseGhosts, KnowAllOverlapsWhileTheyWalkAndOthersJumpComeAndGo)
{
    // Up to a few neighbours a ghost, and more than a list of them takes.
    for (const double edge : {8.0, 2.0})
    {
        RestlessGhosts scene(edge);
        int overlaps = 0;
        for (int change = 0; change < 3000 && !testing::Test::HasFailure(); ++change)
        {
            scene.changeOne();
            overlaps += scene.countOverlaps();
        }
        EXPECT_GT(overlaps, 30000) << "edge " << edge << ", seed 40";
    }
}

TEST(BroadphaseGhosts, GainPairAgainWhenTheyWalkOnAfterApplicationTookItOut)
{
    GhostWorld scene;
    auto* other = scene.add<btCollisionObject>(vec(0, 0, 0));
    auto* ghost = scene.add<btGhostObject>(vec(0.5, 0, 0));
    for (const double x : {0.51, 0.52, 0.53})
        scene.move(ghost, vec(x, 0, 0));
    ASSERT_EQ(ghost->getNumOverlappingObjects(), 1);
    scene.world.getPairCache()->removeOverlappingPair(ghost->getBroadphaseHandle(),
                                                      other->getBroadphaseHandle(), &scene.dispatcher);
    ASSERT_EQ(ghost->getNumOverlappingObjects(), 0);
    scene.move(ghost, vec(0.54, 0, 0));
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 1);
}

TEST(BroadphaseGhosts, GainPairAgainAtOnceWhereTheyWalkBackAfterUpdateHasRemovedIt)
{
    GhostWorld scene;
    auto* other = scene.add<btGhostObject>(vec(0, 0, 0));
    auto* ghost = scene.add<btGhostObject>(vec(0.5, 0, 0));
    for (const double x : {0.51, 0.52, 0.53, 0.8, 1.2})
        scene.move(ghost, vec(x, 0, 0));
    ASSERT_EQ(ghost->getNumOverlappingObjects(), 1) << "until the update";
    scene.broadphase.calculateOverlappingPairs(&scene.dispatcher);
    ASSERT_EQ(ghost->getNumOverlappingObjects(), 0);
    scene.move(ghost, vec(0.9, 0, 0));
    EXPECT_EQ(ghost->getNumOverlappingObjects(), 1);
    EXPECT_EQ(other->getNumOverlappingObjects(), 1);
}

TEST(BroadphaseGhosts, DoNotAskFilterAgainForRefusedBodyWithinItsSkin)
{
    struct Refusal final : btOverlapFilterCallback
    {
        bool needBroadphaseCollision(btBroadphaseProxy*, btBroadphaseProxy*) const override
        {
            ++askedCount;
            return false;
        }
        mutable int askedCount = 0;
    } filter;
    GhostWorld scene;
    scene.world.getPairCache()->setOverlapFilterCallback(&filter);
    scene.add<btCollisionObject>(vec(0, 0, 0));
    auto* ghost = scene.add<btGhostObject>(vec(0.5, 0, 0));
    scene.broadphase.calculateOverlappingPairs(&scene.dispatcher);
    const int before = filter.askedCount;
    EXPECT_GE(before, 1);
    for (const double x : {0.51, 0.52, 0.48})
        scene.move(ghost, vec(x, 0, 0));
    EXPECT_EQ(filter.askedCount, before);
    scene.move(ghost, vec(0.7, 0, 0));
    EXPECT_EQ(filter.askedCount, before + 1) << "beyond the margin";
    scene.world.getPairCache()->setOverlapFilterCallback(nullptr);
}
}  // namespace
}  // namespace cullet::test
