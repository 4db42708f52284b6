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
/// Where two cores are closest or deepest. World axes, relative to the origin of A.
struct Touch
{
    Eigen::Vector3d normal;     ///< unit, from B to A
    double distance;            ///< of the cores along the normal; negative: depth
    Eigen::Vector3d onB;        ///< closest or deepest point of B
    std::int32_t vertexA = -1;  ///< support vertex of A against the normal, -1: not known
    std::int32_t vertexB = -1;  ///< support vertex of B along the normal, -1: not known
    bool areCorners = false;    ///< the closest points are the support vertices
};

struct ContactPoint
{
    btVector3 fromTouch;  ///< to a point of B, from that of the touch; world axes
    btScalar distance;    ///< along the normal, where A has its point; not less than that of the touch
};

struct ContactPatch
{
    std::array<ContactPoint, 4> points;
    int count = 0;
};

/// Length units of the world.
struct PatchLimits
{
    double distance;  ///< points farther apart are left out; at least that of the touch
    btScalar same;    ///< no point but the deepest is nearer to that: a manifold would take the two for one
    int most = 4;     ///< points: 1 to 4
};

/// Faces of hulls of which only the points are known; null: as the hull has them.
struct PatchFans
{
    const VertexFan<btScalar>* a = nullptr;
    const VertexFan<btScalar>* b = nullptr;
};

/// Of the points at which the cores are within a limit of each other along the normal, those that carry, at most so many as
/// the limits say: the deepest, or one that is deep up to a thousandth of what is left to the limit, and around it.
///
/// A point carries if it is hardly farther apart than the touch: by a tenth of PatchLimits::same, or by a fiftieth of its
/// distance from the touch, so that a box that lands a degree from flat lands on four points at once. Where bodies meet at
/// more of a slope, the others would be rows of the solver without an impulse: a wheel of many sides has the two ends of an
/// edge.
///
/// Of either core the face at its support vertex that is aligned best with the normal is taken. What is within the limit
/// of the one face is clipped to the prism over the other along the normal (Sutherland and Hodgman 1974, "Reentrant
/// Polygon Clipping"); the corners that remain are points of the one face, and the heights of the other's plane over them
/// are the distances. Heights are measured along the contact normal, not along that of a face, so that none is less than
/// the true distance. If no corner is as deep as the touch (edges that cross outside of both faces), that is added.
/// Faces with more than 16 corners are thinned out to 16, which leaves out a rim of a round face: 0.02 of its radius.
///
/// For a corner, an edge of a capsule or a sphere, the patch has one or two points.
///
/// In the precision of the shapes: points are off by some roundings of the distance between the touch and the centres.
///
/// Cost: O(p q) for faces of p and q corners, and two supports where the touch does not name the vertices; no allocation.
///
/// @param fans of hulls without a graph, around the touch's vertices
ContactPatch makeContactPatch(const PosedShape& a, const PosedShape& b, const Touch& touch,
                              const PatchLimits& limits, const PatchFans& fans = {});
}  // namespace CULLET_PRECISION
}  // namespace cullet
