// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/vertex_fan.h"
#include "cullet/plugin/shapes/convex_shape.h"

#include <array>
#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
class NormalMap;

/// The closest or deepest points of two cores. World axes, relative to the origin of A.
struct Touch
{
    Eigen::Vector3d normal;     ///< unit, from B to A
    double distance;            ///< of the cores along the normal; negative: depth
    Eigen::Vector3d onB;        ///< closest or deepest point of B
    std::int32_t vertexA = -1;  ///< support vertex of A against the normal, -1: unknown
    std::int32_t vertexB = -1;  ///< support vertex of B along the normal, -1: unknown
    bool areCorners = false;    ///< the closest points are the support vertices
};

/// Whether a way leads down from a touch so steeply that no point on it carries the contact, unless it is a few times as
/// close as points that the manifold merges.
///
/// @param up unit
inline bool isSteep(const Eigen::Vector3d& way, const Eigen::Vector3d& up)
{
    constexpr double kSteep = 0.02;
    const double down = -up.dot(way);
    return down > 0.0 && down * down > kSteep * kSteep * (way.squaredNorm() - down * down);
}

struct ContactPoint
{
    btVector3 fromTouch;  ///< from the touch's point of B to a point of B; world axes
    btScalar distance;    ///< of the cores there, along the normal; not less than that of the touch
};

struct ContactPatch
{
    std::array<ContactPoint, 4> points;
    int count = 0;
};

/// Limits of a patch, in length units of the world.
struct PatchLimits
{
    double distance;  ///< points farther apart are left out; at least that of the touch
    btScalar
        mergeDistance;  ///< the manifold merges points closer than this, so none is that close to the deepest
    int most = 4;       ///< number of points: 1 to 4
};

/// The faces around support vertices of hulls without a graph; null: the hull has a graph.
struct PatchFans
{
    const VertexFan<btScalar>* a = nullptr;
    const VertexFan<btScalar>* b = nullptr;
};

/// Whether a hull touches at a corner from which all of it leads away so steeply that no other point carries the contact:
/// those that rise little enough are as close as points that the manifold merges. Needs no faces.
bool isLoneCorner(const PosedShape& a, const PosedShape& b, const Touch& touch);

/// Whether a patch would have no other point than the touch: a triangle touches at a corner from which both of its edges
/// are steep, or two vertices touch and the distance grows beyond a limit along every edge.
bool isTouchAlone(const PosedShape& a, const PosedShape& b, const Touch& touch, double limit);

/// Selects the points that support the contact, among those where the cores are within a limit of each other along the
/// normal: the deepest (up to a thousandth of its difference to the limit) and points around it, up to the number in
/// the limits.
///
/// A point is load-bearing if its distance is hardly larger than that of the touch: by a tenth of
/// PatchLimits::mergeDistance, or by a fiftieth of its distance from the touch, so that a box that lands a degree from
/// flat lands on four points at once. If the faces are steeper, further points would be solver rows without an
/// impulse: a wheel of many sides has only the two ends of an edge. Where a body stands on an edge that is short against
/// the height of its origin, gravity closes the gap at the other end only slowly, and the limit is as much smaller: an
/// edge of a narrow wheel that leans by more than a few tenths of a degree has one point, as with Bullet.
///
/// Each core contributes the face at its support vertex that is best aligned with the normal. The part of one face
/// within the limit is clipped to the prism over the other along the normal (Sutherland and Hodgman 1974, "Reentrant
/// Polygon Clipping"); the remaining corners are points on that face, and their heights over the other face's plane
/// are the distances. Heights are measured along the contact normal, not along that of a face, so that none is less
/// than the true distance. If no corner is as deep as the touch (edges that cross outside of both faces), the touch is
/// added. Faces with more than 16 corners are thinned out to 16, which omits a rim of a round face: 0.02 of its
/// radius.
///
/// For a vertex, an edge, a capsule or a sphere, the patch has one or two points.
///
/// Precision: that of the shapes; points are off by some roundings of the distance from the touch to the centres.
///
/// Cost: O(p q) for faces of p and q corners, and two support searches if the vertices of the touch are unknown; no
/// allocation.
///
/// @param fans faces around the touch's vertices, for hulls without a graph
ContactPatch makeContactPatch(const PosedShape& a, const PosedShape& b, const Touch& touch,
                              const PatchLimits& limits, const PatchFans& fans = {});

/// makeContactPatch() for more than one point and a touch that is not alone; see isTouchAlone().
///
/// @param mapOfA of normals of A; null: it is found out
ContactPatch makeWidePatch(const PosedShape& a, const PosedShape& b, const Touch& touch,
                           const PatchLimits& limits, const PatchFans& fans,
                           const NormalMap* mapOfA = nullptr);
}  // namespace CULLET_PRECISION
}  // namespace cullet
