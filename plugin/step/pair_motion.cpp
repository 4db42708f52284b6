// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/step/pair_motion.h"

#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>
#include <LinearMath/btTransformUtil.h>

#include <cstddef>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr std::size_t kMostContacts = 4;

constexpr unsigned kMostQueries = 12;

struct ClosePoint
{
    btVector3 onA, onB, normal;  ///< normal from b to a
    btScalar distance;
};

/// Collects points of any distance up to a limit.
class ClosePoints final : public btManifoldResult
{
public:
    ClosePoints(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b, btScalar limit,
                std::vector<ClosePoint>& points)
        : btManifoldResult(&a, &b), m_a(a.getCollisionObject()), m_points(points)
    {
        m_closestPointDistanceThreshold = limit;
        m_points.clear();
    }

    void addContactPoint(const btVector3& normalOnB, const btVector3& onB, btScalar depth) override
    {
        const btVector3 onA = onB + normalOnB * depth;
        if (m_manifoldPtr->getBody0() == m_a)
            m_points.push_back({onA, onB, normalOnB, depth});
        else
            m_points.push_back({onB, onA, -normalOnB, depth});
    }

private:
    const btCollisionObject* m_a;
    std::vector<ClosePoint>& m_points;
};

/// A search in one pair.
class Advance
{
public:
    Advance(const PairMotion& pair, btCollisionWorld& world, btScalar timeStep, btScalar touch)
        : m_pair(pair), m_world(world), m_timeStep(timeStep), m_touch(touch)
    {
    }

    void moveTo(btScalar time)
    {
        m_time = time;
        m_a = m_pair.a.at(time);
        m_b = m_pair.b.at(time);
        query();
    }
    /// The time until which no points can meet.
    btScalar nextTime() const
    {
        btScalar next = m_timeStep;
        for (const ClosePoint& point : m_points)
        {
            const btScalar rate = mostRate(point);
            // Points that are near without an impact are no obstacle to the search.
            if (rate > 0)
                next = btMin(next, m_time + btMax(point.distance, m_touch) / rate);
        }
        return next;
    }
    /// @param limit most distance of such points
    void addApproaching(btScalar limit, std::vector<PairContact>& contacts) const
    {
        for (const ClosePoint& point : m_points)
        {
            if (point.distance <= limit && rateOf(point) * m_timeStep > m_touch &&
                point.distance < rateOf(point) * (m_timeStep - m_time) + m_touch &&
                contacts.size() < kMostContacts)
                contacts.push_back({m_b.invXform(point.onB), point.normal, distanceUntil(point)});
        }
    }
    btScalar time() const { return m_time; }

private:
    void query()
    {
        const btCollisionObject &objectA = *m_pair.a.object, &objectB = *m_pair.b.object;
        const btCollisionObjectWrapper a(nullptr, objectA.getCollisionShape(), &objectA, m_a, -1, -1);
        const btCollisionObjectWrapper b(nullptr, objectB.getCollisionShape(), &objectB, m_b, -1, -1);
        const btScalar most = (m_pair.a.linear - m_pair.b.linear).length() + m_pair.a.rim + m_pair.b.rim;
        ClosePoints result(a, b, most * (m_timeStep - m_time) + m_touch, m_points);
        btDispatcher& dispatcher = *m_world.getDispatcher();
        btCollisionAlgorithm* const algorithm =
            dispatcher.findAlgorithm(&a, &b, nullptr, BT_CLOSEST_POINT_ALGORITHMS);
        if (algorithm == nullptr)
            return;
        algorithm->processCollision(&a, &b, m_world.getDispatchInfo(), &result);
        algorithm->~btCollisionAlgorithm();
        dispatcher.freeCollisionAlgorithm(algorithm);
    }
    /// Speed at which the centre of a comes nearer to a point of b; mostRate() bounds that of any point.
    btScalar rateOf(const ClosePoint& point) const
    {
        return -point.normal.dot(m_pair.a.linear - m_pair.b.velocityAt(m_b, point.onB));
    }
    /// Half of a gap remains, since detectors are least exact where bodies just touch.
    btScalar distanceUntil(const ClosePoint& point) const
    {
        return btMax(point.distance - m_touch / 2, btScalar(0)) + rateOf(point) * m_time;
    }
    btScalar mostRate(const ClosePoint& point) const
    {
        return -point.normal.dot(m_pair.a.linear - m_pair.b.linear) + m_pair.a.rim + m_pair.b.rim;
    }

    const PairMotion& m_pair;
    btCollisionWorld& m_world;
    btScalar m_timeStep, m_touch, m_time = 0;
    btTransform m_a, m_b;
    std::vector<ClosePoint> m_points;
};
}  // namespace

BodyMotion::BodyMotion(const btCollisionObject& which) : object(&which), start(which.getWorldTransform())
{
    const btRigidBody* const body = btRigidBody::upcast(&which);
    if (body == nullptr || body->isStaticObject())
        return;
    linear = body->getLinearVelocity();
    angular = body->getAngularVelocity();
    btVector3 centre;
    btScalar radius = 0;
    which.getCollisionShape()->getBoundingSphere(centre, radius);
    rim = angular.length() * (radius + centre.length());
}

btTransform BodyMotion::at(btScalar time) const
{
    btTransform pose;
    btTransformUtil::integrateTransform(start, linear, angular, time, pose);
    return pose;
}

unsigned findContacts(const PairMotion& pair, btCollisionWorld& world, btScalar timeStep, btScalar touch,
                      std::vector<PairContact>& contacts)
{
    Advance advance(pair, world, timeStep, touch);
    advance.moveTo(0);
    unsigned queries = 1;
    for (; queries < kMostQueries; ++queries)
    {
        advance.addApproaching(touch, contacts);
        const btScalar next = advance.nextTime();
        if (!contacts.empty() || next >= timeStep)
            return queries;
        advance.moveTo(next);
    }
    // As far as the search has come, the closest points bound the motion.
    advance.addApproaching(BT_LARGE_FLOAT, contacts);
    return queries;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
