// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/world_queries.h"

#include "cullet/base/threads/parallel_loops.h"
#include "cullet/plugin/broadphase.h"
#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/queries/shape_query.h"

#include <BulletCollision/CollisionShapes/btConvexShape.h>
#include <LinearMath/btTransformUtil.h>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Bullet's function changes nothing, and is not const.
btBroadphaseInterface& broadphaseOf(const btCollisionWorld& world)
{
    return const_cast<btBroadphaseInterface&>(*world.getBroadphase());
}

/// Asks the broad phase for the objects on a path, with a query that ends where the callback's closest hit is at the start.
///
/// @tparam Callback btCollisionWorld::RayResultCallback or ConvexResultCallback
template <class Callback>
class ObjectsOnPath : public btBroadphaseRayCallback
{
public:
    /// @param direction of length 1, or of no length
    ObjectsOnPath(const btVector3& direction, const btVector3& motion, Callback& callback)
        : m_callback(callback)
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            m_rayDirectionInverse[axis] =
                direction[axis] == btScalar(0) ? btScalar(BT_LARGE_FLOAT) : btScalar(1) / direction[axis];
            m_signs[axis] = m_rayDirectionInverse[axis] < 0 ? 1 : 0;
        }
        m_lambda_max = direction.dot(motion);
    }

    bool process(const btBroadphaseProxy* proxy) final
    {
        if (m_callback.m_closestHitFraction == btScalar(0))
            return false;
        auto& object = *static_cast<btCollisionObject*>(proxy->m_clientObject);
        if (m_callback.needsCollision(object.getBroadphaseHandle()))
            test(object);
        return true;
    }

protected:
    virtual void test(btCollisionObject& object) = 0;

    Callback& m_callback;
};

ShapeOfObject wholeOf(const btCollisionObject& object)
{
    return {&object, object.getCollisionShape(), object.getWorldTransform(), -1};
}

class ObjectsOnRay final : public ObjectsOnPath<btCollisionWorld::RayResultCallback>
{
public:
    ObjectsOnRay(const btVector3& from, const btVector3& to, HitsWanted wanted,
                 btCollisionWorld::RayResultCallback& callback)
        : ObjectsOnPath((to - from).normalized(), to - from, callback), m_wanted(wanted)
    {
        m_from.setIdentity();
        m_from.setOrigin(from);
        m_to.setIdentity();
        m_to.setOrigin(to);
    }

private:
    void test(btCollisionObject& object) override
    {
        testRay(m_from, m_to, wholeOf(object), m_wanted, m_callback);
    }

    btTransform m_from, m_to;
    HitsWanted m_wanted;
};

btVector3 directionOf(const btVector3& motion)
{
    return motion.fuzzyZero() ? btVector3(0, 0, 0) : motion.normalized();
}

class ObjectsOnSweep final : public ObjectsOnPath<btCollisionWorld::ConvexResultCallback>
{
public:
    ObjectsOnSweep(const ConvexSweep& sweep, HitsWanted wanted,
                   btCollisionWorld::ConvexResultCallback& callback)
        : ObjectsOnPath(directionOf(sweep.to->getOrigin() - sweep.from->getOrigin()),
                        sweep.to->getOrigin() - sweep.from->getOrigin(), callback),
          m_sweep(sweep),
          m_wanted(wanted)
    {
    }

private:
    void test(btCollisionObject& object) override
    {
        sweepConvex(m_sweep, wholeOf(object), m_wanted, m_callback);
    }

    const ConvexSweep& m_sweep;
    HitsWanted m_wanted;
};

void rayTest(const btCollisionWorld& world, const btVector3& from, const btVector3& to, HitsWanted wanted,
             btCollisionWorld::RayResultCallback& callback)
{
    ObjectsOnRay objects(from, to, wanted, callback);
    broadphaseOf(world).rayTest(from, to, objects);
}

/// Keeps the closest hit of a ray of a batch.
class BatchRay final : public btCollisionWorld::RayResultCallback
{
public:
    BatchRay(RayHit& hit, const RayBatchOptions& options) : m_hit(hit)
    {
        m_hit.object = nullptr;
        m_hit.fraction = 1;
        m_collisionFilterGroup = options.group;
        m_collisionFilterMask = options.mask;
        m_flags = options.flags;
    }

    btScalar addSingleResult(btCollisionWorld::LocalRayResult& result, bool isNormalInWorld) override
    {
        const btCollisionWorld::LocalShapeInfo* const info = result.m_localShapeInfo;
        m_collisionObject = result.m_collisionObject;
        m_closestHitFraction = result.m_hitFraction;
        m_hit.object = result.m_collisionObject;
        m_hit.fraction = result.m_hitFraction;
        m_hit.normal = isNormalInWorld
                           ? result.m_hitNormalLocal
                           : m_collisionObject->getWorldTransform().getBasis() * result.m_hitNormalLocal;
        m_hit.part = info != nullptr ? info->m_shapePart : -1;
        m_hit.triangle = info != nullptr ? info->m_triangleIndex : -1;
        return result.m_hitFraction;
    }

private:
    RayHit& m_hit;
};
}  // namespace

void rayTest(const btCollisionWorld& world, const btVector3& from, const btVector3& to,
             btCollisionWorld::RayResultCallback& callback)
{
    const bool isClosest = isExactly<btCollisionWorld::ClosestRayResultCallback>(callback);
    rayTest(world, from, to, isClosest ? HitsWanted::Closest : HitsWanted::All, callback);
}

void convexSweepTest(const btCollisionWorld& world, const btConvexShape& shape, const btTransform& from,
                     const btTransform& to, btCollisionWorld::ConvexResultCallback& callback,
                     btScalar allowedPenetration)
{
    btVector3 linear, angular, boxMin, boxMax;
    btTransformUtil::calculateVelocity(from, to, btScalar(1), linear, angular);
    btTransform rotation;
    rotation.setIdentity();
    rotation.setRotation(from.getRotation());
    shape.calculateTemporalAabb(rotation, btVector3(0, 0, 0), angular, btScalar(1), boxMin, boxMax);

    const bool isClosest = isExactly<btCollisionWorld::ClosestConvexResultCallback>(callback);
    const ConvexSweep sweep = {&shape, &from, &to, allowedPenetration};
    ObjectsOnSweep objects(sweep, isClosest ? HitsWanted::Closest : HitsWanted::All, callback);
    broadphaseOf(world).rayTest(from.getOrigin(), to.getOrigin(), objects, boxMin, boxMax);
}

void rayTestBatch(const btCollisionWorld& world, const Ray* rays, std::size_t count, RayHit* hits,
                  const RayBatchOptions& options)
{
    constexpr std::size_t kGrain = 64;
    const bool isAnyThread = isExactly<Broadphase>(*world.getBroadphase());
    ParallelLoops loops(isAnyThread ? options.threads : 1);
    const unsigned tasks = loops.tasksFor(count, kGrain);
    loops.run(tasks,
              [&](unsigned task)
              {
                  const TaskRange range(count, task, tasks);
                  for (std::size_t i = range.begin; i < range.end; ++i)
                  {
                      BatchRay ray(hits[i], options);
                      rayTest(world, rays[i].from, rays[i].to, HitsWanted::Closest, ray);
                  }
              });
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
