// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/contact/manifold_update.h"
#include "cullet/tests/plugin/convex/convex_world.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <vector>

// Single points are added to a manifold as Bullet adds them.
namespace cullet::test
{
namespace
{
std::vector<btScalar> numbersOf(const btManifoldPoint& point)
{
    std::vector<btScalar> numbers;
    for (const btVector3* v :
         {&point.m_localPointA, &point.m_localPointB, &point.m_positionWorldOnA, &point.m_positionWorldOnB,
          &point.m_normalWorldOnB, &point.m_lateralFrictionDir1, &point.m_lateralFrictionDir2})
        numbers.insert(numbers.end(), {v->x(), v->y(), v->z()});
    numbers.insert(numbers.end(),
                   {point.m_distance1, point.m_combinedFriction, point.m_combinedRollingFriction,
                    point.m_combinedSpinningFriction, point.m_combinedRestitution, point.m_appliedImpulse,
                    point.m_appliedImpulseLateral1, point.m_appliedImpulseLateral2});
    for (const int number : {point.m_partId0, point.m_partId1, point.m_index0, point.m_index1,
                             point.m_lifeTime, point.m_contactPointFlags})
        numbers.push_back(btScalar(number));
    return numbers;
}

bool haveSameBits(const btManifoldPoint& a, const btManifoldPoint& b)
{
    const std::vector<btScalar> x = numbersOf(a), y = numbersOf(b);
    return std::memcmp(x.data(), y.data(), x.size() * sizeof(btScalar)) == 0 &&
           a.m_userPersistentData == b.m_userPersistentData;
}

/// Two bodies, and two manifolds of them.
struct UpdateBench
{
    UpdateBench()
    {
        for (btCollisionObject& body : bodies)
        {
            body.setCollisionShape(&box);
            body.setFriction(btScalar(0.7));
            body.setRestitution(btScalar(0.3));
            body.setRollingFriction(btScalar(0.1));
        }
        for (btPersistentManifold*& manifold : manifolds)
            manifold = dispatcher.getNewManifold(&bodies[0], &bodies[1]);
    }
    ~UpdateBench()
    {
        for (btPersistentManifold* manifold : manifolds)
            dispatcher.releaseManifold(manifold);
    }

    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    btBoxShape box{vec(1, 1, 1)};
    std::array<btCollisionObject, 2> bodies;
    std::array<btPersistentManifold*, 2> manifolds;
};
}  // namespace

TEST(PointUpdate, LeavesManifoldAsBulletDoesInBothOrders)
{
    const unsigned seed = 41;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> any(-1, 1);
    const auto draw = [&] { return any(engine); };
    int replaced = 0, full = 0, refused = 0, data[8] = {};
    for (const bool isSwapped : {false, true})
    {
        UpdateBench bench;
        for (int step = 0; step < 400; ++step)
        {
            for (btCollisionObject& body : bench.bodies)
            {
                const double x = draw() * 0.05, angle = draw() * 0.05;
                body.setWorldTransform(
                    btTransform(btQuaternion(vec(0, 1, 0), btScalar(angle)), vec(x, x, 0)));
            }
            const btCollisionObject &first = bench.bodies[isSwapped ? 1 : 0],
                                    &second = bench.bodies[isSwapped ? 0 : 1];
            const btCollisionObjectWrapper a(nullptr, &bench.box, &first, first.getWorldTransform(), -1, -1),
                b(nullptr, &bench.box, &second, second.getWorldTransform(), -1, -1);
            btManifoldResult results[] = {{&a, &b}, {&a, &b}};
            for (int i = 0; i < 2; ++i)
                results[i].setPersistentManifold(bench.manifolds[std::size_t(i)]);
            ASSERT_TRUE(PointUpdate::isPossible(results[1]));
            PointUpdate update(results[1], *bench.manifolds[1]);
            const int count = static_cast<int>(engine() % 5);
            const double tilt = draw() * 0.1;
            for (int k = 0; k < count; ++k)
            {
                const double x = draw() > 0 ? 0.5 : -0.5, z = draw() > 0 ? 0.5 : -0.5, off = draw() * 0.03,
                             depth = draw() * 0.06;
                const btVector3 normal = vec(k % 2 == 0 ? tilt : 0, 1, 0).normalized(),
                                onB = vec(x + off, off, z);
                const int before = bench.manifolds[0]->getNumContacts();
                for (btManifoldResult& result : results)
                {
                    result.setShapeIdentifiersA(1, step);
                    result.setShapeIdentifiersB(2, k);
                }
                results[0].addContactPoint(normal, onB, btScalar(depth));
                update.add(normal, onB, btScalar(depth));
                const bool isRefused = btScalar(depth) > bench.manifolds[0]->getContactBreakingThreshold();
                refused += isRefused ? 1 : 0;
                full += before == MANIFOLD_CACHE_SIZE ? 1 : 0;
                replaced += !isRefused && bench.manifolds[0]->getNumContacts() == before ? 1 : 0;
            }
            for (btManifoldResult& result : results)
                result.refreshContactPoints();
            const int points = bench.manifolds[0]->getNumContacts();
            ASSERT_EQ(bench.manifolds[1]->getNumContacts(), points) << "step " << step;
            for (int k = 0; k < points; ++k)
            {
                btManifoldPoint &bullets = bench.manifolds[0]->getContactPoint(k),
                                &own = bench.manifolds[1]->getContactPoint(k);
                ASSERT_TRUE(haveSameBits(bullets, own)) << "step " << step << ", point " << k;
                // What a solver and the application leave there.
                bullets.m_appliedImpulse = own.m_appliedImpulse = btScalar(draw());
                bullets.m_userPersistentData = own.m_userPersistentData = &data[engine() % 8];
            }
        }
    }
    EXPECT_GT(replaced, 200);
    EXPECT_GT(full, 50);
    EXPECT_GT(refused, 50);
}

int addedTotal = 0;

TEST(PointUpdate, IsLeftToBulletWhileCallbacksSeePoints)
{
    UpdateBench bench;
    const btCollisionObjectWrapper a(nullptr, &bench.box, &bench.bodies[0],
                                     bench.bodies[0].getWorldTransform(), -1, -1),
        b(nullptr, &bench.box, &bench.bodies[1], bench.bodies[1].getWorldTransform(), -1, -1);
    btManifoldResult result(&a, &b);
    result.setPersistentManifold(bench.manifolds[0]);
    EXPECT_TRUE(PointUpdate::isPossible(result));
    gContactAddedCallback = [](btManifoldPoint&, const btCollisionObjectWrapper*, int, int,
                               const btCollisionObjectWrapper*, int, int) { return ++addedTotal > 0; };
    EXPECT_FALSE(PointUpdate::isPossible(result));
    gContactAddedCallback = nullptr;
    bench.bodies[1].setCollisionFlags(btCollisionObject::CF_HAS_FRICTION_ANCHOR);
    EXPECT_FALSE(PointUpdate::isPossible(result));
}
}  // namespace cullet::test
