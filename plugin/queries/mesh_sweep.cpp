// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/queries/mesh_sweep.h"

#include "cullet/plugin/queries/mesh_queries.h"
#include "cullet/plugin/queries/node_filter.h"
#include "cullet/plugin/queries/sweep_axes.h"

#include <BulletCollision/CollisionShapes/btConvexShape.h>
#include <BulletCollision/NarrowPhaseCollision/btRaycastCallback.h>

#include <cstdint>
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
    btVector3 normal{0, 0, 0}, point{0, 0, 0};
    btScalar fraction;
    TriangleName name;
};

void report(const SweepHit& hit, const ShapeOfObject& tested,
            btCollisionWorld::ConvexResultCallback& callback)
{
    btCollisionWorld::LocalShapeInfo info;
    info.m_shapePart = hit.name.part;
    info.m_triangleIndex = hit.name.index;
    btCollisionWorld::LocalConvexResult result(tested.object, &info, hit.normal, hit.point, hit.fraction);
    callback.addSingleResult(result, true);
}

/// Bullet's sweep against one triangle after the other; keeps the hit of the last one.
class TriangleSweep final : public btTriangleConvexcastCallback
{
public:
    TriangleSweep(const ConvexSweep& sweep, const ShapeOfObject& tested, const MeshTarget& target,
                  const SweepAxes& axes, btScalar limit)
        : btTriangleConvexcastCallback(sweep.shape, *sweep.from, *sweep.to, tested.at,
                                       target.shape->getMargin()),
          m_target(target),
          m_axes(axes)
    {
        m_hitFraction = limit;
        m_allowedPenetration = sweep.allowedPenetration;
    }

    /// Null where the shape does not meet the triangle below the limit, and where it surely does not up to a fraction.
    const SweepHit* test(std::uint32_t item, btScalar until)
    {
        btVector3 corners[3];
        const TriangleName name = m_target.mesh->read(item, corners);
        for (int corner = 0; corner < 3 && m_target.isScaled; ++corner)
            corners[corner] *= m_target.shape->getLocalScaling();
        m_isHit = false;
        if (m_axes.earliest(corners, until) > until)
            return nullptr;
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
    const SweepAxes& m_axes;
    bool m_isHit = false;
    SweepHit m_hit = {};
};

/// How far from a triangle, without its margin, Bullet's sweep may take the shape to touch it.
///
/// That ends at a distance of a thousandth beyond both margins; the rest is for the rounding of its distances.
btScalar reachOf(const LocalMotion& motion, const MeshTarget& target)
{
    const btScalar largest =
        btScalar(target.mesh->largestCoordinate()) + motion.from.length() + motion.to.length();
    return target.shape->getMargin() + btScalar(0.0012) +
           btScalar(1e-4) * (motion.boxMax - motion.boxMin).length() + 16 * SIMD_EPSILON * largest;
}

/// The box of the shape about its origin, in all its orientations, grown by the reach.
void boundContact(const ConvexSweep& sweep, const LocalMotion& motion, btScalar reach, SweptBox& box)
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

/// Bullet finds the triangles of scaled meshes and of those of many materials by the box around the whole motion.
NodeFilter filterOf(const LocalMotion& motion, const MeshTarget& target)
{
    const BulletNodes& nodes = target.mesh->nodes();
    if (!target.sweepsInBox)
        return NodeFilter::alongPath(nodes, motion.from, motion.to, motion.boxMin, motion.boxMax);
    btVector3 low = motion.from, high = motion.from;
    low.setMin(motion.to);
    high.setMax(motion.to);
    low += motion.boxMin;
    high += motion.boxMax;
    const btVector3 scaling = target.isScaled ? target.shape->getLocalScaling() : btVector3(1, 1, 1);
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

constexpr std::uint32_t kNoItem = UINT32_MAX;

/// The first triangle that the middle of a swept box crosses, which the shape meets early in most cases: the closer the first
/// hit, the fewer triangles are swept.
std::uint32_t itemUnderCentre(const SweptBox& box, const MeshQueries& mesh, btScalar limit)
{
    struct Crossing final : btTriangleRaycastCallback
    {
        using btTriangleRaycastCallback::btTriangleRaycastCallback;
        btScalar reportHit(const btVector3&, btScalar fraction, int, int) override
        {
            item = tested;
            return fraction;
        }
        std::uint32_t item = kNoItem, tested = kNoItem;
    };
    SweptBox ray = box;
    btVector3 from, to;
    for (int axis = 0; axis < 3; ++axis)
    {
        ray.origin[axis] += 0.5 * (box.min[axis] + box.max[axis]);
        ray.min[axis] = ray.max[axis] = 0.0;
        from[axis] = static_cast<btScalar>(ray.origin[axis]);
        to[axis] = static_cast<btScalar>(ray.origin[axis] + ray.motion[axis]);
    }
    Crossing crossing(from, to);
    crossing.m_hitFraction = limit;
    mesh.tree().visitByEntry(ray, limit,
                             [&](const MeshCandidate& candidate)
                             {
                                 btVector3 corners[3];
                                 const TriangleName name = mesh.read(candidate.item, corners);
                                 crossing.tested = candidate.item;
                                 crossing.processTriangle(corners, name.part, name.index);
                                 return static_cast<double>(crossing.m_hitFraction);
                             });
    return crossing.item;
}

/// Finds the closest hit, of equal ones the one that Bullet reports last.
class ClosestSweep
{
public:
    ClosestSweep(TriangleSweep& sweep, const NodeFilter& filter, const MeshQueries& mesh, btScalar limit)
        : m_sweep(sweep), m_filter(filter), m_mesh(mesh)
    {
        m_closest.fraction = limit;
    }

    /// @return false: the box is not finite or too large
    bool run(const SweptBox& box)
    {
        const std::uint32_t first = itemUnderCentre(box, m_mesh, m_closest.fraction);
        if (first != kNoItem)
            test(first);
        return m_mesh.tree().visitByEntry(box, m_closest.fraction,
                                          [&](const MeshCandidate& candidate)
                                          {
                                              if (candidate.item != first)
                                                  test(candidate.item);
                                              return static_cast<double>(m_closest.fraction);
                                          });
    }

    /// Null if nothing is hit.
    const SweepHit* hit() const { return m_hasHit ? &m_closest : nullptr; }

private:
    void test(std::uint32_t item)
    {
        const std::uint32_t node = m_mesh.nodeOf(item);
        const SweepHit* const hit = m_filter.accepts(node) ? m_sweep.test(item, m_closest.fraction) : nullptr;
        if (hit == nullptr || hit->fraction > m_closest.fraction ||
            (hit->fraction == m_closest.fraction && m_hasHit && node < m_node))
            return;
        m_closest = *hit;
        m_node = node;
        m_hasHit = true;
    }

    TriangleSweep& m_sweep;
    const NodeFilter& m_filter;
    const MeshQueries& m_mesh;
    SweepHit m_closest = {};
    std::uint32_t m_node = 0;
    bool m_hasHit = false;
};

/// Reports hits in Bullet's order of triangles. Those that the shape cannot meet before the callback's closest hit are left
/// out: Bullet would report no hit with them.
bool sweepAll(TriangleSweep& sweep, const SweptBox& box, const NodeFilter& filter,
              const ShapeOfObject& tested, const MeshTarget& target,
              btCollisionWorld::ConvexResultCallback& callback)
{
    std::vector<MeshCandidate> candidates;
    if (!target.mesh->findOnPath(box, callback.m_closestHitFraction, candidates))
        return false;
    for (const MeshCandidate& candidate : candidates)
    {
        if (candidate.enter > sweptLimit(callback.m_closestHitFraction) ||
            !filter.accepts(target.mesh->nodeOf(candidate.item)))
            continue;
        const SweepHit* const hit = sweep.test(candidate.item, callback.m_closestHitFraction);
        if (hit != nullptr && hit->fraction <= callback.m_closestHitFraction)
            report(*hit, tested, callback);
    }
    return true;
}
}  // namespace

bool sweepMesh(const ConvexSweep& sweep, const ShapeOfObject& tested, const MeshTarget& target,
               HitsWanted wanted, btCollisionWorld::ConvexResultCallback& callback)
{
    const LocalMotion motion(sweep, tested.at);
    SweptBox box;
    const btScalar reach = reachOf(motion, target);
    boundContact(sweep, motion, reach, box);
    if (target.isScaled)
        divide(box, target.shape->getLocalScaling());
    const NodeFilter filter = filterOf(motion, target);
    const SweepAxes axes(sweep, motion, reach);
    TriangleSweep triangles(sweep, tested, target, axes, callback.m_closestHitFraction);
    if (wanted == HitsWanted::All)
        return sweepAll(triangles, box, filter, tested, target, callback);
    ClosestSweep closest(triangles, filter, *target.mesh, callback.m_closestHitFraction);
    if (!closest.run(box))
        return false;
    if (closest.hit() != nullptr)
        report(*closest.hit(), tested, callback);
    return true;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
