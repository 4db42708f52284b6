// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/build/quickhull.h"
#include "cullet/narrow/math/debug_containers.h"
#include "cullet/narrow/math/unit_vector.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <utility>
#include <vector>

namespace cullet
{
/// Merges coplanar triangles of a convex surface to polygons.
///
/// A polygon grows from its largest triangle over neighbours that face the same side and all of whose corners are
/// within `tolerance` of that triangle's plane, so the error does not accumulate along a curved surface. Slivers are
/// merged into a larger neighbour.
///
/// A triangle that would make a polygon touch itself is not merged, so every outline is a simple closed walk for any
/// points: on a sphere the union of a polygon and a triangle is a disc if they meet in one edge and no other vertex, or
/// in two edges. All triangles of a disc can be added this way, in any order.
///
/// Vertices of fewer than three polygons that lie inside an edge are removed from the outlines of both polygons, unless
/// fewer than three would remain.
class FaceMerger
{
public:
    struct Polygon
    {
        Eigen::Vector3d normal;  ///< unit, of the largest triangle
        std::int32_t
            begin;  ///< of its corners in corners(): counter-clockwise from outside, at least three, distinct
        std::int32_t count;
    };

    /// Two polygons share the edge from -> to, which is counter-clockwise in `left`.
    struct Edge
    {
        std::int32_t from, to, left, right;
    };

    /// @param triangles of a closed convex surface; none is collinear
    FaceMerger(const std::vector<Eigen::Vector3d>& points, const std::vector<Quickhull::Triangle>& triangles,
               double tolerance)
        : m_points(points),
          m_triangles(triangles),
          m_tolerance(tolerance),
          m_faceOf(triangles.size(), kNone),
          m_touchedBy(points.size(), kNone),
          m_sideFrom(points.size()),
          m_isCorner(points.size(), 0)
    {
        m_normals.reserve(triangles.size());
        m_members.reserve(triangles.size());
        for (const std::int32_t seed : largestFirst())
        {
            if (m_faceOf[seed] == kNone)
                grow(seed);
        }
        storeOutlines();
        markJunctions();
        for (std::size_t face = 0; face < m_polygons.size(); ++face)
            markBends(face);
        storeCorners();
    }

    const std::vector<Polygon>& polygons() const { return m_polygons; }
    /// Corners of all polygons, concatenated.
    const std::vector<std::int32_t>& corners() const { return m_corners; }
    const std::vector<Edge>& edges() const { return m_edges; }

private:
    static constexpr std::int32_t kNone = -1;

    /// One side of a triangle on the outline of a polygon.
    struct Side
    {
        std::int32_t from, to;
        std::int32_t across;  ///< the polygon on the other side
    };
    using Outline = std::vector<Side>;  ///< in the order of a walk

    /// Triangles by descending area, equal ones in their order.
    std::vector<std::int32_t> largestFirst()
    {
        std::vector<std::pair<double, std::int32_t>> byArea;
        byArea.reserve(m_triangles.size());
        for (const Quickhull::Triangle& t : m_triangles)
        {
            m_normals.push_back(scaledNormal(m_points, t));
            byArea.emplace_back(-m_normals.back().norm(), static_cast<std::int32_t>(byArea.size()));
        }
        std::sort(byArea.begin(), byArea.end());
        std::vector<std::int32_t> order;
        order.reserve(byArea.size());
        for (const auto& [area, triangle] : byArea)
            order.push_back(triangle);
        return order;
    }

    void grow(std::int32_t seed)
    {
        const std::int32_t face = static_cast<std::int32_t>(m_polygons.size());
        const Eigen::Vector3d normal = unitOf(m_normals[seed]);
        const Eigen::Vector3d& origin = m_points[m_triangles[seed].vertex[0]];
        std::size_t member = m_members.size();
        join(seed, face);
        for (; member < m_members.size(); ++member)
        {
            for (const std::int32_t next : m_triangles[m_members[member]].neighbour)
            {
                if (m_faceOf[next] == kNone && m_normals[next].dot(normal) >= 0.0 &&
                    isLevel(next, normal, origin) && keepsDisc(next, face))
                    join(next, face);
            }
        }
        m_polygons.push_back({normal, 0, 0});
        m_memberEnd.push_back(m_members.size());
    }

    void join(std::int32_t triangle, std::int32_t face)
    {
        m_members.push_back(triangle);
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

    /// Whether the growing polygon remains a disc with this triangle at its outline.
    bool keepsDisc(std::int32_t triangle, std::int32_t face) const
    {
        const Quickhull::Triangle& t = m_triangles[triangle];
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

    void storeOutlines()
    {
        m_sides.reserve(3 * m_triangles.size());
        Outline sides;
        std::size_t member = 0;
        for (const std::size_t end : m_memberEnd)
        {
            sides.clear();
            for (; member < end; ++member)
                addSides(m_members[member], sides);
            storeWalk(sides);
        }
    }

    void addSides(std::int32_t triangle, Outline& sides) const
    {
        const Quickhull::Triangle& t = m_triangles[triangle];
        for (int k = 0; k < 3; ++k)
        {
            const std::int32_t across = m_faceOf[t.neighbour[k]];
            if (across != m_faceOf[triangle])
                sides.push_back({t.vertex[k], t.vertex[(k + 1) % 3], across});
        }
    }

    /// Appends the sides of a polygon in the order of a walk from the lowest vertex.
    void storeWalk(const Outline& sides)
    {
        std::size_t next = 0;
        for (std::size_t i = 0; i < sides.size(); ++i)
        {
            m_sideFrom[sides[i].from] = static_cast<std::int32_t>(i);
            next = sides[i].from < sides[next].from ? i : next;
        }
        for (std::size_t i = 0; i < sides.size(); ++i)
        {
            m_sides.push_back(sides[next]);
            next = static_cast<std::size_t>(m_sideFrom[sides[next].to]);
        }
        m_outlineEnd.push_back(m_sides.size());
    }

    std::size_t outlineBegin(std::size_t face) const { return face == 0 ? 0 : m_outlineEnd[face - 1]; }

    /// Marks vertices of three or more polygons; the polygons at a vertex are the outline sides that start there.
    void markJunctions()
    {
        std::vector<std::int32_t> valence(m_points.size(), 0);
        for (const Side& side : m_sides)
            m_isCorner[side.from] = ++valence[side.from] >= 3;
    }

    /// Marks where an outline bends between two polygons, and at least three corners.
    void markBends(std::size_t face)
    {
        const auto isMarked = [this](const Side& side) { return m_isCorner[side.from] != 0; };
        const Side* const begin = &m_sides[outlineBegin(face)];
        const Side* const end = m_sides.data() + m_outlineEnd[face];
        // This holds for most faces of a round hull.
        if (std::all_of(begin, end, isMarked))
            return;
        Outline outline(begin, end);
        markBends(outline);
    }

    void markBends(Outline& outline)
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

    /// Splits a run until all vertices of a part are near the line between its ends. The points within the tolerance of
    /// two perpendicular planes span 2 sqrt(2) tolerances across their common line.
    void markBetween(const Outline& outline, std::size_t begin, std::size_t end)
    {
        const auto [middle, distance] = farthest(outline, begin, end);
        if (!(distance > 4.0 * m_tolerance))
            return;
        m_isCorner[outline[middle].from] = 1;
        markBetween(outline, begin, middle);
        markBetween(outline, middle, end);
    }

    /// Marks the vertex farthest from the line between the two corners of a polygon.
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

    /// The vertex strictly between two vertices of an outline that is farthest from their segment, and its distance; -1
    /// if there is none.
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
        m_corners.reserve(m_sides.size());
        m_edges.reserve(m_sides.size() / 2);
        std::vector<std::int32_t> across;
        for (std::size_t face = 0; face < m_polygons.size(); ++face)
        {
            const std::size_t begin = m_corners.size();
            across.clear();
            for (std::size_t i = outlineBegin(face); i < m_outlineEnd[face]; ++i)
            {
                if (m_isCorner[m_sides[i].from] == 0)
                    continue;
                m_corners.push_back(m_sides[i].from);
                across.push_back(m_sides[i].across);
            }
            m_polygons[face].begin = static_cast<std::int32_t>(begin);
            m_polygons[face].count = static_cast<std::int32_t>(across.size());
            for (std::size_t i = 0; i < across.size(); ++i)
            {
                const std::int32_t from = m_corners[begin + i];
                const std::int32_t to = m_corners[begin + (i + 1) % across.size()];
                if (from < to)
                    m_edges.push_back({from, to, static_cast<std::int32_t>(face), across[i]});
            }
        }
        std::sort(m_edges.begin(), m_edges.end(),
                  [](const Edge& l, const Edge& r)
                  { return std::tie(l.from, l.to, l.left) < std::tie(r.from, r.to, r.left); });
    }

    const std::vector<Eigen::Vector3d>& m_points;
    const std::vector<Quickhull::Triangle>& m_triangles;
    const double m_tolerance;
    std::vector<Eigen::Vector3d> m_normals;  ///< by triangle, scaled
    std::vector<std::int32_t> m_faceOf;
    std::vector<std::int32_t> m_touchedBy;  ///< by point: last polygon that received a triangle there
    std::vector<std::int32_t> m_sideFrom;   ///< by point: the last side that starts there
    std::vector<char> m_isCorner;           ///< by point
    std::vector<std::int32_t> m_members;    ///< triangles, by polygon
    std::vector<std::size_t> m_memberEnd;   ///< by polygon
    Outline m_sides;                        ///< by polygon
    std::vector<std::size_t> m_outlineEnd;  ///< by polygon
    std::vector<Polygon> m_polygons;
    std::vector<std::int32_t> m_corners;
    std::vector<Edge> m_edges;
};
}  // namespace cullet
