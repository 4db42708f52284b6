// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/tests/plugin/convex/convex_world.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>

#include <memory>
#include <optional>
#include <vector>

namespace cullet::test
{
/// A contact point reported by an algorithm.
struct Reported
{
    btVector3 normal;  ///< from B to A
    btVector3 onB;
    double distance;
};

/// Two bodies without a world, and the algorithm of a dispatcher for them.
class ConvexPairProbe
{
public:
    ConvexPairProbe(btCollisionDispatcher& dispatcher, btCollisionShape& a, btCollisionShape& b,
                    ebtDispatcherQueryType table = BT_CONTACT_POINT_ALGORITHMS,
                    btPersistentManifold* shared = nullptr)
        : m_dispatcher(dispatcher)
    {
        bodyA.setCollisionShape(&a);
        bodyB.setCollisionShape(&b);
        const Wraps wraps(*this);
        algorithm = dispatcher.findAlgorithm(&wraps.a, &wraps.b, shared, table);
    }
    ~ConvexPairProbe()
    {
        algorithm->~btCollisionAlgorithm();
        m_dispatcher.freeCollisionAlgorithm(algorithm);
    }
    ConvexPairProbe(const ConvexPairProbe&) = delete;
    ConvexPairProbe& operator=(const ConvexPairProbe&) = delete;

    void place(const btTransform& a, const btTransform& b)
    {
        bodyA.setWorldTransform(a);
        bodyB.setWorldTransform(b);
    }
    void place(const btVector3& a, const btVector3& b)
    {
        place(btTransform(btQuaternion::getIdentity(), a), btTransform(btQuaternion::getIdentity(), b));
    }

    /// Updates the manifold, as in a step of a world.
    btPersistentManifold* step(const btDispatcherInfo& info = {})
    {
        const Wraps wraps(*this);
        btManifoldResult result(&wraps.a, &wraps.b);
        algorithm->processCollision(&wraps.a, &wraps.b, info, &result);
        return result.getPersistentManifold();
    }

    /// Returns all reported points, as in contactPairTest().
    std::vector<Reported> query(double threshold = 0, const btDispatcherInfo& info = {})
    {
        const Wraps wraps(*this);
        Collector result(&wraps.a, &wraps.b);
        result.m_closestPointDistanceThreshold = btScalar(threshold);
        algorithm->processCollision(&wraps.a, &wraps.b, info, &result);
        return result.points;
    }

    btCollisionObject bodyA, bodyB;
    btCollisionAlgorithm* algorithm;

private:
    struct Wraps
    {
        explicit Wraps(const ConvexPairProbe& probe)
            : a(nullptr, probe.bodyA.getCollisionShape(), &probe.bodyA, probe.bodyA.getWorldTransform(), -1,
                -1),
              b(nullptr, probe.bodyB.getCollisionShape(), &probe.bodyB, probe.bodyB.getWorldTransform(), -1,
                -1)
        {
        }
        btCollisionObjectWrapper a, b;
    };
    struct Collector : btManifoldResult
    {
        using btManifoldResult::btManifoldResult;
        void addContactPoint(const btVector3& normal, const btVector3& onB, btScalar distance) override
        {
            points.push_back({normal, onB, double(distance)});
        }
        std::vector<Reported> points;
    };

    btCollisionDispatcher& m_dispatcher;
};

/// Bullet's dispatcher, with or without ISA-GJK.
struct ConvexBench
{
    explicit ConvexBench(bool isStock = false, const IsaGjkOptions& options = {})
    {
        if (!isStock)
            registration = &registerIsaGjk(dispatcher, options);
    }

    /// The closest point, by an algorithm made for this query.
    std::optional<Reported> closest(btCollisionShape& a, const btTransform& at, btCollisionShape& b,
                                    const btTransform& bt, double threshold)
    {
        ConvexPairProbe probe(dispatcher, a, b, BT_CLOSEST_POINT_ALGORITHMS);
        probe.place(at, bt);
        const std::vector<Reported> points = probe.query(threshold);
        if (points.empty())
            return {};
        EXPECT_EQ(points.size(), 1u);
        return points[0];
    }

    btDefaultCollisionConfiguration configuration{smallPools()};
    btCollisionDispatcher dispatcher{&configuration};
    IsaGjkRegistration* registration = nullptr;

private:
    /// Small pools, since Bullet initialises all eight thousand entries of a pool, and tests create many.
    static btDefaultCollisionConstructionInfo smallPools()
    {
        btDefaultCollisionConstructionInfo info;
        info.m_defaultMaxPersistentManifoldPoolSize = info.m_defaultMaxCollisionAlgorithmPoolSize = 64;
        return info;
    }
};
}  // namespace cullet::test
