// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/math/debug_containers.h"
#include "cullet/narrow/math/exact_orientation.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace cullet
{
/// Triangulated surface of the convex hull of a point set that spans space: quickhull with exact predicates.
///
/// Barber, Dobkin and Huhdanpaa 1996, "The Quickhull Algorithm for Convex Hulls", with two differences: the sign of
/// every orientation is exact, so no facet is ever concave; a facet is not visible from a point in its plane, so that
/// coplanar facets remain several triangles in one plane. Points inside or on the surface are left over.
///
/// Cost: usually O(n log n); see testCount().
class Quickhull
{
public:
    struct Triangle
    {
        std::array<std::int32_t, 3> vertex;     ///< indices of points, counter-clockwise from outside
        std::array<std::int32_t, 3> neighbour;  ///< triangle across the edge vertex[i], vertex[(i + 1) % 3]
    };

    /// @param points finite, without duplicates
    /// @param seed   indices of four points that are not coplanar
    Quickhull(const std::vector<Eigen::Vector3d>& points, std::array<std::int32_t, 4> seed)
        : m_points(points), m_next(points.size(), kNone), m_edgeFrom(points.size())
    {
        Eigen::Vector3d low = points[seed[0]], high = low;
        for (const Eigen::Vector3d& point : points)
        {
            low = low.cwiseMin(point);
            high = high.cwiseMax(point);
        }
        m_extent = high - low;
        start(seed);
        for (std::size_t face = 0; face < m_work.size(); ++face)
        {
            // A live face keeps its points until one of them replaces it by faces further down the list.
            if (m_work[face].isAlive && m_work[face].first != kNone)
                insertFarthest(static_cast<std::int32_t>(face));
        }
        compact();
    }

    const std::vector<Triangle>& triangles() const { return m_triangles; }

    /// Points that are no vertex of a triangle, inside or on the surface, ascending.
    const std::vector<std::int32_t>& leftOver() const { return m_leftOver; }

    /// Points that are vertices of triangles.
    std::int32_t vertexCount() const
    {
        return static_cast<std::int32_t>(m_points.size() - m_leftOver.size());
    }

    /// Points that were compared with the plane of a facet.
    std::uint64_t testCount() const { return m_testCount; }

    /// Points that are extreme, ascending. A vertex inside an edge of the hull has only two edges between different
    /// planes, a vertex inside a face none; the test is exact.
    std::vector<std::int32_t> corners() const
    {
        std::vector<std::int32_t> bends(m_points.size(), 0);
        for (std::size_t i = 0; i < m_triangles.size(); ++i)
        {
            const Triangle& t = m_triangles[i];
            for (int k = 0; k < 3; ++k)
            {
                // Each edge is counted by the triangle with the lower index.
                if (t.neighbour[k] < static_cast<std::int32_t>(i))
                    continue;
                const std::int32_t from = t.vertex[k], to = t.vertex[(k + 1) % 3];
                const std::array<std::int32_t, 3>& across = m_triangles[t.neighbour[k]].vertex;
                const std::int32_t far =
                    *std::find_if(across.begin(), across.end(),
                                  [from, to](std::int32_t v) { return v != from && v != to; });
                const int bend = orientation(m_points[t.vertex[0]], m_points[t.vertex[1]],
                                             m_points[t.vertex[2]], m_points[far]) != 0;
                bends[from] += bend;
                bends[to] += bend;
            }
        }
        std::vector<std::int32_t> corners;
        for (std::size_t i = 0; i < bends.size(); ++i)
        {
            if (bends[i] >= 3)
                corners.push_back(static_cast<std::int32_t>(i));
        }
        return corners;
    }

private:
    static constexpr std::int32_t kNone = -1;

    struct Face
    {
        Triangle triangle;
        Eigen::Vector3d normal;  ///< rounded
        double bound;            ///< a rounded height larger than this has the right sign
        double farthestHeight = 0.0;
        // The outside set: points from which the face is visible, linked by m_next.
        std::int32_t first = kNone, last = kNone, farthest = kNone;
        bool isAlive = true;
        bool isVisible = false;
    };

    struct HorizonEdge
    {
        std::int32_t from, to, outer;
    };

    /// Rounded height of a point over the plane, times the length of the normal.
    double heightOver(const Face& face, std::int32_t point) const
    {
        return face.normal.dot(m_points[point] - m_points[face.triangle.vertex[0]]);
    }

    bool sees(std::int32_t point, double height, const Face& face)
    {
        ++m_testCount;
        if (std::abs(height) > face.bound)
            return height > 0.0;
        const std::array<std::int32_t, 3>& v = face.triangle.vertex;
        return orientation(m_points[v[0]], m_points[v[1]], m_points[v[2]], m_points[point]) > 0;
    }

    void start(std::array<std::int32_t, 4> seed)
    {
        if (orientation(m_points[seed[0]], m_points[seed[1]], m_points[seed[2]], m_points[seed[3]]) > 0)
            std::swap(seed[1], seed[2]);
        const auto [a, b, c, d] = seed;
        addFace({{a, b, c}, {1, 2, 3}});
        addFace({{b, a, d}, {0, 3, 2}});
        addFace({{c, b, d}, {0, 1, 3}});
        addFace({{a, c, d}, {0, 2, 1}});
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(m_points.size()); ++i)
        {
            if (std::find(seed.begin(), seed.end(), i) == seed.end())
                distribute(i, 0);
        }
    }

    void addFace(const Triangle& triangle)
    {
        const Eigen::Vector3d& origin = m_points[triangle.vertex[0]];
        const Eigen::Vector3d ab = m_points[triangle.vertex[1]] - origin;
        const Eigen::Vector3d ac = m_points[triangle.vertex[2]] - origin;
        Face face;
        face.triangle = triangle;
        face.normal = ab.cross(ac);
        double permanent = 0.0;
        for (int i = 0; i < 3; ++i)
        {
            const int j = (i + 1) % 3;
            const int k = (i + 2) % 3;
            permanent += m_extent[i] * (std::abs(ab[j] * ac[k]) + std::abs(ab[k] * ac[j]));
        }
        // The bound of orientation(), for all points at once.
        face.bound = 1e-15 * permanent;
        m_work.push_back(face);
    }

    /// Adds a point to the outside set of the first visible face from `firstFace` on, if there is one.
    void distribute(std::int32_t point, std::size_t firstFace)
    {
        for (std::size_t i = firstFace; i < m_work.size(); ++i)
        {
            Face& face = m_work[i];
            const double height = heightOver(face, point);
            if (!sees(point, height, face))
                continue;
            append(face, point, height);
            return;
        }
    }

    void append(Face& face, std::int32_t point, double height)
    {
        m_next[point] = kNone;
        (face.first == kNone ? face.first : m_next[face.last]) = point;
        face.last = point;
        if (face.farthest == kNone || height > face.farthestHeight)
        {
            face.farthest = point;
            face.farthestHeight = height;
        }
    }

    void insertFarthest(std::int32_t first)
    {
        const std::int32_t point = m_work[first].farthest;
        collectVisible(first, point);
        collectHorizon();
        const std::int32_t firstNew = static_cast<std::int32_t>(m_work.size());
        addCone(point, firstNew);
        for (const std::int32_t face : m_visible)
        {
            m_work[face].isAlive = false;
            for (std::int32_t orphan = m_work[face].first; orphan != kNone;)
            {
                const std::int32_t next = m_next[orphan];
                if (orphan != point)
                    distribute(orphan, static_cast<std::size_t>(firstNew));
                orphan = next;
            }
        }
    }

    /// Adds the cone of faces from a point to the horizon.
    void addCone(std::int32_t point, std::int32_t firstNew)
    {
        const std::int32_t count = static_cast<std::int32_t>(m_horizon.size());
        for (std::int32_t i = 0; i < count; ++i)
        {
            const HorizonEdge& edge = m_horizon[i];
            const std::int32_t next = firstNew + (i + 1) % count;
            const std::int32_t previous = firstNew + (i + count - 1) % count;
            addFace({{edge.from, edge.to, point}, {edge.outer, next, previous}});
            Triangle& outer = m_work[edge.outer].triangle;
            for (int k = 0; k < 3; ++k)
            {
                if (outer.vertex[k] == edge.to)
                    outer.neighbour[k] = firstNew + i;
            }
        }
    }

    /// Collects the faces that are visible from a point.
    void collectVisible(std::int32_t first, std::int32_t point)
    {
        m_visible.assign(1, first);
        m_work[first].isVisible = true;
        for (std::size_t i = 0; i < m_visible.size(); ++i)
        {
            for (const std::int32_t neighbour : m_work[m_visible[i]].triangle.neighbour)
            {
                Face& face = m_work[neighbour];
                if (face.isVisible || !sees(point, heightOver(face, point), face))
                    continue;
                face.isVisible = true;
                m_visible.push_back(neighbour);
            }
        }
    }

    /// Collects the closed walk of edges between visible and other faces, from the lowest vertex on.
    void collectHorizon()
    {
        m_edges.clear();
        std::int32_t lowest = 0;
        for (const std::int32_t face : m_visible)
        {
            const Triangle& t = m_work[face].triangle;
            for (int k = 0; k < 3; ++k)
            {
                if (m_work[t.neighbour[k]].isVisible)
                    continue;
                const std::int32_t edge = static_cast<std::int32_t>(m_edges.size());
                m_edges.push_back({t.vertex[k], t.vertex[(k + 1) % 3], t.neighbour[k]});
                m_edgeFrom[t.vertex[k]] = edge;
                lowest = t.vertex[k] < m_edges[lowest].from ? edge : lowest;
            }
        }
        m_horizon.assign(1, m_edges[lowest]);
        while (m_horizon.size() < m_edges.size())
            m_horizon.push_back(m_edges[m_edgeFrom[m_horizon.back().to]]);
    }

    void compact()
    {
        std::vector<std::int32_t> place(m_work.size(), kNone);
        for (std::size_t i = 0; i < m_work.size(); ++i)
        {
            if (!m_work[i].isAlive)
                continue;
            place[i] = static_cast<std::int32_t>(m_triangles.size());
            m_triangles.push_back(m_work[i].triangle);
        }
        // Left over are not only points from which no face was visible, but also vertices all of whose triangles were
        // replaced.
        std::vector<char> isVertex(m_points.size(), 0);
        for (Triangle& triangle : m_triangles)
        {
            for (std::int32_t& neighbour : triangle.neighbour)
                neighbour = place[neighbour];
            for (const std::int32_t vertex : triangle.vertex)
                isVertex[vertex] = 1;
        }
        for (std::size_t i = 0; i < m_points.size(); ++i)
        {
            if (isVertex[i] == 0)
                m_leftOver.push_back(static_cast<std::int32_t>(i));
        }
        std::vector<Face>().swap(m_work);
        std::vector<std::int32_t>().swap(m_next);
        std::vector<std::int32_t>().swap(m_edgeFrom);
    }

    const std::vector<Eigen::Vector3d>& m_points;
    Eigen::Vector3d m_extent;  ///< of the box around all points
    std::vector<Face> m_work;
    std::vector<std::int32_t> m_next;      ///< by point
    std::vector<std::int32_t> m_edgeFrom;  ///< by point: the last edge of a horizon that started there
    std::vector<std::int32_t> m_visible;
    std::vector<HorizonEdge> m_edges, m_horizon;
    std::uint64_t m_testCount = 0;
    std::vector<Triangle> m_triangles;
    std::vector<std::int32_t> m_leftOver;
};

/// Outward normal of a triangle, twice its area long; a function of the corners alone, independent of their cyclic
/// order.
inline Eigen::Vector3d scaledNormal(const std::vector<Eigen::Vector3d>& points, const Quickhull::Triangle& t)
{
    std::array<std::int32_t, 3> v = t.vertex;
    std::rotate(v.begin(), std::min_element(v.begin(), v.end()), v.end());
    return scaledNormal(points[v[0]], points[v[1]], points[v[2]]);
}
}  // namespace cullet
