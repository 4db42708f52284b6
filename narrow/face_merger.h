// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "narrow/debug_containers.h"
#include "narrow/triangulation.h"
#include "narrow/unit_vector.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

namespace cullet
{
/// Joins the triangles of a convex surface that lie in one plane to polygons.
///
/// A polygon grows from its largest triangle over neighbours that look to the same side and all of whose corners are
/// within `tolerance` of that triangle's plane, so the error does not add up along a curved surface. Slivers end up in
/// a larger neighbour.
///
/// A triangle that would make a polygon touch itself stays out, so every outline is a simple closed walk, whatever the
/// points: a polygon and a triangle on a sphere have a disc as their union if they meet in one edge and no other vertex,
/// or in two edges. The triangles of a disc are all reached so, in any order.
///
/// Vertices that touch fewer than three polygons and lie inside an edge are left out of the outlines, of both polygons
/// at once; except where fewer than three would be left.
class FaceMerger
{
public:
    struct Polygon
    {
        Eigen::Vector3d normal;             ///< unit, of the largest triangle
        std::vector<std::int32_t> corners;  ///< counter-clockwise from outside; three or more, each once
    };

    /// Two polygons share the edge from -> to, which is counter-clockwise in `left`.
    struct Edge
    {
        std::int32_t from, to, left, right;
    };

    /// @param triangles of a closed convex surface; none has its vertices on one line
    FaceMerger(const std::vector<Eigen::Vector3d>& points,
               const std::vector<Triangulation::Triangle>& triangles, double tolerance)
        : m_points(points),
          m_triangles(triangles),
          m_tolerance(tolerance),
          m_faceOf(triangles.size(), -1),
          m_touchedBy(points.size(), -1),
          m_isCorner(points.size(), 0)
    {
        std::vector<double> area;
        for (const Triangulation::Triangle& t : triangles)
        {
            m_normals.push_back(scaledNormal(points, t));
            area.push_back(m_normals.back().norm());
        }
        std::vector<std::int32_t> order(triangles.size());
        std::iota(order.begin(), order.end(), 0);
        std::stable_sort(order.begin(), order.end(),
                         [&area](std::int32_t l, std::int32_t r) { return area[l] > area[r]; });
        for (const std::int32_t seed : order)
        {
            if (m_faceOf[seed] < 0)
                grow(seed);
        }
        for (const std::vector<std::int32_t>& members : m_members)
            m_outlines.push_back(outlineOf(members));
        markJunctions();
        for (const Outline& outline : m_outlines)
            markBends(outline);
        storeCorners();
    }

    const std::vector<Polygon>& polygons() const { return m_polygons; }
    const std::vector<Edge>& edges() const { return m_edges; }

private:
    /// One side of a triangle on the outline of a polygon.
    struct Side
    {
        std::int32_t from, to;
        std::int32_t across;  ///< the polygon on the other side
    };
    using Outline = std::vector<Side>;  ///< in the order of a walk

    void grow(std::int32_t seed)
    {
        const std::int32_t face = static_cast<std::int32_t>(m_polygons.size());
        const Eigen::Vector3d normal = unitOf(m_normals[seed]);
        const Eigen::Vector3d& origin = m_points[m_triangles[seed].vertex[0]];
        std::vector<std::int32_t> members = {seed};
        join(seed, face);
        for (std::size_t i = 0; i < members.size(); ++i)
        {
            for (const std::int32_t next : m_triangles[members[i]].neighbour)
            {
                if (m_faceOf[next] >= 0 || m_normals[next].dot(normal) < 0.0 ||
                    !isLevel(next, normal, origin) || !keepsDisc(next, face))
                    continue;
                join(next, face);
                members.push_back(next);
            }
        }
        m_polygons.push_back({normal, {}});
        m_members.push_back(std::move(members));
    }

    void join(std::int32_t triangle, std::int32_t face)
    {
        m_faceOf[triangle] = face;
        for (const std::int32_t vertex : m_triangles[triangle].vertex)
            m_touchedBy[vertex] = face;
    }

    bool isLevel(std::int32_t triangle, const Eigen::Vector3d& normal, const Eigen::Vector3d& origin) const
    {
        const auto& vertex = m_triangles[triangle].vertex;
        return std::all_of(vertex.begin(), vertex.end(),
                           [&](std::int32_t v)
                           { return std::abs(normal.dot(m_points[v] - origin)) <= m_tolerance; });
    }

    /// Is the growing polygon a disc still if this triangle at its outline joins?
    bool keepsDisc(std::int32_t triangle, std::int32_t face) const
    {
        const Triangulation::Triangle& t = m_triangles[triangle];
        int sharedCount = 0;
        bool isApexFree = false;
        for (int k = 0; k < 3; ++k)
        {
            if (m_faceOf[t.neighbour[k]] != face)
                continue;
            ++sharedCount;
            isApexFree = m_touchedBy[t.vertex[(k + 2) % 3]] != face;
        }
        return sharedCount == 2 || (sharedCount == 1 && isApexFree);
    }

    Outline outlineOf(const std::vector<std::int32_t>& members) const
    {
        Outline sides;
        for (const std::int32_t triangle : members)
        {
            const Triangulation::Triangle& t = m_triangles[triangle];
            for (int k = 0; k < 3; ++k)
            {
                const std::int32_t across = m_faceOf[t.neighbour[k]];
                if (across != m_faceOf[triangle])
                    sides.push_back({t.vertex[k], t.vertex[(k + 1) % 3], across});
            }
        }
        const auto byFrom = [](const Side& l, const Side& r) { return l.from < r.from; };
        std::sort(sides.begin(), sides.end(), byFrom);
        Outline walk = {sides.front()};
        while (walk.size() < sides.size())
            walk.push_back(*std::lower_bound(sides.begin(), sides.end(), Side{walk.back().to, 0, 0}, byFrom));
        return walk;
    }

    /// Polygons at a vertex = outline sides that start there.
    void markJunctions()
    {
        std::vector<std::int32_t> valence(m_points.size(), 0);
        for (const Outline& outline : m_outlines)
        {
            for (const Side& side : outline)
                m_isCorner[side.from] = ++valence[side.from] >= 3;
        }
    }

    /// Marks where an outline bends between two polygons, and three corners at least.
    void markBends(Outline outline)
    {
        const auto isMarked = [this](const Side& side) { return m_isCorner[side.from] != 0; };
        auto first = std::find_if(outline.begin(), outline.end(), isMarked);
        if (first == outline.end())
            first = outline.begin();
        std::rotate(outline.begin(), first, outline.end());
        m_isCorner[outline[0].from] = 1;
        const std::size_t count = outline.size();
        outline.push_back(outline[0]);
        if (std::none_of(outline.begin() + 1, outline.end() - 1, isMarked))
            m_isCorner[outline[farthest(outline, 0, count).first].from] = 1;
        std::size_t begin = 0;
        for (std::size_t i = 1; i <= count; ++i)
        {
            if (!isMarked(outline[i]))
                continue;
            markBetween(outline, begin, i);
            begin = i;
        }
        if (std::count_if(outline.begin() + 1, outline.end(), isMarked) < 3)
            markThird(outline);
    }

    /// Splits a run until all vertices of a part are near the line between its ends. Two vertices that are level with two
    /// planes at a right angle are within 2 sqrt(2) tolerances of each other, across.
    void markBetween(const Outline& outline, std::size_t begin, std::size_t end)
    {
        const auto [middle, distance] = farthest(outline, begin, end);
        if (!(distance > 4.0 * m_tolerance))
            return;
        m_isCorner[outline[middle].from] = 1;
        markBetween(outline, begin, middle);
        markBetween(outline, middle, end);
    }

    /// On a polygon with two corners: the vertex farthest from the line between them.
    void markThird(const Outline& outline)
    {
        std::size_t second = 1;
        while (m_isCorner[outline[second].from] == 0)
            ++second;
        const std::size_t end = outline.size() - 1;
        const auto before = farthest(outline, 0, second);
        const auto after = farthest(outline, second, end);
        m_isCorner[outline[before.second > after.second ? before.first : after.first].from] = 1;
    }

    /// The vertex strictly between two of an outline that is farthest from the segment between them, and how far; -1 if
    /// there is none.
    std::pair<std::size_t, double> farthest(const Outline& outline, std::size_t begin, std::size_t end) const
    {
        const Eigen::Vector3d& from = m_points[outline[begin].from];
        const Eigen::Vector3d along = m_points[outline[end].from] - from;
        const double length2 = along.squaredNorm();
        std::pair<std::size_t, double> best = {begin, -1.0};
        for (std::size_t i = begin + 1; i < end; ++i)
        {
            const Eigen::Vector3d p = m_points[outline[i].from] - from;
            const double at = length2 > 0.0 ? std::min(std::max(p.dot(along) / length2, 0.0), 1.0) : 0.0;
            const double distance = (p - at * along).norm();
            if (distance > best.second)
                best = {i, distance};
        }
        return best;
    }

    /// One edge per run of sides between two corners: all have the same polygon on the other side.
    void storeCorners()
    {
        for (std::size_t face = 0; face < m_polygons.size(); ++face)
        {
            std::vector<std::int32_t>& corners = m_polygons[face].corners;
            std::vector<std::int32_t> across;
            for (const Side& side : m_outlines[face])
            {
                if (m_isCorner[side.from] == 0)
                    continue;
                corners.push_back(side.from);
                across.push_back(side.across);
            }
            for (std::size_t i = 0; i < corners.size(); ++i)
            {
                const std::int32_t to = corners[(i + 1) % corners.size()];
                if (corners[i] < to)
                    m_edges.push_back({corners[i], to, static_cast<std::int32_t>(face), across[i]});
            }
        }
        std::sort(m_edges.begin(), m_edges.end(),
                  [](const Edge& l, const Edge& r)
                  { return std::tie(l.from, l.to, l.left) < std::tie(r.from, r.to, r.left); });
    }

    const std::vector<Eigen::Vector3d>& m_points;
    const std::vector<Triangulation::Triangle>& m_triangles;
    const double m_tolerance;
    std::vector<Eigen::Vector3d> m_normals;  ///< by triangle, scaled
    std::vector<std::int32_t> m_faceOf;
    std::vector<std::int32_t> m_touchedBy;  ///< by point: the last polygon that a triangle there has joined
    std::vector<char> m_isCorner;           ///< by point
    std::vector<std::vector<std::int32_t>> m_members;
    std::vector<Outline> m_outlines;
    std::vector<Polygon> m_polygons;
    std::vector<Edge> m_edges;
};
}  // namespace cullet
