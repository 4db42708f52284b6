// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/queries/mesh_ray.h"

#include "cullet/plugin/queries/mesh_queries.h"

#include <BulletCollision/NarrowPhaseCollision/btRaycastCallback.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Reports hits in the mesh's frame to a callback of a world.
class HitReport
{
public:
    HitReport(const ShapeOfObject& tested, btCollisionWorld::RayResultCallback& callback)
        : m_tested(tested), m_callback(callback)
    {
    }

    btScalar operator()(const btVector3& normal, btScalar fraction, TriangleName name) const
    {
        btCollisionWorld::LocalShapeInfo info;
        info.m_shapePart = name.part;
        info.m_triangleIndex = name.index;
        btCollisionWorld::LocalRayResult result(m_tested.object, &info, m_tested.at.getBasis() * normal,
                                                fraction);
        return m_callback.addSingleResult(result, true);
    }

private:
    const ShapeOfObject& m_tested;
    btCollisionWorld::RayResultCallback& m_callback;
};

/// Bullet's test of a triangle; each hit is reported.
class ReportedRay final : public btTriangleRaycastCallback
{
public:
    ReportedRay(const btVector3& from, const btVector3& to, unsigned flags, btScalar limit,
                const HitReport& report)
        : btTriangleRaycastCallback(from, to, flags), m_report(report)
    {
        m_hitFraction = limit;
    }

    btScalar reportHit(const btVector3& normal, btScalar fraction, int part, int index) override
    {
        return m_report(normal, fraction, {part, index});
    }

private:
    const HitReport& m_report;
};

/// Bullet's test of a triangle; the closest hit is kept, of equal ones the one that Bullet finds first.
class ClosestRay final : public btTriangleRaycastCallback
{
public:
    ClosestRay(const btVector3& from, const btVector3& to, unsigned flags, btScalar limit)
        : btTriangleRaycastCallback(from, to, flags), m_closest(limit)
    {
    }

    void test(const MeshQueries& mesh, std::uint32_t item)
    {
        btVector3 corners[3];
        const TriangleName name = mesh.read(item, corners);
        m_mesh = &mesh;
        m_tested = item;
        // Bullet accepts what is below the limit: this lets equal hits pass.
        m_hitFraction =
            m_hasHit ? std::nextafter(m_closest, std::numeric_limits<btScalar>::infinity()) : m_closest;
        processTriangle(corners, name.part, name.index);
    }

    btScalar reportHit(const btVector3& normal, btScalar fraction, int part, int index) override
    {
        if (m_hasHit && fraction == m_closest && m_mesh->nodeOf(m_tested) > m_mesh->nodeOf(m_item))
            return fraction;
        m_hasHit = true;
        m_item = m_tested;
        m_closest = fraction;
        m_normal = normal;
        m_name = {part, index};
        return fraction;
    }

    btScalar closest() const { return m_closest; }

    void report(const HitReport& report) const
    {
        if (m_hasHit)
            report(m_normal, m_closest, m_name);
    }

private:
    btScalar m_closest;
    bool m_hasHit = false;
    const MeshQueries* m_mesh = nullptr;
    std::uint32_t m_item = 0;
    std::uint32_t m_tested = 0;
    btVector3 m_normal;
    TriangleName m_name = {};
};

/// The ray, so thick that the rounding of Bullet's test is inside.
///
/// That computes a point on the ray from distances to the plane of the triangle. Its errors are a few roundings of the
/// largest coordinate, across the ray and along the normal.
SweptBox sweptRay(const MeshQueries& mesh, const btVector3& from, const btVector3& to)
{
    double largest = mesh.largestCoordinate();
    for (int axis = 0; axis < 3; ++axis)
        largest = std::max<double>({largest, std::abs(double(from[axis])), std::abs(double(to[axis]))});
    const double thickness = 16.0 * static_cast<double>(SIMD_EPSILON) * largest;
    SweptBox box;
    for (int axis = 0; axis < 3; ++axis)
    {
        box.origin[axis] = from[axis];
        box.motion[axis] = static_cast<double>(to[axis]) - static_cast<double>(from[axis]);
        box.min[axis] = -thickness;
        box.max[axis] = thickness;
    }
    return box;
}

bool testClosest(const MeshQueries& mesh, const SweptBox& box, ClosestRay& ray)
{
    return mesh.tree().visitByEntry(box, ray.closest(),
                                    [&](const MeshCandidate& candidate)
                                    {
                                        ray.test(mesh, candidate.item);
                                        return static_cast<double>(ray.closest());
                                    });
}

bool testAll(const MeshQueries& mesh, const SweptBox& box, ReportedRay& ray)
{
    std::vector<MeshCandidate> candidates;
    if (!mesh.findOnPath(box, ray.m_hitFraction, candidates))
        return false;
    for (const MeshCandidate& candidate : candidates)
    {
        btVector3 corners[3];
        const TriangleName name = mesh.read(candidate.item, corners);
        ray.processTriangle(corners, name.part, name.index);
    }
    return true;
}
}  // namespace

bool testMeshRay(const btVector3& from, const btVector3& to, const ShapeOfObject& tested,
                 const MeshTarget& target, HitsWanted wanted, btCollisionWorld::RayResultCallback& callback)
{
    const btTransform toMesh = tested.at.inverse();
    btVector3 fromLocal = toMesh * from, toLocal = toMesh * to;
    if (target.isScaled)
    {
        // As Bullet does: the ray is scaled, not the mesh, and normals are those of the mesh that is not scaled.
        fromLocal = fromLocal / target.shape->getLocalScaling();
        toLocal = toLocal / target.shape->getLocalScaling();
    }
    const MeshQueries& mesh = *target.mesh;
    const SweptBox box = sweptRay(mesh, fromLocal, toLocal);
    const HitReport report(tested, callback);
    if (wanted == HitsWanted::All)
    {
        ReportedRay ray(fromLocal, toLocal, callback.m_flags, callback.m_closestHitFraction, report);
        return testAll(mesh, box, ray);
    }
    ClosestRay ray(fromLocal, toLocal, callback.m_flags, callback.m_closestHitFraction);
    if (!testClosest(mesh, box, ray))
        return false;
    ray.report(report);
    return true;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
