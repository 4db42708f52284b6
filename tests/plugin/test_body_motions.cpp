// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "plugin/body_motions.h"
#include "tests/plugin/convex_world.h"

#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <limits>
#include <set>
#include <utility>

namespace cullet::test
{
namespace
{
double random(std::mt19937& engine, double low, double high)
{
    return std::uniform_real_distribution<double>(low, high)(engine);
}

/// Turned about a point that may be far away, and shifted.
btTransform moved(const btTransform& from, double angle, double away, double shift, std::mt19937& engine)
{
    const auto direction = [&engine] { return quatRotate(randomRotation(engine), vec(1, 0, 0)); };
    const btVector3 about = from.getOrigin() + btScalar(away) * direction();
    const btTransform turn(btQuaternion(direction(), btScalar(angle)));
    btTransform to = turn * btTransform(from.getBasis(), from.getOrigin() - about);
    to.setOrigin(to.getOrigin() + about + btScalar(shift) * direction());
    return to;
}

using Wide = long double;

Wide distance(const btTransform& a, const btTransform& b, const btVector3& p)
{
    Wide sum = 0;
    for (int i = 0; i < 3; ++i)
    {
        Wide d = Wide(a.getOrigin()[i]) - Wide(b.getOrigin()[i]);
        for (int k = 0; k < 3; ++k)
            d += (Wide(a.getBasis()[i][k]) - Wide(b.getBasis()[i][k])) * Wide(p[k]);
        sum += d * d;
    }
    return std::sqrt(sum);
}

/// One body, looked at in a pass of its own each time.
class Watched
{
public:
    explicit Watched(btCollisionShape& shape)
    {
        body.setCollisionShape(&shape);
        body.setWorldTransform(btTransform::getIdentity());
        m_place = m_motions.acquire(body);
        update();
    }
    ~Watched() { m_motions.release(m_place); }

    float update(bool isGap = false)
    {
        m_motions.use(m_place);
        m_motions.update(0, m_motions.size(), ++s_pass, isGap);
        return m_motions.of(m_place);
    }
    /// So that the place is known.
    void rest()
    {
        update();
        EXPECT_EQ(update(), 0.0f);
    }
    float updateUnused()
    {
        m_motions.update(0, m_motions.size(), ++s_pass, false);
        return m_motions.of(m_place);
    }

    btCollisionObject body;

private:
    static inline std::uint64_t s_pass = std::uint64_t(1) << 40;
    BodyMotions m_motions;
    std::uint32_t m_place;
};
}  // namespace

TEST(BodyMotions, BoundTheMotionOfEveryPointOfTheCore)
{
    std::mt19937 engine(21);
    const auto ball = makeHullShape(ballPoints(30, 0.7, 3));
    ball->setLocalScaling(vec(1, -2, 0.25));
    Watched watched(*ball);
    int tight = 0, turned = 0;
    for (int i = 0; i < 3000; ++i)
    {
        const double size = std::pow(10.0, random(engine, -6, 0.5));
        const double far = i % 3 == 0 ? 1e4 : 1.0;
        btTransform from(randomRotation(engine), vec(far, -far, random(engine, -far, far)));
        btTransform to = moved(from, size, i % 2 == 0 ? 0 : random(engine, 0, 10), size * (i % 5), engine);
        // Matrices that are no rotations count too.
        if (i % 7 == 0)
            to.setBasis(to.getBasis().scaled(vec(1 + size, 1, 1 - 2 * size)));
        watched.body.setWorldTransform(from);
        watched.rest();
        watched.body.setWorldTransform(to);
        const double bound = double(watched.update());
        Wide largest = 0;
        for (int p = 0; p < ball->getNumPoints(); ++p)
        {
            const btVector3 point = ball->getScaledPoint(p);
            EXPECT_LE(distance(from, to, point), Wide(bound)) << i;
        }
        for (int k = 0; k < 6; ++k)
            largest = std::max(
                largest,
                distance(from, to, btScalar(k % 2 ? 1.3 : -1.3) * vec(k / 2 == 0, k / 2 == 1, k / 2 == 2)));
        tight += bound < 2 * double(largest);
        turned += size > 0.5;
    }
    EXPECT_GT(tight, 2000);
    EXPECT_GT(turned, 200);
}

TEST(BodyMotions, WhateverChangesTheCoreIsAnUnknownMotion)
{
    const float unknown = std::numeric_limits<float>::infinity();
    auto hull = makeHullShape(ballPoints(40, 0.5, 1));
    auto other = makeHullShape(ballPoints(40, 0.5, 1));
    btBoxShape box(vec(1, 1, 1));
    btSphereShape sphere(1);
    btCapsuleShape capsule(1, 1);
    Watched watched(*hull);
    const auto expectUnknownOnce = [&](const char* what)
    {
        EXPECT_EQ(watched.update(), unknown) << what;
        EXPECT_EQ(watched.update(), 0.0f) << what;
    };
    watched.rest();
    hull->setMargin(btScalar(0.1));
    expectUnknownOnce("margin");
    hull->setLocalScaling(vec(1, 1, 2));
    expectUnknownOnce("scaling");
    hull->addPoint(vec(0, 2, 0));
    expectUnknownOnce("a point more");
    hull->getUnscaledPoints()[40].setY(btScalar(1.5));
    expectUnknownOnce("a point elsewhere");
    hull->getUnscaledPoints()[40].setY(btScalar(2));
    expectUnknownOnce("a point back again");
    watched.body.setCollisionShape(other.get());
    expectUnknownOnce("another hull");
    watched.body.setCollisionShape(&box);
    expectUnknownOnce("a box");
    box.setLocalScaling(vec(2, 1, 1));
    expectUnknownOnce("scaling of a box");
    watched.body.setCollisionShape(&sphere);
    expectUnknownOnce("a sphere");
    sphere.setUnscaledRadius(2);
    expectUnknownOnce("the radius of a sphere");
    EXPECT_EQ(watched.update(true), unknown) << "updates were missed";
    EXPECT_EQ(watched.update(), 0.0f);
    watched.body.getWorldTransform().setOrigin(vec(std::numeric_limits<double>::quiet_NaN(), 0, 0));
    EXPECT_FALSE(watched.update() < unknown);
    watched.body.setCollisionShape(&capsule);
    for (int i = 0; i < 3; ++i)
        EXPECT_EQ(watched.update(), unknown) << "a kind that is not watched";
}

TEST(BodyMotions, OfNoUseAreLeftAloneForSomeTime)
{
    btSphereShape sphere(1);
    Watched watched(sphere);
    watched.rest();
    int unknown = 0;
    for (int i = 0; i < 160; ++i)
    {
        // What happens in a pause must not be taken for rest.
        watched.body.getWorldTransform().getOrigin() += vec(1, 0, 0);
        const float moved = watched.updateUnused();
        unknown += moved == std::numeric_limits<float>::infinity();
        EXPECT_GE(moved, 1.0f);
    }
    EXPECT_EQ(unknown, 150);
    for (int i = 0; i < 20; ++i)
        watched.update();
    EXPECT_EQ(watched.update(), 0.0f) << "found again";
}

TEST(BodyMotions, ServeOneCacheAtATimeAndReuseTheirPlaces)
{
    btSphereShape sphere(1);
    btCollisionObject bodies[3];
    for (btCollisionObject& body : bodies)
        body.setCollisionShape(&sphere);
    btHashedOverlappingPairCache first, second;
    BodyMotions motions;
    EXPECT_TRUE(motions.serves(&first));
    EXPECT_TRUE(motions.serves(&second));
    const std::uint32_t a = motions.acquire(bodies[0]), b = motions.acquire(bodies[1]);
    EXPECT_NE(a, b);
    EXPECT_EQ(motions.acquire(bodies[0]), a);
    EXPECT_FALSE(motions.serves(&first));
    motions.release(a);
    motions.release(b);
    EXPECT_EQ(motions.acquire(bodies[0]), a) << "still watched";
    EXPECT_EQ(motions.acquire(bodies[2]), b);
    motions.release(a);
    motions.release(a);
    motions.release(b);
    EXPECT_TRUE(motions.serves(&first));
    EXPECT_EQ(motions.size(), 2u);
}

TEST(Leeway, IsNeverMoreThanWhatTheMotionsHaveLeft)
{
    std::mt19937 engine(4);
    int lasted = 0;
    for (int round = 0; round < 200; ++round)
    {
        const double start = std::pow(10.0, random(engine, -4, 2));
        Leeway leeway;
        EXPECT_FALSE(leeway.outlasts(0.0f));
        leeway.set(start);
        Wide left = start;
        for (int i = 0; i < 1000; ++i)
        {
            const float step = float(start * std::pow(10.0, random(engine, -9, -2.2)));
            left -= Wide(step);
            if (!leeway.outlasts(step))
                break;
            ASSERT_GE(left, 0) << round;
            ++lasted;
        }
        EXPECT_FALSE(leeway.outlasts(float(start)));
        EXPECT_FALSE(leeway.outlasts(0.0f)) << "what is lost stays lost";
    }
    EXPECT_GT(lasted, 50000);
    Leeway leeway;
    leeway.set(0.0);
    EXPECT_TRUE(leeway.outlasts(0.0f));
    EXPECT_FALSE(leeway.outlasts(std::numeric_limits<float>::min()));
    leeway.set(1.0);
    EXPECT_FALSE(leeway.outlasts(std::numeric_limits<float>::quiet_NaN()));
    EXPECT_FALSE(leeway.outlasts(0.0f));
    leeway.set(std::numeric_limits<double>::max());
    EXPECT_FALSE(leeway.outlasts(2e38f)) << "no longer endless";
    leeway.set(1.0);
    leeway.forget();
    EXPECT_FALSE(leeway.outlasts(0.0f));
}

namespace
{
/// Bodies of changing shapes, all of them in pairs, dispatched by one that remembers and by one that never does.
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
            entry.body.setWorldTransform(btTransform(randomRotation(m_engine), anywhere()));
        }
        for (std::size_t i = 0; i < m_entries.size(); ++i)
        {
            for (std::size_t k = 0; k < i; ++k)
                m_cache.addOverlappingPair(&m_entries[k].proxy, &m_entries[i].proxy);
        }
    }
    ~RestlessCrowd() { forgetPairs(m_cache, m_dispatcher); }

    /// @return pairs that touch for the one that never remembers, and not for the other
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
        const std::set<std::pair<int, int>> truth = touchingForAStranger();
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
    int began = 0;  ///< pairs that did not touch in the frame before

private:
    struct Entry
    {
        btCollisionObject body;
        btBroadphaseProxy proxy{vec(0, 0, 0), vec(0, 0, 0), nullptr, 1, -1};
    };

    btVector3 anywhere()
    {
        return vec(m_far + random(m_engine, 0, 3.4), random(m_engine, 0, 3.4), random(m_engine, 0, 3.4));
    }

    void move(Entry& entry)
    {
        const btTransform from = entry.body.getWorldTransform();
        const unsigned kind = m_engine() % 100;
        if (kind < 64)
            return;
        if (kind < 96)
            entry.body.setWorldTransform(moved(from, random(m_engine, 0, 0.01), random(m_engine, 0, 0.5),
                                               random(m_engine, 0, 0.003), m_engine));
        else if (kind < 98)
            entry.body.setWorldTransform(moved(from, random(m_engine, 0, 0.3), random(m_engine, 0, 0.5),
                                               random(m_engine, 0, 0.1), m_engine));
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
                return shape.setLocalScaling(vec(random(m_engine, 0.7, 1.3), random(m_engine, 0.7, 1.3),
                                                 random(m_engine, -1.3, -0.7)));
            case 2:
                shape.getUnscaledPoints()[m_engine() % 8] *= btScalar(random(m_engine, 0.8, 1.25));
                return shape.recalcLocalAabb();
            case 3:
                return m_entries[i].body.setCollisionShape(m_shapes[m_engine() % m_shapes.size()].get());
            default:
                return m_box.setLocalScaling(vec(random(m_engine, 0.8, 1.2), 1, 1));
        }
    }

    /// Bullet fixes the other one when a manifold is made, from the shapes of that moment.
    static void useOneThreshold(btCollisionDispatcher& dispatcher)
    {
        dispatcher.setDispatcherFlags(dispatcher.getDispatcherFlags() &
                                      ~btCollisionDispatcher::CD_USE_RELATIVE_CONTACT_BREAKING_THRESHOLD);
    }

    /// Pairs with a contact that no rounding can take away.
    static std::set<std::pair<int, int>> touching(btCollisionDispatcher& dispatcher, double within = 1)
    {
        std::set<std::pair<int, int>> pairs;
        for (int i = 0; i < dispatcher.getNumManifolds(); ++i)
        {
            const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
            for (int k = 0; k < manifold.getNumContacts(); ++k)
            {
                if (double(manifold.getContactPoint(k).getDistance()) <
                    within * double(manifold.getContactBreakingThreshold()))
                    pairs.emplace(manifold.getBody0()->getUserIndex(), manifold.getBody1()->getUserIndex());
            }
        }
        return pairs;
    }

    std::set<std::pair<int, int>> touchingForAStranger()
    {
        Dispatcher stranger(&m_configuration);
        useOneThreshold(stranger);
        btHashedOverlappingPairCache cache;
        const btBroadphasePair* pairs = m_cache.getOverlappingPairArrayPtr();
        for (int i = 0; i < m_cache.getNumOverlappingPairs(); ++i)
            cache.addOverlappingPair(pairs[i].m_pProxy0, pairs[i].m_pProxy1);
        stranger.dispatchAllCollisionPairs(&cache, m_info, &stranger);
        EXPECT_EQ(stranger.stillPairs(), 0u);
        std::set<std::pair<int, int>> found = touching(stranger, m_far > 0 ? 0.8 : 0.99);
        forgetPairs(cache, stranger);
        return found;
    }

    void forgetPairs(btOverlappingPairCache& cache, btDispatcher& dispatcher)
    {
        for (Entry& entry : m_entries)
            cache.removeOverlappingPairsContainingProxy(&entry.proxy, &dispatcher);
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

TEST(IsaGjkDispatcher, KeepsWatchingItsPairsWhenItIsRegisteredAgain)
{
    const auto cube = makeHullShape(boxPoints(0.5, 0.5, 0.5));
    ConvexWorld world(Narrow::Dispatcher);
    for (int i = 0; i < 5; ++i)
        world.add(cube.get(), 1, vec(1.12 * i, 0, 0)).setActivationState(DISABLE_DEACTIVATION);
    world.world.setGravity(vec(0, 0, 0));
    world.step(3);
    auto& dispatcher = static_cast<Dispatcher&>(world.dispatcher());
    EXPECT_EQ(dispatcher.stillPairs(), 4u);
    EXPECT_EQ(dispatcher.idlePairs(), 4u);
    registerIsaGjk(dispatcher);
    world.step();
    EXPECT_EQ(dispatcher.stillPairs(), 4u);
    // Its pair goes, and with it one that watched.
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
}  // namespace cullet::test
