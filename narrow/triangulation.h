// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "narrow/debug_containers.h"
#include "narrow/exact_orientation.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

namespace cullet
{
/// Triangulated surface of the convex hull of a point set that spans space: quickhull with exact predicates.
///
/// Barber, Dobkin and Huhdanpaa 1996, "The Quickhull Algorithm for Convex Hulls", with two differences: the sign of
/// every orientation is exact, so no facet is ever concave; a point in the plane of a facet does not see it, so that
/// coplanar facets come out as several triangles in one plane. Points inside or on the surface are left over.
class Triangulation
{
public:
    struct Triangle
    {
        std::array<std::int32_t, 3> vertex;     ///< indices of points, counter-clockwise from outside
        std::array<std::int32_t, 3> neighbour;  ///< triangle across the edge vertex[i], vertex[(i + 1) % 3]
    };

    /// @param points finite, without duplicates
    /// @param seed   indices of four points that are not coplanar
    Triangulation(const std::vector<Eigen::Vector3d>& points, std::array<std::int32_t, 4> seed)
        : m_points(points)
    {
        start(seed);
        for (std::size_t face = 0; face < m_work.size(); ++face)
        {
            // A live face keeps its points until one of them replaces it, by faces that come later in the list.
            if (m_work[face].isAlive && !m_work[face].outside.empty())
                insertFarthest(static_cast<std::int32_t>(face));
        }
        compact();
    }

    const std::vector<Triangle>& triangles() const { return m_triangles; }

    /// Points that are no vertex of a triangle, inside or on the surface, ascending.
    const std::vector<std::int32_t>& leftOver() const { return m_leftOver; }

    /// Points that are extreme, ascending. A vertex inside an edge of the hull has two planes around it and edges between
    /// them on two sides only, one inside a face has none; exact.
    std::vector<std::int32_t> corners() const
    {
        std::vector<std::int32_t> bends(m_points.size(), 0);
        for (const Triangle& t : m_triangles)
        {
            for (int k = 0; k < 3; ++k)
            {
                const std::array<std::int32_t, 3>& across = m_triangles[t.neighbour[k]].vertex;
                const auto apex = [&](std::int32_t v)
                { return v != t.vertex[k] && v != t.vertex[(k + 1) % 3]; };
                const std::int32_t far = *std::find_if(across.begin(), across.end(), apex);
                bends[t.vertex[k]] += orientation(m_points[t.vertex[0]], m_points[t.vertex[1]],
                                                  m_points[t.vertex[2]], m_points[far]) != 0;
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
    struct Face
    {
        Triangle triangle;
        std::vector<std::int32_t> outside;
        bool isAlive = true;
        bool isVisible = false;
    };

    struct HorizonEdge
    {
        std::int32_t from, to, outer;
    };

    bool sees(std::int32_t point, const Triangle& t) const
    {
        return orientation(m_points[t.vertex[0]], m_points[t.vertex[1]], m_points[t.vertex[2]],
                           m_points[point]) > 0;
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
        std::vector<std::int32_t> rest;
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(m_points.size()); ++i)
        {
            if (std::find(seed.begin(), seed.end(), i) == seed.end())
                rest.push_back(i);
        }
        distribute(rest, 0);
    }

    void addFace(const Triangle& triangle)
    {
        m_work.emplace_back();
        m_work.back().triangle = triangle;
    }

    /// Gives each point to one face that it sees, from `firstFace` on, if there is one.
    void distribute(const std::vector<std::int32_t>& points, std::size_t firstFace)
    {
        for (const std::int32_t point : points)
        {
            std::size_t face = firstFace;
            while (face < m_work.size() && !sees(point, m_work[face].triangle))
                ++face;
            if (face < m_work.size())
                m_work[face].outside.push_back(point);
        }
    }

    std::int32_t farthest(const Face& face) const
    {
        const Eigen::Vector3d& origin = m_points[face.triangle.vertex[0]];
        const Eigen::Vector3d normal =
            (m_points[face.triangle.vertex[1]] - origin).cross(m_points[face.triangle.vertex[2]] - origin);
        std::int32_t best = face.outside.front();
        double bestHeight = normal.dot(m_points[best] - origin);
        for (const std::int32_t point : face.outside)
        {
            const double height = normal.dot(m_points[point] - origin);
            if (height > bestHeight)
            {
                best = point;
                bestHeight = height;
            }
        }
        return best;
    }

    void insertFarthest(std::int32_t first)
    {
        const std::int32_t point = farthest(m_work[first]);
        std::vector<std::int32_t> visible = collectVisible(first, point);
        const std::vector<HorizonEdge> horizon = collectHorizon(visible);
        const std::int32_t firstNew = static_cast<std::int32_t>(m_work.size());
        const std::int32_t count = static_cast<std::int32_t>(horizon.size());
        for (std::int32_t i = 0; i < count; ++i)
        {
            const HorizonEdge& edge = horizon[i];
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
        std::vector<std::int32_t> orphans;
        for (const std::int32_t face : visible)
        {
            Face& dead = m_work[face];
            dead.isAlive = false;
            for (const std::int32_t orphan : dead.outside)
            {
                if (orphan != point)
                    orphans.push_back(orphan);
            }
            std::vector<std::int32_t>().swap(dead.outside);
        }
        distribute(orphans, static_cast<std::size_t>(firstNew));
    }

    std::vector<std::int32_t> collectVisible(std::int32_t first, std::int32_t point)
    {
        std::vector<std::int32_t> visible = {first};
        m_work[first].isVisible = true;
        for (std::size_t i = 0; i < visible.size(); ++i)
        {
            for (const std::int32_t neighbour : m_work[visible[i]].triangle.neighbour)
            {
                Face& face = m_work[neighbour];
                if (!face.isVisible && sees(point, face.triangle))
                {
                    face.isVisible = true;
                    visible.push_back(neighbour);
                }
            }
        }
        return visible;
    }

    /// The closed walk of edges between what the new point sees and what it does not.
    std::vector<HorizonEdge> collectHorizon(const std::vector<std::int32_t>& visible) const
    {
        std::vector<HorizonEdge> edges;
        for (const std::int32_t face : visible)
        {
            const Triangle& t = m_work[face].triangle;
            for (int k = 0; k < 3; ++k)
            {
                if (!m_work[t.neighbour[k]].isVisible)
                    edges.push_back({t.vertex[k], t.vertex[(k + 1) % 3], t.neighbour[k]});
            }
        }
        const auto byFrom = [](const HorizonEdge& l, const HorizonEdge& r) { return l.from < r.from; };
        std::sort(edges.begin(), edges.end(), byFrom);
        std::vector<HorizonEdge> walk = {edges.front()};
        while (walk.size() < edges.size())
            walk.push_back(
                *std::lower_bound(edges.begin(), edges.end(), HorizonEdge{walk.back().to, 0, 0}, byFrom));
        return walk;
    }

    void compact()
    {
        std::vector<std::int32_t> place(m_work.size(), -1);
        for (std::size_t i = 0; i < m_work.size(); ++i)
        {
            if (!m_work[i].isAlive)
                continue;
            place[i] = static_cast<std::int32_t>(m_triangles.size());
            m_triangles.push_back(m_work[i].triangle);
        }
        for (Triangle& triangle : m_triangles)
        {
            for (std::int32_t& neighbour : triangle.neighbour)
                neighbour = place[neighbour];
        }
        std::vector<Face>().swap(m_work);
        // Not only points that saw no face: a vertex all of whose triangles were replaced is none any more.
        std::vector<char> isVertex(m_points.size(), 0);
        for (const Triangle& triangle : m_triangles)
        {
            for (const std::int32_t vertex : triangle.vertex)
                isVertex[vertex] = 1;
        }
        for (std::size_t i = 0; i < m_points.size(); ++i)
        {
            if (isVertex[i] == 0)
                m_leftOver.push_back(static_cast<std::int32_t>(i));
        }
    }

    const std::vector<Eigen::Vector3d>& m_points;
    std::vector<Face> m_work;
    std::vector<Triangle> m_triangles;
    std::vector<std::int32_t> m_leftOver;
};

/// Outward normal of a triangle, twice its area long; right within 64 eps however thin the triangle is.
///
/// Taken at the corner opposite to the longest edge: there the product is least often so small that it has to be exact.
inline Eigen::Vector3d scaledNormal(const std::vector<Eigen::Vector3d>& points,
                                    const Triangulation::Triangle& t)
{
    int apex = 0;
    double longest = -1.0;
    for (int k = 0; k < 3; ++k)
    {
        const double length = (points[t.vertex[(k + 1) % 3]] - points[t.vertex[(k + 2) % 3]]).squaredNorm();
        apex = length > longest ? k : apex;
        longest = std::max(longest, length);
    }
    return accurateCross(points[t.vertex[apex]], points[t.vertex[(apex + 1) % 3]],
                         points[t.vertex[(apex + 2) % 3]]);
}
}  // namespace cullet
