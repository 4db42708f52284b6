// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <LinearMath/btScalar.h>

#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// What finds the contacts of two boxes in a step. Queries for closest points are left to Bullet, except with IsaGjk.
enum class BoxPairs : std::uint8_t
{
    SeparatingAxes,  ///< cullet's separating axis test and patch; the manifold is kept as by Bullet's algorithm
    IsaGjk,          ///< ISA-GJK, as for any other convex pair
    Bullet           ///< Bullet's own algorithm: the same bits as without cullet
};

/// How far a pair may move until its contacts are computed again.
struct ReusePose
{
    /// Length by which points of the smaller shape may have moved, relative to the other shape, since the contacts were
    /// computed. 0: they are computed in every step.
    btScalar distance = 0;
    /// Angle in radians by which the shapes may have turned relative to each other since then, up to 1. It matters for
    /// small shapes.
    btScalar angle = btScalar(0.035);

    bool isOn() const { return distance > 0; }
};

struct IsaGjkOptions
{
    /// With SeparatingAxes, shapes of a class derived from btBoxShape are left to Bullet.
    BoxPairs boxPairs = BoxPairs::SeparatingAxes;
    /// Compare a hull shape's points with the cached ones in every query: about a nanosecond for three points. With
    /// cullet::Dispatcher once per dispatch, and in every query from a callback during it. If false, call
    /// invalidate(shape) after every edit and before a shape is deleted.
    bool checkPoints = true;
    /// Upper limit of contact points per pair and step, 1 to 4. A pair has as many points as support the contact: four
    /// for a box on its face, two for an edge, one for a vertex. The deepest point is always among them. With 1 or 2,
    /// bodies do not rest on their faces. Other numbers are clamped, with a warning.
    int patchPoints = 4;
    /// Let cullet choose the triangles of meshes, height fields and other concave shapes that a convex shape may touch, and
    /// the points that carry the contact. If false, Bullet's loop over triangles does.
    bool meshes = true;
    /// Let cullet find the children of compounds that may touch. If false, Bullet's loop over children does, with the same
    /// algorithms for them.
    bool compounds = true;
    /// Correct the normals of contacts at edges and corners of triangles that their neighbours cover, so that a body that
    /// slides over a mesh does not hit the edges between its triangles. The application prepares nothing; contacts of
    /// meshes with a btTriangleInfoMap are left to btAdjustInternalEdgeContacts(). Off by default, since normals differ
    /// from Bullet's. Needs `meshes`. A body at rest costs as much as without.
    bool activeEdges = false;
    /// Keep the contacts of a pair that hardly moves: a world at rest costs a fraction. See the guide, docs/guide/reuse.md.
    ///
    /// While neither `distance` nor `angle` is left, a pair of hulls, boxes, capsules and spheres, of one of these and a
    /// mesh, height field or other concave shape, or of such parts of compounds, keeps its points. In each step they get
    /// their positions and distances from the bodies' transforms (btManifoldResult::refreshContactPoints(), which calls
    /// gContactProcessedCallback and gContactEndedCallback as always), their normals turn with the second body, and
    /// friction and restitution are read. Contacts are computed again at once when a shape, its scale or its margin
    /// changes, when the body has another shape, when points were added to the manifold or removed from it, when the
    /// breaking threshold changes, and when a triangle of the mesh near the body has other vertices.
    ///
    /// Never kept: no contacts; pairs with a cylinder, cone or another shape whose points Bullet's algorithm finds;
    /// contacts that gContactAddedCallback sees (with CF_CUSTOM_MATERIAL_CALLBACK); bodies with contact stiffness or
    /// friction anchors; perturbation and enableSatConvex; BoxPairs::Bullet.
    ///
    /// Off by default: contacts then depend on the poses of earlier steps, too. They never depend on threads.
    ReusePose reusePose = {};
};

/// Counters since the registration, summed over all pairs.
struct IsaGjkStats
{
    std::uint64_t separatedTotal = 0;  ///< queries in which an axis proved that there is no contact
    std::uint64_t touchingTotal = 0;   ///< queries that made contact points
    std::uint64_t depthsTotal = 0;     ///< the part of touchingTotal with overlapping cores
    /// Queries that ISA-GJK left to Bullet's own detector, because it found no answer or ran out of memory.
    std::uint64_t notConvergedTotal = 0;
    /// Queries that Bullet's own algorithm answers by design: cylinders, cones and other round shapes that are close,
    /// enableSatConvex, perturbation.
    std::uint64_t delegatedTotal = 0;
    /// The part of depthsTotal for which no polytope proved the depth, so that all faces and pairs of edges were
    /// tested: thin hulls, and nearly coincident round hulls of thousands of points, which take tens of milliseconds.
    std::uint64_t exactTotal = 0;
    /// Triangles of concave shapes in the boxes of convex ones, and those of them for which there was a query, since
    /// neither the box around the core nor an axis has dropped them.
    std::uint64_t trianglesTotal = 0, trianglesAskedTotal = 0;
    /// Queries in which a pair kept its contacts (IsaGjkOptions::reusePose); in touchingTotal they are not counted.
    std::uint64_t reusedTotal = 0;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
