// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/queries/mesh_sweep.h"

#include "cullet/plugin/queries/mesh_queries.h"
#include "cullet/plugin/queries/node_filter.h"

#include <BulletCollision/CollisionShapes/btConvexShape.h>
#include <BulletCollision/NarrowPhaseCollision/btRaycastCallback.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// A hit of Bullet's sweep against one triangle, in world space.
struct SweepHit
{
    btVector3 normal, point;
    btScalar fraction;
    TriangleName name;
};

void report(const SweepHit& hit, const btCollisionObject& object,
            btCollisionWorld::ConvexResultCallback& callback)
{
    btCollisionWorld::LocalShapeInfo info;
    info.m_shapePart = hit.name.part;
    info.m_triangleIndex = hit.name.index;
    btCollisionWorld::LocalConvexResult result(&object, &info, hit.normal, hit.point, hit.fraction);
    callback.addSingleResult(result, true);
}

/// Bullet's sweep against one triangle after the other; keeps the hit of the last one.
class TriangleSweep final : public btTriangleConvexcastCallback
{
public:
    TriangleSweep(const ConvexSweep& sweep, const btCollisionObject& object, const MeshTarget& target,
                  btScalar limit)
        : btTriangleConvexcastCallback(sweep.shape, *sweep.from, *sweep.to, object.getWorldTransform(),
                                       target.shape->getMargin()),
          m_target(target)
    {
        m_hitFraction = limit;
        m_allowedPenetration = sweep.allowedPenetration;
    }

    /// Null where the shape does not meet the triangle below the limit.
    const SweepHit* test(std::uint32_t item)
    {
        btVector3 corners[3];
        const TriangleName name = m_target.mesh->read(item, corners);
        if (m_target.isScaled)
        {
            for (btVector3& corner : corners)
                corner *= m_target.shape->getLocalScaling();
        }
        m_isHit = false;
        processTriangle(corners, name.part, name.index);
        return m_isHit ? &m_hit : nullptr;
    }

    btScalar reportHit(const btVector3& normal, const btVector3& point, btScalar fraction, int part,
                       int index) override
    {
        m_isHit = true;
        m_hit = {normal, point, fraction, {part, index}};
        return fraction;
    }

private:
    const MeshTarget& m_target;
    bool m_isHit = false;
    SweepHit m_hit = {};
};

/// The motion in the frame of the mesh, before it is scaled.
struct LocalMotion
{
    LocalMotion(const ConvexSweep& sweep, const btCollisionObject& object)
    {
        const btTransform toMesh = object.getWorldTransform().inverse();
        from = toMesh * sweep.from->getOrigin();
        to = toMesh * sweep.to->getOrigin();
        // Bullet's box, of the orientation at the end.
        const btTransform rotation(toMesh.getBasis() * sweep.to->getBasis());
        sweep.shape->getAabb(rotation, boxMin, boxMax);
        turns = !(sweep.from->getBasis() == sweep.to->getBasis());
    }

    btVector3 from, to, boxMin, boxMax;
    bool turns;
};

/// A box around the shape, about its origin, and around whatever Bullet's sweep may take for a contact.
///
/// That ends at a distance of a thousandth beyond both margins; the rest is for the rounding of its distances.
void boundContact(const ConvexSweep& sweep, const LocalMotion& motion, const MeshTarget& target,
                  SweptBox& box)
{
    btVector3 low = motion.boxMin, high = motion.boxMax;
    if (motion.turns)
    {
        btVector3 centre;
        btScalar radius = 0;
        sweep.shape->getBoundingSphere(centre, radius);
        radius += centre.length();
        low.setValue(-radius, -radius, -radius);
        high.setValue(radius, radius, radius);
    }
    const double largest =
        std::max<double>(target.mesh->largestCoordinate(), motion.from.length() + motion.to.length());
    const double reach = static_cast<double>(target.shape->getMargin()) + 0.002 +
                         1e-3 * static_cast<double>((high - low).length()) +
                         64.0 * static_cast<double>(SIMD_EPSILON) * largest;
    for (int axis = 0; axis < 3; ++axis)
    {
        box.origin[axis] = motion.from[axis];
        box.motion[axis] = static_cast<double>(motion.to[axis]) - static_cast<double>(motion.from[axis]);
        box.min[axis] = low[axis] - reach;
        box.max[axis] = high[axis] + reach;
    }
}

/// Scales a swept box into the frame of the mesh's own triangles.
void divide(SweptBox& box, const btVector3& scaling)
{
    for (int axis = 0; axis < 3; ++axis)
    {
        const double inverse = 1.0 / static_cast<double>(scaling[axis]);
        box.origin[axis] *= inverse;
        box.motion[axis] *= inverse;
        box.min[axis] *= inverse;
        box.max[axis] *= inverse;
        if (inverse < 0.0)
            std::swap(box.min[axis], box.max[axis]);
    }
}

/// Bullet finds the triangles of a scaled mesh by the box around the whole motion.
NodeFilter filterOf(const LocalMotion& motion, const MeshTarget& target)
{
    const BulletNodes& nodes = target.mesh->nodes();
    if (!target.isScaled)
        return NodeFilter::alongPath(nodes, motion.from, motion.to, motion.boxMin, motion.boxMax);
    btVector3 low = motion.from, high = motion.from;
    low.setMin(motion.to);
    high.setMax(motion.to);
    low += motion.boxMin;
    high += motion.boxMax;
    const btVector3& scaling = target.shape->getLocalScaling();
    for (int axis = 0; axis < 3; ++axis)
    {
        const btScalar inverse = btScalar(1) / scaling[axis];
        low[axis] *= inverse;
        high[axis] *= inverse;
        if (inverse < 0)
            std::swap(low[axis], high[axis]);
    }
    return NodeFilter::inBox(nodes, low, high);
}

/// Sweeps against the triangles by entry and reports the closest hit: of equal ones that of the last item, which is the one
/// that Bullet reports last.
bool sweepClosest(TriangleSweep& sweep, const SweptBox& box, const NodeFilter& filter,
                  const btCollisionObject& object, const MeshTarget& target,
                  btCollisionWorld::ConvexResultCallback& callback)
{
    SweepHit closest = {};
    closest.fraction = callback.m_closestHitFraction;
    std::uint32_t closestItem = 0;
    bool hasHit = false;
    const auto test = [&](std::uint32_t item)
    {
        const SweepHit* const hit = filter.accepts(target.mesh->nodeOf(item)) ? sweep.test(item) : nullptr;
        if (hit != nullptr && (hit->fraction < closest.fraction ||
                               (hit->fraction == closest.fraction && (!hasHit || item > closestItem))))
        {
            closest = *hit;
            closestItem = item;
            hasHit = true;
        }
        return static_cast<double>(closest.fraction);
    };
    if (!target.mesh->tree().visitByEntry(box, closest.fraction, test))
        return false;
    if (hasHit)
        report(closest, object, callback);
    return true;
}

/// Reports hits in Bullet's order of triangles. Those that the shape cannot meet before the callback's closest hit are left
/// out: Bullet would report no hit with them.
bool sweepAll(TriangleSweep& sweep, const SweptBox& box, const NodeFilter& filter,
              const btCollisionObject& object, const MeshTarget& target,
              btCollisionWorld::ConvexResultCallback& callback)
{
    std::vector<MeshCandidate> candidates;
    if (!target.mesh->tree().findOnPath(box, callback.m_closestHitFraction, candidates))
        return false;
    for (const MeshCandidate& candidate : candidates)
    {
        if (candidate.enter > sweptLimit(callback.m_closestHitFraction) ||
            !filter.accepts(target.mesh->nodeOf(candidate.item)))
            continue;
        const SweepHit* const hit = sweep.test(candidate.item);
        if (hit != nullptr && hit->fraction <= callback.m_closestHitFraction)
            report(*hit, object, callback);
    }
    return true;
}
}  // namespace

bool sweepMesh(const ConvexSweep& sweep, const btCollisionObject& object, const MeshTarget& target,
               HitsWanted wanted, btCollisionWorld::ConvexResultCallback& callback)
{
    const LocalMotion motion(sweep, object);
    SweptBox box;
    boundContact(sweep, motion, target, box);
    if (target.isScaled)
        divide(box, target.shape->getLocalScaling());
    const NodeFilter filter = filterOf(motion, target);
    TriangleSweep triangles(sweep, object, target, callback.m_closestHitFraction);
    return wanted == HitsWanted::Closest ? sweepClosest(triangles, box, filter, object, target, callback)
                                         : sweepAll(triangles, box, filter, object, target, callback);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
