// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "narrow/triangulation.h"

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace cullet
{
/// Joins the triangles of a convex surface that lie in one plane to polygons.
///
/// A polygon grows from its largest triangle over neighbours all of whose corners are within `tolerance` of that
/// triangle's plane, so the error does not add up along a curved surface. Slivers end up in a larger neighbour.
/// Corners that touch fewer than three polygons lie inside an edge and are left out of the outlines; except where too
/// few would be left, on a hull thinner than the tolerance.
class FaceMerger
{
public:
    struct Polygon
    {
        Eigen::Vector3d normal;  ///< unit, of the largest triangle
        std::vector<std::int32_t> corners;
    };

    /// Two polygons share the edge from -> to, which is counter-clockwise in `left`.
    struct Edge
    {
        std::int32_t from, to, left, right;
    };

    FaceMerger(const std::vector<Eigen::Vector3d>& points,
               const std::vector<Triangulation::Triangle>& triangles, double tolerance)
        : m_points(points),
          m_triangles(triangles),
          m_faceOf(triangles.size(), -1),
          m_valence(points.size(), 0)
    {
        std::vector<double> area(triangles.size());
        for (std::size_t i = 0; i < triangles.size(); ++i)
            area[i] = scaledNormal(points, triangles[i]).norm();
        std::vector<std::int32_t> order(triangles.size());
        std::iota(order.begin(), order.end(), 0);
        std::stable_sort(order.begin(), order.end(),
                         [&area](std::int32_t l, std::int32_t r) { return area[l] > area[r]; });
        for (const std::int32_t seed : order)
        {
            if (m_faceOf[seed] < 0)
                grow(seed, tolerance);
        }
        countValence();
        traceOutlines();
        collectEdges();
    }

    const std::vector<Polygon>& polygons() const { return m_polygons; }
    const std::vector<Edge>& edges() const { return m_edges; }

private:
    void grow(std::int32_t seed, double tolerance)
    {
        const std::int32_t face = static_cast<std::int32_t>(m_polygons.size());
        const Eigen::Vector3d scaled = scaledNormal(m_points, m_triangles[seed]);
        const double length = scaled.norm();
        const Eigen::Vector3d normal =
            length > 0.0 ? Eigen::Vector3d(scaled / length) : Eigen::Vector3d::UnitX();
        const Eigen::Vector3d& origin = m_points[m_triangles[seed].vertex[0]];
        std::vector<std::int32_t> members = {seed};
        m_faceOf[seed] = face;
        for (std::size_t i = 0; i < members.size(); ++i)
        {
            for (const std::int32_t next : m_triangles[members[i]].neighbour)
            {
                const Triangulation::Triangle& t = m_triangles[next];
                bool isLevel = m_faceOf[next] < 0 && scaledNormal(m_points, t).dot(normal) >= 0.0;
                for (const std::int32_t corner : t.vertex)
                    isLevel = isLevel && std::abs(normal.dot(m_points[corner] - origin)) <= tolerance;
                if (!isLevel)
                    continue;
                m_faceOf[next] = face;
                members.push_back(next);
            }
        }
        m_polygons.push_back({normal, {}});
        m_members.push_back(std::move(members));
    }

    bool isOutline(std::int32_t triangle, int k) const
    {
        return m_faceOf[m_triangles[triangle].neighbour[k]] != m_faceOf[triangle];
    }

    /// Polygons at a corner = outline edges that start there.
    void countValence()
    {
        for (std::size_t i = 0; i < m_triangles.size(); ++i)
        {
            for (int k = 0; k < 3; ++k)
            {
                if (isOutline(static_cast<std::int32_t>(i), k))
                    ++m_valence[m_triangles[i].vertex[k]];
            }
        }
    }

    void traceOutlines()
    {
        for (std::size_t face = 0; face < m_polygons.size(); ++face)
        {
            std::vector<std::pair<std::int32_t, std::int32_t>> next;
            for (const std::int32_t triangle : m_members[face])
            {
                for (int k = 0; k < 3; ++k)
                {
                    const auto& vertex = m_triangles[triangle].vertex;
                    if (isOutline(triangle, k))
                        next.emplace_back(vertex[k], vertex[(k + 1) % 3]);
                }
            }
            std::sort(next.begin(), next.end());
            m_polygons[face].corners = walk(next);
        }
    }

    std::vector<std::int32_t> walk(const std::vector<std::pair<std::int32_t, std::int32_t>>& next) const
    {
        std::vector<std::int32_t> all;
        std::vector<std::int32_t> corners;
        std::int32_t vertex = next.front().first;
        for (std::size_t i = 0; i < next.size(); ++i)
        {
            all.push_back(vertex);
            if (m_valence[vertex] >= 3)
                corners.push_back(vertex);
            vertex =
                std::lower_bound(next.begin(), next.end(), std::make_pair(vertex, std::int32_t(-1)))->second;
        }
        return corners.size() >= 3 ? corners : all;
    }

    /// One edge per run of outline edges between the same two polygons: from corner to corner.
    void collectEdges()
    {
        std::vector<std::array<std::int32_t, 3>> sides;  // from, to, face
        for (std::size_t face = 0; face < m_polygons.size(); ++face)
        {
            const std::vector<std::int32_t>& corners = m_polygons[face].corners;
            for (std::size_t i = 0; i < corners.size(); ++i)
                sides.push_back(
                    {corners[i], corners[(i + 1) % corners.size()], static_cast<std::int32_t>(face)});
        }
        std::sort(sides.begin(), sides.end());
        for (const auto& side : sides)
        {
            if (side[0] > side[1])
                continue;
            const auto other = std::lower_bound(sides.begin(), sides.end(),
                                                std::array<std::int32_t, 3>{side[1], side[0], -1});
            if (other != sides.end() && (*other)[0] == side[1] && (*other)[1] == side[0])
                m_edges.push_back({side[0], side[1], side[2], (*other)[2]});
        }
    }

    const std::vector<Eigen::Vector3d>& m_points;
    const std::vector<Triangulation::Triangle>& m_triangles;
    std::vector<std::int32_t> m_faceOf;
    std::vector<std::int32_t> m_valence;
    std::vector<std::vector<std::int32_t>> m_members;
    std::vector<Polygon> m_polygons;
    std::vector<Edge> m_edges;
};
}  // namespace cullet
