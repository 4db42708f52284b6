// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/mid/mesh_box.h"
#include "cullet/tests/support/random.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace cullet::test
{
using Point = std::array<double, 3>;
using Triangle = std::array<Point, 3>;
using Mesh = std::vector<Triangle>;

inline Point randomPoint(Random& random, float extent)
{
    const std::array<float, 3> point = random.point(-extent, extent);
    return {point[0], point[1], point[2]};
}

/// A triangle of about a size around a random point.
inline Triangle randomTriangle(Random& random, float extent, float size)
{
    const Point centre = randomPoint(random, extent);
    Triangle triangle;
    for (Point& corner : triangle)
    {
        const Point offset = randomPoint(random, size);
        for (std::size_t axis = 0; axis < 3; ++axis)
            corner[axis] = centre[axis] + offset[axis];
    }
    return triangle;
}

/// A mesh by the name of what is special about its triangles.
inline Mesh makeMesh(const std::string& kind, Random& random)
{
    Mesh mesh;
    if (kind == "empty")
        return mesh;
    if (kind == "single")
        return {randomTriangle(random, 5.0f, 5.0f)};
    for (int i = 0; i < 3000; ++i)
    {
        const float size = kind == "sizes" ? random.logUniform(-12, 7) : 1.0f;
        Triangle triangle = randomTriangle(random, 10.0f, size);
        if (kind == "degenerate" && i % 2 == 0)
            triangle[2] = i % 4 == 0 ? triangle[1] : triangle[0];
        if (kind == "duplicated" && i % 3 != 0)
            triangle = mesh.back();
        if (kind == "needles")
        {
            for (std::size_t axis = 0; axis < 3; ++axis)
                triangle[2][axis] = triangle[1][axis] + 1e-4 * (triangle[2][axis] - triangle[1][axis]);
        }
        if (kind == "nan" && i % 5 == 0)
            triangle[random.below(3)][random.below(3)] = std::numeric_limits<double>::quiet_NaN();
        if (kind == "infinite" && i % 5 == 0)
            triangle[random.below(3)][random.below(3)] = std::numeric_limits<double>::infinity();
        if (kind == "flat")
        {
            for (Point& corner : triangle)
                corner[1] = 0.0;
        }
        mesh.push_back(triangle);
    }
    return mesh;
}

inline const std::vector<std::string>& meshKinds()
{
    static const std::vector<std::string> kinds = {"empty",      "single",  "random", "degenerate",
                                                   "duplicated", "needles", "sizes",  "infinite",
                                                   "nan",        "flat"};
    return kinds;
}

inline std::vector<MeshBox> boxesOf(const Mesh& mesh)
{
    std::vector<MeshBox> boxes;
    boxes.reserve(mesh.size());
    for (const Triangle& triangle : mesh)
        boxes.push_back(boxOfTriangle(triangle.data(), 0.0));
    return boxes;
}

inline Point operator-(const Point& a, const Point& b)
{
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Point cross(const Point& a, const Point& b)
{
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double dot(const Point& a, const Point& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// Where a segment crosses a triangle, from either side (Moeller and Trumbore 1997).
inline std::optional<double> crossing(const Triangle& triangle, const Point& from, const Point& motion)
{
    const Point u = triangle[1] - triangle[0], v = triangle[2] - triangle[0], p = cross(motion, v);
    const double determinant = dot(u, p);
    const Point offset = from - triangle[0];
    const Point q = cross(offset, u);
    const double a = dot(offset, p) / determinant, b = dot(motion, q) / determinant;
    const double at = dot(v, q) / determinant;
    // Written so that a NaN is no crossing.
    if (determinant != 0.0 && a >= 0.0 && b >= 0.0 && a + b <= 1.0 && at >= 0.0 && at <= 1.0)
        return at;
    return std::nullopt;
}

/// Whether boxes meet; those without a NaN.
inline bool overlap(const MeshBox& a, const MeshBox& b)
{
    for (int axis = 0; axis < 3; ++axis)
    {
        if (a.max[axis] < b.min[axis] || b.max[axis] < a.min[axis])
            return false;
    }
    return true;
}
}  // namespace cullet::test
