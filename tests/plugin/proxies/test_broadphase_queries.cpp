// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/plugin/broadphase/broadphase_support.h"
#include "cullet/tests/support/random.h"

#include <btBulletCollisionCommon.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace cullet::test
{
namespace
{
constexpr double kLarge = double(BT_LARGE_FLOAT);

/// A sweep as prepared by btCollisionWorld::convexSweepTest: zero length gives BT_LARGE_FLOAT on all axes, length 0.
struct SweepHits final : RayHits
{
    SweepHits(const btVector3& from, const btVector3& to) : RayHits(from, to + vec(1, 0, 0))
    {
        const btVector3 way = to - from;
        const btVector3 direction = way.fuzzyZero() ? btVector3(0, 0, 0) : way.normalized();
        for (int axis = 0; axis < 3; ++axis)
        {
            m_rayDirectionInverse[axis] =
                direction[axis] == btScalar(0) ? btScalar(BT_LARGE_FLOAT) : btScalar(1) / direction[axis];
            m_signs[axis] = m_rayDirectionInverse[axis] < 0 ? 1 : 0;
        }
        m_lambda_max = direction.dot(way);
    }
};

Ids sweepHits(btBroadphaseInterface& broadphase, const btVector3& from, const btVector3& to,
              const btVector3& boxMin, const btVector3& boxMax)
{
    SweepHits hits(from, to);
    broadphase.rayTest(from, to, hits, boxMin, boxMax);
    return hits.ids;
}

TEST(BroadphaseQueries, SeeEveryChangeAtOnce)
{
    Broadphase broadphase(bruteOptions());
    const auto seen = [&] { return rayHits(broadphase, vec(-9, 0, 0), vec(9, 0, 0)); };
    const auto inBox = [&] { return boxHits(broadphase, vec(-9, -1, -1), vec(9, 1, 1)); };
    btBroadphaseProxy* a = addCube(broadphase, vec(0, 0, 0));
    EXPECT_EQ(seen(), (Ids{1}));
    EXPECT_EQ(inBox(), (Ids{1}));
    btBroadphaseProxy* b = addCube(broadphase, vec(0, 5, 0));
    EXPECT_EQ(seen(), (Ids{1}));
    moveCube(broadphase, b, vec(3, 0, 0));
    EXPECT_EQ(seen(), (Ids{1, 2}));
    EXPECT_EQ(inBox(), (Ids{1, 2}));
    moveCube(broadphase, a, vec(0, 7, 0));
    EXPECT_EQ(seen(), (Ids{2}));
    broadphase.destroyProxy(b, nullptr);
    EXPECT_EQ(seen(), Ids{});
    EXPECT_EQ(inBox(), Ids{});
}

TEST(BroadphaseQueries, GrowTargetsByMirrorImageOfSweptBox)
{
    Broadphase broadphase(bruteOptions());
    addCube(broadphase, vec(0, 3, 0));
    // The swept box reaches 2.6 up and 0.1 down from its origin.
    EXPECT_EQ(sweepHits(broadphase, vec(-9, 0, 0), vec(9, 0, 0), vec(-0.1, -0.1, -0.1), vec(0.1, 2.6, 0.1)),
              (Ids{1}));
    EXPECT_EQ(sweepHits(broadphase, vec(-9, 0, 0), vec(9, 0, 0), vec(-0.1, -2.6, -0.1), vec(0.1, 0.1, 0.1)),
              Ids{});
    EXPECT_EQ(sweepHits(broadphase, vec(-9, 6, 0), vec(9, 6, 0), vec(-0.1, -2.6, -0.1), vec(0.1, 0.1, 0.1)),
              (Ids{1}));
}

TEST(BroadphaseQueries, ReportBoxesThatStrictlyContainPointOfZeroLengthSweep)
{
    Broadphase broadphase(bruteOptions());
    StockBroadphase stock;
    for (btBroadphaseInterface* each :
         {static_cast<btBroadphaseInterface*>(&broadphase), static_cast<btBroadphaseInterface*>(&stock)})
    {
        each->createProxy(vec(-1, -1, -1), vec(1, 1, 1), 0, nullptr, 1, kAllGroups, nullptr);
        each->createProxy(vec(-1, -1, -1), vec(0, 1, 1), 0, nullptr, 1, kAllGroups, nullptr);
        each->createProxy(vec(2, -1, -1), vec(3, 1, 1), 0, nullptr, 1, kAllGroups, nullptr);
    }
    const btVector3 zero = vec(0, 0, 0);
    EXPECT_EQ(sweepHits(broadphase, zero, zero, zero, zero), (Ids{1}));
    EXPECT_EQ(sweepHits(stock, zero, zero, zero, zero), (Ids{1}));
    EXPECT_EQ(sweepHits(broadphase, zero, zero, vec(-3, 0, 0), vec(3, 0, 0)), (Ids{1, 2, 3}));
}

TEST(BroadphaseQueries, FindNothingForZeroLengthRayOrNanBox)
{
    Broadphase broadphase(bruteOptions());
    for (int i = 0; i < 100; ++i)
        addCube(broadphase, vec(0.1 * i, 0, 0));
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (int round = 0; round < 400; ++round)  // until the tree is used
    {
        EXPECT_EQ(rayHits(broadphase, vec(1, 0, 0), vec(1, 0, 0)), Ids{}) << "0 / 0";
        EXPECT_EQ(boxHits(broadphase, vec(nan, 0, 0), vec(1, 1, 1)), Ids{});
        ASSERT_EQ(rayHits(broadphase, vec(-9, 0, 0), vec(99, 0, 0)).size(), 100u);
    }
    EXPECT_GT(broadphase.stats().queryTreeBuildsTotal, 0u);
}

TEST(BroadphaseQueries, IgnoreResultOfProcessCallback)
{
    Broadphase broadphase(bruteOptions());
    for (int i = 0; i < 40; ++i)
        addCube(broadphase, vec(i, 0, 0));
    EXPECT_EQ(rayHits(broadphase, vec(-9, 0, 0), vec(99, 0, 0)).size(), 40u) << "the callback returned false";
    EXPECT_EQ(boxHits(broadphase, vec(-9, -9, -9), vec(99, 9, 9)).size(), 40u);
}

TEST(BroadphaseQueries, IgnoreUninitialisedSignsOfRayCallback)
{
    Broadphase broadphase(bruteOptions());
    addCube(broadphase, vec(0, 0, 0));
    RayHits hits(vec(9, 0, 0), vec(-9, 0, 0));
    for (unsigned& sign : hits.m_signs)
        sign = 0xcdcdcdcd;
    broadphase.rayTest(vec(9, 0, 0), vec(-9, 0, 0), hits);
    EXPECT_EQ(hits.ids, (Ids{1}));
}

TEST(BroadphaseQueries, FindTheSameBoxesForRayDirectionsOfAnyLength)
{
    Broadphase broadphase(bruteOptions());
    for (int i = -3; i <= 3; ++i)
        addCube(broadphase, vec(3 * i, 2 * i, -4 * i));
    for (const int sign : {1, -1})
    {
        const btVector3 from = vec(-12, -8, 16) * btScalar(sign), to = -from;
        const Ids expected = rayHits(broadphase, from, to);
        EXPECT_EQ(expected.size(), 7u);
        for (const double length : {0.01, 0.5, 1.0, 7.0, 1000.0})
        {
            RayHits hits(from, to);
            for (int axis = 0; axis < 3; ++axis)
                hits.m_rayDirectionInverse[axis] /= btScalar(length);
            hits.m_lambda_max /= btScalar(length);
            broadphase.rayTest(from, to, hits);
            EXPECT_EQ(hits.ids, expected) << length;
        }
    }
}

TEST(BroadphaseQueries, TolerateCallbackThatShortensRayQueriesAndDestroysProxies)
{
    Broadphase broadphase(bruteOptions());
    std::vector<btBroadphaseProxy*> proxies;
    for (int i = 0; i < 20; ++i)
        proxies.push_back(addCube(broadphase, vec(2 * i, 0, 0)));
    struct Nested final : RayHits
    {
        using RayHits::RayHits;
        bool process(const btBroadphaseProxy* proxy) override
        {
            m_lambda_max = btScalar(0.5);
            btVector3 min;
            btVector3 max;
            broadphase->getAabb(const_cast<btBroadphaseProxy*>(proxy), min, max);
            // Nested queries hang in Bullet's own tree without BT_THREADSAFE.
            EXPECT_EQ(boxHits(*broadphase, min, max), (Ids{idOf(proxy)}));
            EXPECT_EQ(rayHits(*broadphase, min - vec(0, 9, 0), min + vec(0, 9, 0)), (Ids{idOf(proxy)}));
            if (victim != nullptr)
                broadphase->destroyProxy(victim, nullptr);
            victim = nullptr;
            return RayHits::process(proxy);
        }
        Broadphase* broadphase = nullptr;
        btBroadphaseProxy* victim = nullptr;
    };
    Nested hits(vec(-9, 0, 0), vec(99, 0, 0));
    hits.broadphase = &broadphase;
    hits.victim = proxies[10];
    broadphase.rayTest(vec(-9, 0, 0), vec(99, 0, 0), hits);
    EXPECT_EQ(hits.ids.size(), 19u);
    EXPECT_EQ(std::count(hits.ids.begin(), hits.ids.end(), 11u), 0) << "destroyed by the first callback";
}

TEST(BroadphaseQueries, ReportEachProxyOnceAndInfiniteOnesAlways)
{
    Broadphase broadphase(bruteOptions());
    const double inf = std::numeric_limits<double>::infinity();
    for (const double size : {kLarge, inf, 5e17})
        broadphase.createProxy(vec(-size, -size, -size), vec(size, size, size), 0, nullptr, 1, kAllGroups,
                               nullptr);
    for (int i = 0; i < 200; ++i)
        addCube(broadphase, vec(30 + i % 20, i / 20, 0), 0.001 * (i + 1));
    for (int round = 0; round < 50; ++round)  // until the tree is used
    {
        EXPECT_EQ(rayHits(broadphase, vec(0, 50, 0), vec(1, 50, 0)), (Ids{1, 2, 3}));
        EXPECT_EQ(rayHits(broadphase, vec(0, 0, 50), vec(-1, 2, 51)), (Ids{1, 2, 3}));
        EXPECT_EQ(boxHits(broadphase, vec(-5, -5, -5), vec(-4, -4, -4)), (Ids{1, 2, 3}));
        const Ids all = boxHits(broadphase, vec(-99, -99, -99), vec(99, 99, 99));
        ASSERT_EQ(all.size(), 203u);
        for (std::size_t i = 0; i < all.size(); ++i)
            ASSERT_EQ(all[i], i + 1) << "ascending and each once";
    }
    EXPECT_GT(broadphase.stats().queryTreeBuildsTotal, 0u);
    // Soft body worlds pass 1e30 for a zero component of the direction, which overflows a float.
    RayHits soft(vec(0, 50, 0), vec(1, 50, 0), btScalar(1e30));
    broadphase.rayTest(vec(0, 50, 0), vec(1, 50, 0), soft);
    EXPECT_EQ(soft.ids, (Ids{1, 2, 3}));
}

/// The result of Bullet's linear broad phase with Bullet's own box test, over the exact boxes.
Ids bruteRay(const std::vector<btBroadphaseProxy*>& proxies, const btVector3& from, const RayHits& ray,
             const btVector3& boxMin, const btVector3& boxMax)
{
    Ids ids;
    for (const btBroadphaseProxy* proxy : proxies)
    {
        const btVector3 bounds[2] = {proxy->m_aabbMin - boxMax, proxy->m_aabbMax - boxMin};
        btScalar entry = 0;
        if (btRayAabb2(from, ray.m_rayDirectionInverse, ray.m_signs, bounds, entry, btScalar(0),
                       ray.m_lambda_max))
            ids.push_back(idOf(proxy));
    }
    return ids;
}

btVector3 gridPoint(Random& random)
{
    // Whole and half numbers: rays run along faces, through edges and corners, and start inside boxes.
    const auto coordinate = [&] { return 0.5 * double(random.below(24)); };
    const double z = coordinate(), y = coordinate(), x = coordinate();
    return vec(x, y, z);
}

btVector3 endPoint(Random& random, const btVector3& from)
{
    switch (random.below(6))
    {
        case 0:
            return from + vec(random.below(9), 0, 0);
        case 1:
            return from - vec(0, -0.0, random.below(9));
        case 2:
            return vec(kLarge, from.y(), from.z());
        case 3:
            return vec(from.x() - 3, -kLarge, kLarge);
        case 4:
            return gridPoint(random);
        default:
            return vec(random.point(-20, 30));
    }
}

TEST(BroadphaseQueries, EqualBruteForceForRaysAndSweeps)
{
    Broadphase broadphase(bruteOptions());
    Random random(31);
    std::vector<btBroadphaseProxy*> proxies;
    for (int i = 0; i < 300; ++i)
    {
        const btVector3 min = gridPoint(random);
        const float z = random.unit();
        const double y = 0.5 * random.below(4), x = 0.5 * random.below(4);
        const btVector3 max = min + vec(x, y, z);
        proxies.push_back(broadphase.createProxy(min, max, 0, nullptr, 1, kAllGroups, nullptr));
    }
    proxies.push_back(broadphase.createProxy(vec(-kLarge, 0, -kLarge), vec(kLarge, 1, kLarge), 0, nullptr, 1,
                                             kAllGroups, nullptr));
    const btVector3 zero = vec(0, 0, 0);
    std::size_t hitCount = 0;
    for (int i = 0; i < 20000; ++i)
    {
        if (i % 100 == 0)
        {
            const btVector3 to = gridPoint(random);
            moveCube(broadphase, proxies[random.below(300)], to);
        }
        const btVector3 from = gridPoint(random);
        const btVector3 to = endPoint(random, from);
        const bool isSweep = random.chance(0.4f);
        const float minZ = isSweep ? -random.unit() : 0.0f;
        const btVector3 boxMin = isSweep ? vec(-random.unit(), -0.25, minZ) : zero;
        const btVector3 boxMax = isSweep ? vec(0.5, random.unit(), 0) : zero;
        RayHits hits(from, to);
        broadphase.rayTest(from, to, hits, boxMin, boxMax);
        ASSERT_EQ(hits.ids, bruteRay(proxies, from, hits, boxMin, boxMax)) << "query " << i;
        hitCount += hits.ids.size();
    }
    EXPECT_GT(hitCount, 20000u);
    EXPECT_GT(broadphase.stats().queryTreeBuildsTotal, 0u);
}

/// The grid, which has just found the pairs, knows where the bodies are: no tree, and no scan of all.
TEST(BroadphaseQueries, EqualBruteForceWithoutATreeAmongBodiesThatAllMove)
{
    BroadphaseOptions options;
    options.backend = BackendChoice::Grid;
    options.threads = 1;
    Broadphase broadphase(options);
    Random random(41);
    constexpr int kBodies = 6000;
    std::vector<btBroadphaseProxy*> proxies;
    std::vector<btVector3> places;
    for (int i = 0; i < kBodies; ++i)
    {
        places.push_back(vec(random.point(0, 40)));
        proxies.push_back(addCube(broadphase, places.back()));
    }
    std::size_t hitCount = 0;
    for (int frame = 0; frame < 6; ++frame)
    {
        for (int i = 0; i < kBodies; ++i)
            moveCube(broadphase, proxies[std::size_t(i)],
                     places[std::size_t(i)] += vec(random.point(-0.1f, 0.1f)));
        broadphase.calculateOverlappingPairs(nullptr);
        for (int i = 0; i < 30; ++i)
        {
            const btVector3 from = vec(random.point(0, 40));
            const btVector3 to = from + vec(random.point(-15, 15));
            const btVector3 boxMin = i % 2 == 0 ? vec(0, 0, 0) : vec(-0.5, -0.25, 0);
            RayHits hits(from, to);
            broadphase.rayTest(from, to, hits, boxMin, -boxMin);
            ASSERT_EQ(hits.ids, bruteRay(proxies, from, hits, boxMin, -boxMin))
                << "frame " << frame << " query " << i;
            hitCount += hits.ids.size();
        }
        EXPECT_EQ(broadphase.stats().queryTreeSyncsTotal, 0u);
        // A body that has moved since then is found where it is now.
        const btVector3 away = vec(100 + frame, 100, 100);
        moveCube(broadphase, proxies[7], away);
        EXPECT_EQ(rayHits(broadphase, away - vec(3, 0, 0), away + vec(3, 0, 0)), (Ids{8}));
        EXPECT_EQ(boxHits(broadphase, away, away), (Ids{8}));
    }
    EXPECT_GT(hitCount, 300u);
    // Those of one update pay for a tree together.
    broadphase.calculateOverlappingPairs(nullptr);
    int rays = 0;
    for (; rays < 20000 && broadphase.stats().queryTreeSyncsTotal == 0; ++rays)
        rayHits(broadphase, vec(0, 20, 20), vec(40, 20.5, 21));
    EXPECT_GT(broadphase.stats().queryTreeSyncsTotal, 0u) << rays;
}

/// Bullet's box test with a NaN is false for every box where the NaN is in x or in the length, and takes no notice of
/// one in y or z.
TEST(BroadphaseQueries, EqualBruteForceForRaysWithNan)
{
    Broadphase broadphase(bruteOptions());
    std::vector<btBroadphaseProxy*> proxies;
    for (int i = 0; i < 100; ++i)
        proxies.push_back(addCube(broadphase, vec(i % 10, i / 10, 0)));
    const btScalar nan = std::numeric_limits<btScalar>::quiet_NaN();
    const btVector3 from = vec(-2, 4.25, 0.25), to = vec(20, 4.4, -0.25), all(nan, nan, nan), zero(0, 0, 0);
    for (int round = 0; round < 50; ++round)  // until the tree is used
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            btVector3 nanFrom = from;
            nanFrom[axis] = nan;
            RayHits nanOrigin(from, to), nanInverse(from, to);
            nanInverse.m_rayDirectionInverse[axis] = nan;
            broadphase.rayTest(nanFrom, to, nanOrigin);
            broadphase.rayTest(from, to, nanInverse);
            EXPECT_EQ(nanOrigin.ids, bruteRay(proxies, nanFrom, nanOrigin, zero, zero)) << axis;
            EXPECT_EQ(nanInverse.ids, bruteRay(proxies, from, nanInverse, zero, zero)) << axis;
            EXPECT_EQ(nanOrigin.ids.size(), axis == 0 ? 0u : axis == 1 ? 100u : 10u) << axis;
            EXPECT_EQ(nanInverse.ids, nanOrigin.ids) << axis;
        }
        RayHits nanLength(from, to);
        nanLength.m_lambda_max = nan;
        broadphase.rayTest(from, to, nanLength);
        EXPECT_EQ(nanLength.ids, Ids{});
        for (const auto& [start, end] : {std::pair(all, all), std::pair(all, to), std::pair(from, all)})
            EXPECT_EQ(rayHits(broadphase, start, end), Ids{});
        ASSERT_EQ(rayHits(broadphase, from, to).size(), 10u) << "without a NaN";
    }
    EXPECT_GT(broadphase.stats().queryTreeBuildsTotal, 0u);
}

TEST(BroadphaseQueries, FindSameRayHitsAsDbvt)
{
    Broadphase broadphase(bruteOptions());
    StockBroadphase stock;
    Random random(37);
    for (int i = 0; i < 200; ++i)
    {
        const btVector3 centre = vec(random.point(0, 20));
        addCube(broadphase, centre);
        addCube(stock, centre);  // a new leaf is exact
    }
    std::size_t hitCount = 0;
    for (int i = 0; i < 2000; ++i)
    {
        const btVector3 from = vec(random.point(-5, 25));
        const btVector3 to = vec(random.point(-5, 25));
        Ids expected = rayHits(stock, from, to);
        std::sort(expected.begin(), expected.end());
        ASSERT_EQ(rayHits(broadphase, from, to), expected);
        hitCount += expected.size();
    }
    EXPECT_GT(hitCount, 500u);
}

TEST(BroadphaseQueries, AnswerRayAndSweepTestsOfWorld)
{
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    Broadphase broadphase;
    btCollisionWorld world(&dispatcher, &broadphase, &configuration);
    btStaticPlaneShape plane(vec(0, 1, 0), 0);
    btSphereShape sphere(1);
    btCollisionObject ground;
    btCollisionObject ball;
    ground.setCollisionShape(&plane);
    ball.setCollisionShape(&sphere);
    ball.getWorldTransform().setOrigin(vec(0, 5, 0));
    world.addCollisionObject(&ground);
    world.addCollisionObject(&ball);
    btCollisionWorld::ClosestRayResultCallback ray(vec(0, 9, 0), vec(0, -9, 0));
    world.rayTest(ray.m_rayFromWorld, ray.m_rayToWorld, ray);
    EXPECT_EQ(ray.m_collisionObject, &ball);
    world.removeCollisionObject(&ball);
    btTransform from = btTransform::getIdentity();
    btTransform to = from;
    from.setOrigin(vec(0, 9, 0));
    to.setOrigin(vec(0, -9, 0));
    btCollisionWorld::ClosestConvexResultCallback sweep(from.getOrigin(), to.getOrigin());
    world.convexSweepTest(&sphere, from, to, sweep);
    EXPECT_EQ(sweep.m_hitCollisionObject, &ground);
    EXPECT_NEAR(double(sweep.m_hitPointWorld.y()), 0.0, 1e-3);
    world.removeCollisionObject(&ground);
}
}  // namespace
}  // namespace cullet::test
