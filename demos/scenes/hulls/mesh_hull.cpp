// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/hulls/mesh_hull.h"

#include "cullet/demos/scenes/hulls/mesh_file.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

namespace cullet
{
namespace
{
using Direction = std::array<double, 3>;

/// `count` directions spread evenly over the sphere: Gonzalez 2010, "Measurement of Areas on a Sphere Using Fibonacci
/// and Latitude-Longitude Lattices".
std::vector<Direction> sphereDirections(std::size_t count)
{
    const double goldenAngle = 2.399963229728653;
    std::vector<Direction> directions;
    for (std::size_t i = 0; i < count; ++i)
    {
        const double height = 1.0 - (2.0 * static_cast<double>(i) + 1.0) / static_cast<double>(count);
        const double radius = std::sqrt(1.0 - height * height);
        const double angle = goldenAngle * static_cast<double>(i);
        directions.push_back({radius * std::cos(angle), height, radius * std::sin(angle)});
    }
    return directions;
}

Direction subtract(const Point& a, const Point& b)
{
    return {static_cast<double>(a[0]) - b[0], static_cast<double>(a[1]) - b[1],
            static_cast<double>(a[2]) - b[2]};
}

Direction cross(const Direction& a, const Direction& b)
{
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double dot(const Direction& a, const Direction& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// True when the points have volume: six times that of the largest tetrahedron found greedily, against the cube of
/// their size.
bool hasVolume(const std::vector<Point>& points)
{
    const auto farthest = [&](auto measure)
    {
        return *std::max_element(points.begin(), points.end(),
                                 [&](const Point& a, const Point& b) { return measure(a) < measure(b); });
    };
    const Point& origin = points.front();
    const Direction edge = subtract(
        farthest([&](const Point& p) { return dot(subtract(p, origin), subtract(p, origin)); }), origin);
    const auto areaVector = [&](const Point& p) { return cross(edge, subtract(p, origin)); };
    const Direction normal =
        areaVector(farthest([&](const Point& p) { return dot(areaVector(p), areaVector(p)); }));
    const auto volume = [&](const Point& p) { return std::fabs(dot(normal, subtract(p, origin))); };
    const double size = std::sqrt(dot(edge, edge));
    return volume(farthest(volume)) > 1e-4 * size * size * size;
}

/// Moves the mean to the origin and the longest edge of the bounds to 1; in double, where differences of floats do not
/// overflow.
std::vector<Point> centreAndScale(const std::vector<Point>& points)
{
    double longest = 0.0;
    Direction mean = {};
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
        const auto [low, high] =
            std::minmax_element(points.begin(), points.end(),
                                [axis](const Point& a, const Point& b) { return a[axis] < b[axis]; });
        longest = std::max(longest, static_cast<double>((*high)[axis]) - (*low)[axis]);
        for (const Point& point : points)
            mean[axis] += point[axis] / static_cast<double>(points.size());
    }
    std::vector<Point> result = points;
    for (Point& point : result)
    {
        for (std::size_t axis = 0; axis < 3; ++axis)
            point[axis] = static_cast<float>((point[axis] - mean[axis]) / longest);
    }
    return result;
}

/// Size of a file in bytes; 0 if it is unknown, as for a device.
std::uint64_t sizeOfMesh(const std::string& path)
{
    std::error_code error;
    if (!std::filesystem::exists(path, error))
        throw MeshError("mesh '" + path + "': no such file");
    if (std::filesystem::is_directory(path, error))
        throw MeshError("mesh '" + path + "': is a folder");
    const std::uintmax_t bytes = std::filesystem::file_size(path, error);
    return error ? 0 : bytes;
}
}  // namespace

HullPoints reduceToHull(std::string name, const std::vector<Point>& vertices)
{
    if (vertices.empty())
        throw MeshError("mesh '" + name + "': has no vertices");
    for (const Point& vertex : vertices)
    {
        if (!std::isfinite(vertex[0]) || !std::isfinite(vertex[1]) || !std::isfinite(vertex[2]))
            throw MeshError("mesh '" + name + "': has a vertex that is not finite");
    }
    std::set<std::size_t> kept;
    for (const Direction& direction : sphereDirections(kMaxHullPoints))
    {
        const auto reach = [&](const Point& p)
        { return direction[0] * p[0] + direction[1] * p[1] + direction[2] * p[2]; };
        const auto extreme =
            std::max_element(vertices.begin(), vertices.end(),
                             [&](const Point& a, const Point& b) { return reach(a) < reach(b); });
        kept.insert(static_cast<std::size_t>(extreme - vertices.begin()));
    }
    HullPoints hull;
    hull.meshVertices = vertices.size();
    for (const std::size_t index : kept)
        hull.points.push_back(vertices[index]);
    std::sort(hull.points.begin(), hull.points.end());
    hull.points.erase(std::unique(hull.points.begin(), hull.points.end()), hull.points.end());
    if (hull.points.size() < 4 || !hasVolume(hull.points))
        throw MeshError("mesh '" + name + "': is flat, its convex hull has no volume");
    hull.points = centreAndScale(hull.points);
    hull.name = std::move(name);
    return hull;
}

HullPoints loadMeshHull(const std::string& path)
{
    HullPoints hull = reduceToHull(path, readMeshVertices(path, limitsForMesh(sizeOfMesh(path))));
    hull.name = std::filesystem::path(path).filename().string();
    return hull;
}
}  // namespace cullet
