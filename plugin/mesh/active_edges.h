// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"

#include <Eigen/Core>
#include <LinearMath/btVector3.h>

#include <cstddef>
#include <cstdint>

class btCollisionShape;

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Triangles in an array of any layout: the corners of each are three vectors in a row.
struct TriangleView
{
    const btVector3* first = nullptr;  ///< corners of the first triangle
    std::size_t stride = 0;            ///< bytes from one triangle to the next
    int count = 0;

    const btVector3* corners(int i) const
    {
        return reinterpret_cast<const btVector3*>(reinterpret_cast<const char*>(first) +
                                                  static_cast<std::size_t>(i) * stride);
    }
};

/// A contact of a convex core with a triangle, in the frame of the triangles, without margins.
struct TriangleContact
{
    Eigen::Vector3d normal;      ///< unit, from the triangle to the core
    Eigen::Vector3d onTriangle;  ///< closest or deepest point of the triangle
    double distance;             ///< of the cores along the normal; negative: depth
};

enum class EdgeVerdict : std::uint8_t
{
    Keep,  ///< the contact is as it was
    Turn,  ///< the contact has another normal, and the distance along it
    Skip   ///< another triangle is closer to the core, and has the contact
};

/// Corrects the contact of a triangle at an edge or a corner that a neighbour covers: a body that slides from triangle to
/// triangle would hit the edges between them.
///
/// Neighbours are the triangles of the view that share the edge or the corner, with equal coordinates; duplicates of the
/// triangle are none. The core's side of the triangle counts, and the winding does not.
///
/// - An edge or corner is inactive if no neighbour falls off from the triangle's plane by more than 5 degrees, and
///   neighbours surround it. There, the normal becomes that of the triangle.
/// - At an active edge, a normal beyond that of the neighbour's face becomes that one.
/// - A triangle is skipped if a neighbour is closer to the core: if the way from the contact into the neighbour leads
///   towards the core. So the closest triangle of the view is never skipped. Normals within 5 degrees of the triangle's
///   are turned instead, so that a face that lies down on a mesh is supported under all of its corners; but not at edges
///   that fall off, where the triangle's plane is above the mesh.
/// - Contacts of cores that overlap are never skipped.
///
/// The new contact is at the core's point of the old one. Its distance is not less than that of the cores along the new
/// normal; if cores overlap, it may be much more, and the caller measures the depth along the new normal.
///
/// Cost: nothing for a normal along the triangle's own, else one scan of the view; no allocation.
///
/// @param triangles candidates in a box around the core: without those that touch the triangle outside of it
/// @param which     the triangle of the contact
/// @param inside    a point in the core: determines the side of a triangle whose plane the core crosses
EdgeVerdict correctAtEdges(const TriangleView& triangles, int which, const Eigen::Vector3d& inside,
                           TriangleContact& contact);

/// Whether the application has prepared a mesh for Bullet's btAdjustInternalEdgeContacts(), which corrects contacts
/// after they were added.
bool hasInternalEdges(const btCollisionShape& mesh);
}  // namespace CULLET_PRECISION
}  // namespace cullet
