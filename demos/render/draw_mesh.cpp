// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/render/draw_mesh.h"

#include <Eigen/Geometry>

#include <cmath>

namespace cullet
{
void DrawMesh::addFlatTriangle(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c)
{
    const Eigen::Vector3f normal = (b - a).cross(c - a);
    const float length = normal.norm();
    if (!(length > 0))
        return;
    for (const Eigen::Vector3f& corner : {a, b, c})
    {
        triangles.push_back(static_cast<std::uint32_t>(positions.size()));
        positions.push_back(corner);
        normals.push_back(normal / length);
    }
}

void DrawMesh::append(const DrawMesh& other)
{
    const auto first = static_cast<std::uint32_t>(positions.size());
    positions.insert(positions.end(), other.positions.begin(), other.positions.end());
    normals.insert(normals.end(), other.normals.begin(), other.normals.end());
    for (const std::uint32_t index : other.triangles)
        triangles.push_back(first + index);
}

DrawMesh makeCubeMesh()
{
    DrawMesh mesh;
    for (int axis = 0; axis < 3; ++axis)
    {
        for (const float side : {-0.5f, 0.5f})
        {
            const auto corner = [&](float u, float v)
            {
                Eigen::Vector3f point;
                point[axis] = side;
                point[(axis + 1) % 3] = side > 0 ? u : v;
                point[(axis + 2) % 3] = side > 0 ? v : u;
                return point;
            };
            mesh.addFlatTriangle(corner(-0.5f, -0.5f), corner(0.5f, -0.5f), corner(0.5f, 0.5f));
            mesh.addFlatTriangle(corner(-0.5f, -0.5f), corner(0.5f, 0.5f), corner(-0.5f, 0.5f));
        }
    }
    return mesh;
}

DrawMesh makeRevolvedMesh(const std::vector<OutlinePoint>& outline, int axis, int sides)
{
    constexpr double kTurn = 6.283185307179586;
    DrawMesh mesh;
    const auto count = static_cast<std::uint32_t>(outline.size());
    for (int side = 0; side <= sides; ++side)
    {
        const auto angle = static_cast<float>(kTurn * (side % sides) / sides);
        const auto turned = [&](const Eigen::Vector2f& flat)
        {
            Eigen::Vector3f point;
            point[axis] = flat.y();
            point[(axis + 1) % 3] = flat.x() * std::cos(angle);
            point[(axis + 2) % 3] = flat.x() * std::sin(angle);
            return point;
        };
        for (const OutlinePoint& point : outline)
        {
            mesh.positions.push_back(turned(point.place));
            mesh.normals.push_back(turned(point.normal).normalized());
        }
    }
    for (std::uint32_t ring = 0; ring < static_cast<std::uint32_t>(sides); ++ring)
    {
        for (std::uint32_t i = 0; i + 1 < count; ++i)
        {
            const std::uint32_t a = ring * count + i, b = a + count;
            mesh.triangles.insert(mesh.triangles.end(), {a, b, b + 1, a, b + 1, a + 1});
        }
    }
    return mesh;
}

std::vector<OutlinePoint> capsuleOutline(float radius, float halfHeight, int segments)
{
    std::vector<OutlinePoint> outline;
    for (int i = 0; i <= segments; ++i)
    {
        const double angle = 3.141592653589793 * (static_cast<double>(i) / segments - 0.5);
        const Eigen::Vector2f normal(static_cast<float>(std::cos(angle)),
                                     static_cast<float>(std::sin(angle)));
        const auto at = [&](float shift) {
            return OutlinePoint{normal * radius + Eigen::Vector2f(0, shift), normal};
        };
        if (2 * i <= segments)
            outline.push_back(at(-halfHeight));
        if (2 * i >= segments && (halfHeight > 0 || 2 * i > segments))
            outline.push_back(at(halfHeight));
    }
    return outline;
}

std::vector<OutlinePoint> coneOutline(float lowRadius, float highRadius, float halfHeight)
{
    const Eigen::Vector2f low(lowRadius, -halfHeight), high(highRadius, halfHeight);
    const Eigen::Vector2f slope = Eigen::Vector2f(2 * halfHeight, lowRadius - highRadius).normalized();
    const Eigen::Vector2f up(0, 1);
    std::vector<OutlinePoint> outline = {{{0, -halfHeight}, -up}, {low, -up}, {low, slope}, {high, slope}};
    if (highRadius > 0)
        outline.insert(outline.end(), {{high, up}, {{0, halfHeight}, up}});
    return outline;
}
}  // namespace cullet
