// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <array>
#include <stdexcept>
#include <string>
#include <vector>

namespace cullet
{
using Point = std::array<float, 3>;

/// Thrown for a mesh file that is unusable as a body; what() is one line that names the file and the reason.
class MeshError : public std::runtime_error
{
public:
    using std::runtime_error::runtime_error;
};

/// The vertices of a convex hull around its own centre.
struct HullPoints
{
    std::string name;  ///< file name without its folder
    std::vector<Point> points;
    std::size_t meshVertices = 0;  ///< vertices in the file
};

constexpr std::size_t kMaxHullPoints = 64;

/// Reads every mesh of a file (all that Assimp reads: obj, 3ds, ply, stl, ...) as one convex hull of about 1 m.
///
/// The hull is reduced by direction sampling: of all vertices those are kept that are extreme in one of 64 directions
/// (a Fibonacci spiral on the unit sphere). Each is a vertex of the true hull, so the result lies inside of it; for the
/// meshes of glmark2 it misses less than 3 % of its extent. Then the points are moved so that their mean is the origin
/// and scaled so that the longest edge of their bounds is 1.
///
/// @throws MeshError if the file is missing, not readable, without vertices, flat, has a NaN or an infinity, or exceeds
///         limitsForMesh()
HullPoints loadMeshHull(const std::string& path);

/// The reduction alone; throws MeshError with `name` in its text.
HullPoints reduceToHull(std::string name, const std::vector<Point>& vertices);
}  // namespace cullet
