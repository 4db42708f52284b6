// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/contact/contact_feature.h"
#include "cullet/plugin/convex/isa_gjk_registration.h"
#include "cullet/plugin/convex/settled_search.h"
#include "cullet/plugin/mesh/face_touch.h"
#include "cullet/plugin/mesh/mesh_points.h"
#include "cullet/plugin/mesh/triangle_batch.h"

#include <BulletCollision/CollisionShapes/btTriangleShape.h>

#include <optional>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Distances of shapes in a contact with a mesh, in length units of the world.
struct MeshLimits
{
    btScalar meshMargin;
    btScalar breakingThreshold;
};

/// Finds the contact of a convex core with one triangle after the other, in the frame of the core.
///
/// A contact is a function of the core and the triangle, whatever a cache contains.
class TriangleSearch
{
public:
    using Corners = Eigen::Vector3d[3];

    /// @param convex   in the world
    /// @param hulls    of the pair; the first is the body's
    /// @param manifold of the pair
    TriangleSearch(IsaGjkRegistration& isaGjk, const ConvexSide& convex, const CoreFrame& frame,
                   HullUse (&hulls)[2], const MeshLimits& limits);
    TriangleSearch(const TriangleSearch&) = delete;
    TriangleSearch& operator=(const TriangleSearch&) = delete;

    /// False for a core without points, or without memory.
    bool isPossible() const { return m_cores.a || m_pair.a.kind == ConvexKind::Support; }
    /// No point of the core is farther from its origin.
    double size() const { return m_size; }
    /// The point of the core that is farthest along a direction.
    Eigen::Vector3d farthestAlong(const Eigen::Vector3d& direction) const;
    /// The largest product of a point of the core with a direction.
    double heightAlong(const Eigen::Vector3d& direction) const;
    CoreBounds bounds() const;
    /// A point in the core.
    Eigen::Vector3d centre() const;
    /// The distance of core and triangle up to which they touch.
    btScalar limit() const { return m_limit; }

    /// Whether a triangle is farther from the core than the limit, in every search: it is beyond a face of a box, a sphere
    /// around the core is beyond its plane or one of its sides, or a core that is no polytope is beyond the farthest side. Cheap, and often true where
    /// triangles are much larger than the core. Always false for spheres, for which answerAtOnce() is as cheap.
    bool isFar(const Corners& corners) const;

    /// The result that needs no search: of a sphere, of a touch at a face, of a triangle whose plane separates.
    ///
    /// @param corners not finite: Separated
    /// @return Separated, with an axis in normal() unless it is 0; Near; Overlapping; NotConverged if Bullet's algorithm
    ///         must answer, as for any core that is no polytope; or nothing, if search() must answer
    std::optional<ContactSearchResult> answerAtOnce(const Corners& corners);

    /// @pre answerAtOnce() gave nothing for this triangle just before
    /// @param cache [in, out] where the search begins; guesses that have been settled
    /// @return as from answerAtOnce(); if Separated, the cache has the axis
    ContactSearchResult search(GjkCache<btScalar>& cache);

    // The result of the last triangle, if it was Near or Overlapping.

    const Eigen::Vector3d& normal() const { return m_touch.normal; }
    /// Of the cores; negative: depth.
    double distance() const { return m_touch.distance; }
    /// The point of the triangle, without margins.
    Eigen::Vector3d touchedPoint() const { return m_cores.a->origin() + m_touch.onB; }
    /// The point of the convex shape, with its margin.
    Eigen::Vector3d placeOnConvex() const;
    /// Whether no other point than the touch carries the contact; see isSteep().
    bool isTouchAlone() const;
    /// @param place see MeshPoint
    void addTouch(const Eigen::Vector3d& place, const TriangleBatch::Triangle& triangle,
                  MeshPoints& points) const;

    /// Replaces the touch by one with another normal. If the cores overlap, the depth along the new normal is measured.
    ///
    /// @param corners    of the triangle of the last search
    /// @param onTriangle point of the triangle, without margins
    void turnTouch(const Corners& corners, const Eigen::Vector3d& normal, const Eigen::Vector3d& onTriangle,
                   double distance);

    /// Takes up an earlier touch, of any triangle.
    void returnTo(const Touch& touch) { m_touch = touch; }
    /// Adds the points of the patch around the touch, if the shapes are near enough there.
    ///
    /// @param corners of its triangle
    void addPatch(const TriangleBatch::Triangle& triangle, const Corners& corners, MeshPoints& points);

private:
    std::optional<bool> isFarFromBox(const Corners& corners) const;
    static Eigen::Vector3d farthestSide(const Corners& corners, const Eigen::Vector3d& across);
    double noiseAt(const Corners& corners) const;
    bool isApartAlong(const Corners& corners, const Eigen::Vector3d& direction) const;
    bool isPlaced(const Corners& corners) const;
    void place(const Corners& corners);
    ContactSearchResult searchFromPoint(const Corners& corners);
    ContactSearchResult searchFromSupport(const Corners& corners);
    std::optional<ContactSearchResult> searchAtFace(const Corners& corners);
    FaceTouch touchFace(const Corners& corners);
    void count(GjkState state);
    double gapAt(double distance) const;

    IsaGjkRegistration& m_isaGjk;
    const MeshLimits m_limits;
    HullUse (&m_hulls)[2];
    btTransform m_coreAt, m_triangleAt;
    btTriangleShape m_triangle;
    ConvexPair m_pair;
    const btScalar m_limit;
    ConvexCores m_cores;
    const double m_size;
    std::optional<NormalMap> m_normals;  ///< of the core
    const Eigen::Vector3d m_half;        ///< of a box, along the axes of the frame
    Corners m_placed;                    ///< of the triangle in m_cores
    Touch m_touch;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
