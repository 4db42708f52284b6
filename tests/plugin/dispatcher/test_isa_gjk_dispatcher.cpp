// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/distance_oracle.h"
#include "cullet/tests/plugin/convex/core_oracle.h"
#include "cullet/tests/plugin/dispatcher/doomed_body.h"
#include "cullet/tests/plugin/random_motion.h"

#include <gtest/gtest.h>

#include <deque>
#include <optional>
#include <set>
#include <utility>

namespace cullet::test
{
namespace
{
/// Bodies of changing shapes, all in pairs, dispatched with caches and compared with the exact distances.
class RestlessCrowd
{
public:
    static constexpr int kBodies = 24;

    RestlessCrowd(unsigned seed, double far) : m_engine(seed), m_far(far)
    {
        useOneThreshold(m_dispatcher);
        for (int i = 0; i < kBodies; ++i)
        {
            m_shapes.push_back(makeHullShape(i % 3 == 0 ? boxPoints(0.5, 0.4, 0.3)
                                                        : ballPoints(20, 0.5, seed + unsigned(i) / 2)));
            Entry& entry = m_entries.emplace_back();
            entry.body.setCollisionShape(i % 8 == 7 ? static_cast<btCollisionShape*>(&m_box)
                                                    : m_shapes.back().get());
            entry.body.setUserIndex(i);
            entry.proxy.m_clientObject = &entry.body;
            entry.proxy.m_uniqueId = i + 1;
            const btVector3 origin = anywhere();
            entry.body.setWorldTransform(btTransform(randomRotation(m_engine), origin));
        }
        for (std::size_t i = 0; i < m_entries.size(); ++i)
        {
            for (std::size_t k = 0; k < i; ++k)
                m_cache.addOverlappingPair(&m_entries[k].proxy, &m_entries[i].proxy);
        }
    }
    ~RestlessCrowd()
    {
        for (Entry& entry : m_entries)
            m_cache.removeOverlappingPairsContainingProxy(&entry.proxy, &m_dispatcher);
    }

    /// @return touching pairs that the dispatcher misses
    int step()
    {
        for (Entry& entry : m_entries)
            move(entry);
        if (m_frame++ % 5 == 0)
            changeAShape();
        m_dispatcher.dispatchAllCollisionPairs(&m_cache, m_info, &m_dispatcher);
        stillTotal += m_dispatcher.stillPairs();
        pairsTotal += std::uint64_t(m_cache.getNumOverlappingPairs());
        const std::set<std::pair<int, int>> ours = touching(m_dispatcher);
        const std::set<std::pair<int, int>> truth = touchingExactly();
        int missing = 0;
        for (const auto& pair : truth)
        {
            missing += ours.count(pair) == 0;
            began += m_before.count(pair) == 0;
        }
        m_before = truth;
        return missing;
    }

    std::uint64_t stillTotal = 0, pairsTotal = 0;
    int began = 0;  ///< pairs that did not touch in the previous frame

private:
    struct Entry
    {
        btCollisionObject body;
        btBroadphaseProxy proxy{vec(0, 0, 0), vec(0, 0, 0), nullptr, 1, -1};
    };

    btVector3 anywhere()
    {
        // From z to x, as drawVec(); so below.
        const double z = random(m_engine, 0, 3.4), y = random(m_engine, 0, 3.4);
        return vec(m_far + random(m_engine, 0, 3.4), y, z);
    }

    void move(Entry& entry)
    {
        const btTransform from = entry.body.getWorldTransform();
        const unsigned kind = m_engine() % 100;
        if (kind < 64)
            return;
        const auto movedUpTo = [&](double mostAngle, double mostShift)
        {
            const double shift = random(m_engine, 0, mostShift), away = random(m_engine, 0, 0.5);
            return moved(from, random(m_engine, 0, mostAngle), away, shift, m_engine);
        };
        if (kind < 96)
            entry.body.setWorldTransform(movedUpTo(0.01, 0.003));
        else if (kind < 98)
            entry.body.setWorldTransform(movedUpTo(0.3, 0.1));
        else if (kind < 99)
            entry.body.getWorldTransform() = moved(from, random(m_engine, 0, 6), 0, 0, m_engine);
        else
            entry.body.getWorldTransform().setOrigin(anywhere());
    }

    void changeAShape()
    {
        const auto i = std::size_t(m_engine() % m_shapes.size());
        btConvexHullShape& shape = *m_shapes[i];
        switch (m_engine() % 5)
        {
            case 0:
                return shape.setMargin(btScalar(random(m_engine, 0, 0.1)));
            case 1:
            {
                const double z = random(m_engine, -1.3, -0.7), y = random(m_engine, 0.7, 1.3);
                return shape.setLocalScaling(vec(random(m_engine, 0.7, 1.3), y, z));
            }
            case 2:
                shape.getUnscaledPoints()[m_engine() % 8] *= btScalar(random(m_engine, 0.8, 1.25));
                return shape.recalcLocalAabb();
            case 3:
                return m_entries[i].body.setCollisionShape(m_shapes[m_engine() % m_shapes.size()].get());
            default:
                return m_box.setLocalScaling(vec(random(m_engine, 0.8, 1.2), 1, 1));
        }
    }

    /// Bullet sets the relative threshold at the creation of a manifold, from the shapes at that time.
    static void useOneThreshold(btCollisionDispatcher& dispatcher)
    {
        dispatcher.setDispatcherFlags(dispatcher.getDispatcherFlags() &
                                      ~btCollisionDispatcher::CD_USE_RELATIVE_CONTACT_BREAKING_THRESHOLD);
    }

    static std::set<std::pair<int, int>> touching(btCollisionDispatcher& dispatcher)
    {
        std::set<std::pair<int, int>> pairs;
        for (int i = 0; i < dispatcher.getNumManifolds(); ++i)
        {
            const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
            for (int k = 0; k < manifold.getNumContacts(); ++k)
            {
                if (manifold.getContactPoint(k).getDistance() < manifold.getContactBreakingThreshold())
                    pairs.emplace(manifold.getBody0()->getUserIndex(), manifold.getBody1()->getUserIndex());
            }
        }
        return pairs;
    }

    /// Pairs so near that rounding of a manifold's points cannot remove the contact.
    std::set<std::pair<int, int>> touchingExactly() const
    {
        const double threshold = (m_far > 0 ? 0.8 : 0.99) * double(gContactBreakingThreshold);
        std::vector<CoreOracle> cores;
        for (const Entry& entry : m_entries)
            cores.emplace_back(*entry.body.getCollisionShape(), entry.body.getWorldTransform());
        std::set<std::pair<int, int>> found;
        for (std::size_t i = 0; i < cores.size(); ++i)
        {
            for (std::size_t k = 0; k < i; ++k)
            {
                const double limit = threshold + marginOf(m_entries[i]) + marginOf(m_entries[k]);
                if (areNear(m_entries[i], m_entries[k], limit) &&
                    double(DistanceOracle(cores[k].posed(), cores[i].posed()).solve().upper) < limit)
                    found.emplace(int(k), int(i));
            }
        }
        return found;
    }

    static double marginOf(const Entry& entry) { return double(entry.body.getCollisionShape()->getMargin()); }

    /// Compares bounding balls.
    static bool areNear(const Entry& a, const Entry& b, double limit)
    {
        const auto reachOf = [](const Entry& entry)
        {
            btVector3 centre;
            btScalar radius;
            entry.body.getCollisionShape()->getBoundingSphere(centre, radius);
            return double(radius + centre.length());
        };
        const btVector3 apart =
            a.body.getWorldTransform().getOrigin() - b.body.getWorldTransform().getOrigin();
        return double(apart.length()) < reachOf(a) + reachOf(b) + limit;
    }

    std::mt19937 m_engine;
    double m_far;
    btDefaultCollisionConfiguration m_configuration;
    Dispatcher m_dispatcher{&m_configuration};
    btDispatcherInfo m_info;
    btHashedOverlappingPairCache m_cache;
    btBoxShape m_box{vec(0.4, 0.4, 0.4)};
    std::vector<std::unique_ptr<btConvexHullShape>> m_shapes;
    std::deque<Entry> m_entries;
    std::set<std::pair<int, int>> m_before;
    int m_frame = 0;
};
}  // namespace

TEST(IsaGjkDispatcher, LeavesOutNoPairThatTouchesHoweverBodiesAndShapesChange)
{
    for (const double far : {0.0, 1000.0})
    {
        for (unsigned seed = 1; seed <= 3; ++seed)
        {
            RestlessCrowd crowd(seed, far);
            for (int frame = 0; frame < 120; ++frame)
                EXPECT_EQ(crowd.step(), 0) << "seed " << seed << ", frame " << frame << ", far " << far;
            EXPECT_GT(crowd.stillTotal, crowd.pairsTotal / 4);
            EXPECT_GT(crowd.began, 40);
        }
    }
}

TEST(IsaGjkDispatcher, KeepsTrackingPairsWhenRegisteredAgain)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    ConvexWorld world(Narrow::Dispatcher);
    world.addIdleRow(cube.get());
    world.step(3);
    auto& dispatcher = static_cast<Dispatcher&>(world.dispatcher());
    EXPECT_EQ(dispatcher.stillPairs(), 4u);
    EXPECT_EQ(dispatcher.idlePairs(), 4u);
    registerIsaGjk(dispatcher);
    world.step();
    EXPECT_EQ(dispatcher.stillPairs(), 4u);
    // Its pair is removed, and with it the pair that tracked the body.
    world.world.removeRigidBody(world.bodies[0].get());
    world.step();
    EXPECT_EQ(dispatcher.stillPairs(), 3u);
    world.world.addRigidBody(world.bodies[0].get());
    world.step();
    EXPECT_EQ(dispatcher.stillPairs(), 3u) << "the new pair has no proof yet";
    EXPECT_EQ(dispatcher.idlePairs(), 4u);
    world.step();
    EXPECT_EQ(dispatcher.stillPairs(), 4u);
}

TEST(IsaGjkDispatcher, WakesNeighbourOfBodyThatBecomesKinematicAsInBullet)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    const btQuaternion turn(vec(0, 0, 1), btScalar(0.785));
    for (const Narrow narrow : {Narrow::Stock, Narrow::Dispatcher})
    {
        for (const int stepsBefore : {0, 1, 3})
        {
            SCOPED_TRACE(testing::Message() << int(narrow) << ", after " << stepsBefore << " steps");
            ConvexWorld world(narrow);
            world.world.setGravity(vec(0, 0, 0));
            // Their boxes overlap.
            btRigidBody& body = world.add(cube.get(), 1, btTransform(turn, vec(0, 0, 0)));
            btRigidBody& neighbour = world.add(cube.get(), 1, btTransform(turn, vec(1.1, 1.1, 0)));
            world.step(stepsBefore);
            if (narrow == Narrow::Dispatcher)
            {
                EXPECT_EQ(world.dispatcher().getNumManifolds(), 0);
            }
            body.setCollisionFlags(body.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
            body.setActivationState(DISABLE_DEACTIVATION);
            neighbour.setActivationState(ISLAND_SLEEPING);
            world.step(2);
            EXPECT_EQ(world.dispatcher().getNumManifolds(), 1);
            EXPECT_EQ(neighbour.getActivationState(), ACTIVE_TAG);
            world.step(2);
            if (narrow == Narrow::Dispatcher)
            {
                EXPECT_EQ(static_cast<Dispatcher&>(world.dispatcher()).idlePairs(), 1u) << "has a manifold";
            }
        }
    }
}

TEST(IsaGjkDispatcher, FindsTheContactWithAPlateThatHasTurnedOver)
{
    // The face of the last query is then on the far side.
    const auto plate = makeHullShape(boxPoints(2, 0.1, 2));
    const auto top =
        makeHullShape({vec(0, -0.5, 0), vec(0.4, 0.4, 0.4), vec(-0.4, 0.4, 0.3), vec(0, 0.4, -0.4)});
    ConvexWorld world(Narrow::Dispatcher);
    btRigidBody &below = world.add(plate.get(), 1, vec(0, 0, 0)),
                &above = world.add(top.get(), 1, vec(0.3, 0.69, 0.2));
    world.world.performDiscreteCollisionDetection();
    ASSERT_EQ(world.contactsOf(below, above), 1);
    below.setWorldTransform(btTransform(btQuaternion(vec(1, 0, 0), SIMD_PI), vec(0, 0, 0)));
    world.world.performDiscreteCollisionDetection();
    EXPECT_EQ(world.contactsOf(below, above), 1) << "turned";
    plate->setLocalScaling(vec(1, -1, 1));
    world.world.performDiscreteCollisionDetection();
    EXPECT_EQ(world.contactsOf(below, above), 1) << "mirrored";
}

TEST(IsaGjkDispatcher, RefreshesForeignPointsInManifoldOfIdlePair)
{
    // Like Bullet's importer, after a dispatch at the saved poses.
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    ConvexWorld world(Narrow::Dispatcher);
    btRigidBody &a = world.add(cube.get(), 1, vec(0, 0, 0)), &b = world.add(cube.get(), 1, vec(1.09, 0, 0));
    world.world.performDiscreteCollisionDetection();
    ASSERT_GT(world.contactsOf(a, b), 0);
    const btManifoldPoint saved = world.manifoldOf(a, b)->getContactPoint(0);
    b.setWorldTransform(btTransform(btQuaternion::getIdentity(), vec(1.115, 0, 0)));
    for (int i = 0; i < 3; ++i)
        world.world.performDiscreteCollisionDetection();
    ASSERT_EQ(static_cast<Dispatcher&>(world.dispatcher()).idlePairs(), 1u);
    ASSERT_EQ(world.contactsOf(a, b), 0);

    btManifoldArray manifolds;
    world.world.getPairCache()->getOverlappingPairArray()[0].m_algorithm->getAllContactManifolds(manifolds);
    ASSERT_EQ(manifolds.size(), 1);
    manifolds[0]->addManifoldPoint(saved);
    world.world.performDiscreteCollisionDetection();
    EXPECT_EQ(world.contactsOf(a, b), 0) << "a point of a gap beyond the threshold";
    world.world.performDiscreteCollisionDetection();
    EXPECT_EQ(static_cast<Dispatcher&>(world.dispatcher()).idlePairs(), 1u);
}

TEST(IsaGjkDispatcher, ReadsNoBodyOfPairThatWasRemovedWithoutDispatcher)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    ConvexWorld world(Narrow::Dispatcher);
    auto& dispatcher = static_cast<Dispatcher&>(world.dispatcher());
    world.addIdleRow(cube.get());
    DoomedBody doomed(*cube, vec(-1.12, 0, 0));
    world.world.addCollisionObject(doomed.get());
    world.step(3);
    EXPECT_EQ(dispatcher.stillPairs(), 5u);
    // Its algorithm leaks, as in Bullet.
    world.world.getPairCache()->removeOverlappingPairsContainingProxy(doomed.get()->getBroadphaseHandle(),
                                                                      nullptr);
    world.world.removeCollisionObject(doomed.get());
    doomed.destroy();
    world.step();
    EXPECT_EQ(dispatcher.idlePairs(), 4u);
    world.step(2);
    EXPECT_EQ(dispatcher.stillPairs(), 4u) << "the others are watched anew";
    world.world.removeRigidBody(world.bodies[0].get());
    world.step();
    EXPECT_EQ(dispatcher.stillPairs(), 3u) << "and counted right";
}

TEST(IsaGjkDispatcher, ReadsNoBodyOfEarlierCacheAtSameAddress)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    btDefaultCollisionConfiguration configuration;
    Dispatcher dispatcher(&configuration);
    const btDispatcherInfo info;
    // All caches have the same address.
    std::optional<btHashedOverlappingPairCache> cache;
    std::deque<DoomedBody> rows[3];
    for (std::deque<DoomedBody>& row : rows)
    {
        cache.emplace();
        addDoomedRow(row, *cube, *cache);
        for (const std::uint64_t still : {0u, 4u, 4u})
        {
            dispatcher.dispatchAllCollisionPairs(&*cache, info, &dispatcher);
            EXPECT_EQ(dispatcher.idlePairs(), 4u);
            EXPECT_LE(dispatcher.stillPairs(), still);
        }
        EXPECT_EQ(dispatcher.stillPairs(), 4u);
        for (DoomedBody& body : row)
            body.destroy();
    }
}

TEST(IsaGjkDispatcher, LeavesPairsOfAnotherDispatcherToBulletsPath)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    btDefaultCollisionConfiguration configuration;
    Dispatcher first(&configuration), second(&configuration);
    const btDispatcherInfo info;
    btHashedOverlappingPairCache cache;
    std::deque<DoomedBody> row;
    addDoomedRow(row, *cube, cache);
    for (int i = 0; i < 3; ++i)
        first.dispatchAllCollisionPairs(&cache, info, &first);
    EXPECT_EQ(first.stillPairs(), 4u);
    second.dispatchAllCollisionPairs(&cache, info, &second);
    EXPECT_EQ(second.idlePairs(), 0u);
    EXPECT_EQ(first.stats().separatedTotal, 16u);
    for (int i = 0; i < 3; ++i)
        first.dispatchAllCollisionPairs(&cache, info, &first);
    EXPECT_EQ(first.stillPairs(), 4u);
    for (DoomedBody& body : row)
        cache.removeOverlappingPairsContainingProxy(&body.proxy, &first);
}
}  // namespace cullet::test
