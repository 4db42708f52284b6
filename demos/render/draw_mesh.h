// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace cullet
{
/// Triangles with a normal at each vertex, counterclockwise seen from outside.
struct DrawMesh
{
    std::vector<Eigen::Vector3f> positions;
    std::vector<Eigen::Vector3f> normals;  ///< [positions.size()] unit length
    std::vector<std::uint32_t> triangles;  ///< three indices each

    /// Adds a triangle with its own vertices and its face normal; one without area is skipped.
    void addFlatTriangle(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c);

    void append(const DrawMesh& other);
};

/// A cube with edge 1 around the origin.
DrawMesh makeCubeMesh();

/// A point of an outline: distance from the axis, height along it, and the normal in the same plane.
struct OutlinePoint
{
    Eigen::Vector2f place;
    Eigen::Vector2f normal;
};

/// The surface of revolution of an outline about an axis (0, 1 or 2), with smooth normals.
///
/// @param outline from the lowest to the highest point; a crease is a point given twice with different normals
DrawMesh makeRevolvedMesh(const std::vector<OutlinePoint>& outline, int axis, int sides);

/// Half of a circle, from pole to pole, its upper half moved up and its lower half moved down by halfHeight.
std::vector<OutlinePoint> capsuleOutline(float radius, float halfHeight, int segments);

/// A closed cone stump; a cylinder when the radii are equal.
std::vector<OutlinePoint> coneOutline(float lowRadius, float highRadius, float halfHeight);
}  // namespace cullet
