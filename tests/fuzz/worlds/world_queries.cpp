// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/fuzz/worlds/world_queries.h"

#include <utility>

namespace cullet::test
{
namespace
{
struct Contacts final : btCollisionWorld::ContactResultCallback
{
    Contacts(WorldTwin& answering, btScalar distance) : twin(answering)
    {
        m_closestDistanceThreshold = distance;
    }
    btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper* a, int /*partA*/,
                             int /*indexA*/, const btCollisionObjectWrapper* b, int /*partB*/,
                             int /*indexB*/) override
    {
        twin.answer(a->getCollisionObject());
        twin.answer(b->getCollisionObject());
        twin.answer(point.getDistance());
        twin.answer(point.getPositionWorldOnB());
        twin.answer(point.m_normalWorldOnB);
        return 0;
    }
    WorldTwin& twin;
};

void answerSweep(WorldTwin& twin, const btCollisionWorld::ClosestConvexResultCallback& result)
{
    twin.answer(result.m_hitCollisionObject);
    twin.answer(result.m_closestHitFraction);
    if (result.hasHit())
        twin.answer(result.m_hitNormalWorld);
}
}  // namespace

void castRay(WorldTwin& twin, const btVector3& from, const btVector3& to)
{
    btCollisionWorld::AllHitsRayResultCallback all(from, to);
    twin.world().rayTest(from, to, all);
    for (int i = 0; i < all.m_collisionObjects.size(); ++i)
    {
        twin.answer(all.m_collisionObjects[i]);
        twin.answer(all.m_hitFractions[i]);
    }
    btCollisionWorld::ClosestRayResultCallback closest(from, to);
    closest.m_collisionFilterMask = 1;
    twin.world().rayTest(from, to, closest);
    twin.answer(closest.m_collisionObject);
    twin.answer(closest.m_closestHitFraction);
}

void sweep(WorldTwin& twin, int kind, const btTransform& from, const btTransform& to)
{
    OwnedShape swept({kind == 0   ? ShapeKind::Sphere
                      : kind == 1 ? ShapeKind::Box
                                  : ShapeKind::Hull,
                      42, ShapeFamily::All});
    btCollisionWorld::ClosestConvexResultCallback result(from.getOrigin(), to.getOrigin());
    twin.world().convexSweepTest(static_cast<btConvexShape*>(&swept.shape()), from, to, result);
    answerSweep(twin, result);
}

void testContacts(WorldTwin& twin, std::size_t slot, btScalar distance)
{
    Contacts contacts(twin, distance);
    if (twin.object(slot) != nullptr)
        twin.world().contactTest(twin.object(slot), contacts);
}

void testContactsOfPair(WorldTwin& twin, std::size_t a, std::size_t b, btScalar distance)
{
    Contacts contacts(twin, distance);
    if (twin.object(a) != nullptr && twin.object(b) != nullptr && a != b)
        twin.world().contactPairTest(twin.object(a), twin.object(b), contacts);
}

void queryGhost(WorldTwin& twin, std::size_t slot, const btVector3& from, const btVector3& to)
{
    const btCollisionObject* object = twin.object(slot);
    const btGhostObject* ghost = object == nullptr ? nullptr : btGhostObject::upcast(object);
    if (ghost == nullptr)
        return;
    btCollisionWorld::ClosestRayResultCallback ray(from, to);
    ghost->rayTest(from, to, ray);
    twin.answer(ray.m_collisionObject);
    twin.answer(ray.m_closestHitFraction);
    btSphereShape ball(btScalar(0.25));
    const btQuaternion upright = btQuaternion::getIdentity();
    btCollisionWorld::ClosestConvexResultCallback result(from, to);
    ghost->convexSweepTest(&ball, btTransform(upright, from), btTransform(upright, to), result);
    answerSweep(twin, result);
}
}  // namespace cullet::test
