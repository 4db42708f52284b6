// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/build/morton_order.h"
#include "cullet/narrow/math/debug_containers.h"
#include "cullet/narrow/math/exact_orientation.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
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
    Quickhull(const std::vector<Eigen::Vector3d>& points, std::array<std::int32_t, 4> seed) : m_points(points)
    {
        const MortonOrder order(points);
        m_extent = order.extent();
        storeSites(order);
        for (std::int32_t& corner : seed)
            corner = order.placeOf(corner);
        start(seed, order);
        for (m_current = 0; m_current < m_queue.size(); ++m_current)
        {
            // A live face keeps its points until one of them replaces it by faces further down the queue.
            if (isLive(m_current) && m_faces[m_queue[m_current]].count > 0)
                insertFarthest(m_queue[m_current]);
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

    /// Whether a point was a vertex for a while, and is left over. If not, the triangles of the vertices alone are the
    /// same ones in the same order: a point that is never inserted changes no other one's face.
    bool hasReplacedVertices() const { return m_hasReplacedVertices; }

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

    /// A point. Sites near each other in space are near each other in memory, and so are the faces that replace each
    /// other, so that most of what an insertion reads is in a cache.
    struct Site
    {
        Eigen::Vector3d at;
        std::int32_t point;
    };

    /// Two cache lines. The memory of replaced faces is used again.
    struct alignas(64) Face
    {
        Eigen::Vector3d normal;  ///< rounded
        Eigen::Vector3d origin;  ///< the first corner
        double bound;            ///< a rounded height larger than this has the right sign
        double farthestHeight;
        std::array<std::int32_t, 3> corner;     ///< sites
        std::array<std::int32_t, 3> neighbour;  ///< as in Triangle
        // The outside set: sites in m_outside from which the face is visible.
        std::int32_t first, count, farthest;
        std::int32_t place;  ///< in m_queue, or none
        bool isVisible;
    };

    struct HorizonEdge
    {
        std::int32_t from, to, outer;
    };

    /// A site, and the face to whose outside set it goes.
    struct Choice
    {
        std::int32_t site, face;
    };

    void storeSites(const MortonOrder& order)
    {
        m_sites.reserve(m_points.size());
        for (const std::int32_t point : order.points())
            m_sites.push_back({m_points[point], point});
        m_edgeFrom.resize(m_points.size());
        m_outside.reserve(kOutsides * m_points.size());
        // Twice as many faces as points, if all are vertices; memory that is not used costs nothing.
        m_faces.reserve(2 * m_points.size() + kSpareFaces);
    }

    /// Rounded height of a point over the plane, times the length of the normal.
    static double heightOver(const Face& face, const Site& site)
    {
        return face.normal.dot(site.at - face.origin);
    }

    bool sees(const Site& site, double height, const Face& face)
    {
        ++m_testCount;
        if (std::abs(height) > face.bound)
            return height > 0.0;
        return orientation(face.origin, m_sites[face.corner[1]].at, m_sites[face.corner[2]].at, site.at) > 0;
    }

    void start(std::array<std::int32_t, 4> seed, const MortonOrder& order)
    {
        if (orientation(m_sites[seed[0]].at, m_sites[seed[1]].at, m_sites[seed[2]].at, m_sites[seed[3]].at) >
            0)
            std::swap(seed[1], seed[2]);
        const auto [a, b, c, d] = seed;
        m_inserted.assign(seed.begin(), seed.end());
        addFace({a, b, c}, {1, 2, 3});
        addFace({b, a, d}, {0, 3, 2});
        addFace({c, b, d}, {0, 1, 3});
        addFace({a, c, d}, {0, 2, 1});
        m_cone = {0, 1, 2, 3};
        std::vector<std::int32_t> sites;
        sites.reserve(m_points.size());
        for (std::int32_t point = 0; point < static_cast<std::int32_t>(m_points.size()); ++point)
        {
            const std::int32_t site = order.placeOf(point);
            if (std::find(seed.begin(), seed.end(), site) == seed.end())
                sites.push_back(site);
        }
        choose(sites.data(), sites.data() + sites.size());
        distribute();
    }

    /// @return its index
    std::int32_t addFace(const std::array<std::int32_t, 3>& corner,
                         const std::array<std::int32_t, 3>& neighbour)
    {
        std::int32_t index = static_cast<std::int32_t>(m_faces.size());
        if (m_free.empty())
            m_faces.emplace_back();
        else
        {
            index = m_free.back();
            m_free.pop_back();
        }
        Face& face = m_faces[index];
        face.origin = m_sites[corner[0]].at;
        const Eigen::Vector3d ab = m_sites[corner[1]].at - face.origin;
        const Eigen::Vector3d ac = m_sites[corner[2]].at - face.origin;
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
        face.farthestHeight = 0.0;
        face.corner = corner;
        face.neighbour = neighbour;
        face.first = face.count = 0;
        face.farthest = kNone;
        face.place = static_cast<std::int32_t>(m_queue.size());
        face.isVisible = false;
        m_queue.push_back(index);
        return index;
    }

    /// Chooses the first visible face of the cone for each of some sites; those that see none are left over.
    void choose(const std::int32_t* begin, const std::int32_t* end)
    {
        constexpr std::ptrdiff_t kAhead = 8;
        for (const std::int32_t* site = begin; site != end; ++site)
        {
            __builtin_prefetch(&m_sites[end - site > kAhead ? site[kAhead] : *site]);
            for (const std::int32_t index : m_cone)
            {
                Face& face = m_faces[index];
                const double height = heightOver(face, m_sites[*site]);
                if (!sees(m_sites[*site], height, face))
                    continue;
                m_chosen.push_back({*site, index});
                ++face.count;
                if (face.farthest == kNone || height > face.farthestHeight)
                {
                    face.farthest = *site;
                    face.farthestHeight = height;
                }
                break;
            }
        }
    }

    /// Stores the outside sets of the cone, each in the order of the choice.
    void distribute()
    {
        if (m_outside.size() + m_chosen.size() > kOutsides * m_points.size())
            compactOutside();
        std::int32_t end = static_cast<std::int32_t>(m_outside.size());
        for (const std::int32_t index : m_cone)
        {
            m_faces[index].first = end;
            end += std::exchange(m_faces[index].count, 0);
        }
        m_outside.resize(static_cast<std::size_t>(end));
        for (const Choice& choice : m_chosen)
        {
            Face& face = m_faces[choice.face];
            m_outside[face.first + face.count++] = choice.site;
        }
        m_chosen.clear();
    }

    /// Lets go of the outside sets of replaced faces. Those that are left belong to faces further down the queue, and
    /// none has a point of another.
    void compactOutside()
    {
        std::vector<std::int32_t> left;
        left.reserve(kOutsides * m_points.size());
        for (std::size_t place = m_current + 1; place < m_queue.size() - m_cone.size(); ++place)
        {
            if (!isLive(place))
                continue;
            Face& face = m_faces[m_queue[place]];
            const auto first = m_outside.begin() + face.first;
            face.first = static_cast<std::int32_t>(left.size());
            left.insert(left.end(), first, first + face.count);
        }
        m_outside.swap(left);
    }

    /// Whether the face that was added at a place is not replaced yet.
    bool isLive(std::size_t place) const
    {
        return m_faces[m_queue[place]].place == static_cast<std::int32_t>(place);
    }

    void insertFarthest(std::int32_t first)
    {
        const std::int32_t apex = m_faces[first].farthest;
        collectVisible(first, m_sites[apex]);
        collectHorizon();
        releaseVisible(apex);
        m_inserted.push_back(apex);
        addCone(apex);
        choose(m_orphans.data(), m_orphans.data() + m_orphans.size());
        distribute();
    }

    /// Collects the outside sets of the visible faces, and lets go of these.
    void releaseVisible(std::int32_t apex)
    {
        m_orphans.clear();
        for (const std::int32_t index : m_visible)
        {
            Face& face = m_faces[index];
            face.place = kNone;
            const auto begin = m_outside.begin() + face.first;
            std::copy_if(begin, begin + face.count, std::back_inserter(m_orphans),
                         [apex](std::int32_t site) { return site != apex; });
        }
        m_free.insert(m_free.end(), m_visible.begin(), m_visible.end());
    }

    /// Adds the cone of faces from a point to the horizon.
    void addCone(std::int32_t apex)
    {
        m_cone.clear();
        for (const HorizonEdge& edge : m_horizon)
            m_cone.push_back(addFace({edge.from, edge.to, apex}, {edge.outer, kNone, kNone}));
        for (std::size_t i = 0; i < m_cone.size(); ++i)
        {
            const HorizonEdge& edge = m_horizon[i];
            m_faces[m_cone[i]].neighbour[1] = m_cone[i + 1 < m_cone.size() ? i + 1 : 0];
            m_faces[m_cone[i]].neighbour[2] = m_cone[i > 0 ? i - 1 : m_cone.size() - 1];
            Face& outer = m_faces[edge.outer];
            for (int k = 0; k < 3; ++k)
            {
                if (outer.corner[k] == edge.to)
                    outer.neighbour[k] = m_cone[i];
            }
        }
    }

    /// Collects the faces that are visible from a point.
    void collectVisible(std::int32_t first, const Site& site)
    {
        m_visible.assign(1, first);
        m_faces[first].isVisible = true;
        for (std::size_t i = 0; i < m_visible.size(); ++i)
        {
            for (const std::int32_t neighbour : m_faces[m_visible[i]].neighbour)
            {
                Face& face = m_faces[neighbour];
                if (face.isVisible || !sees(site, heightOver(face, site), face))
                    continue;
                face.isVisible = true;
                m_visible.push_back(neighbour);
            }
        }
    }

    /// Collects the closed walk of edges between visible and other faces, from the vertex of the lowest index on.
    void collectHorizon()
    {
        m_edges.clear();
        std::int32_t lowest = 0;
        for (const std::int32_t index : m_visible)
        {
            const Face& face = m_faces[index];
            for (int k = 0; k < 3; ++k)
            {
                if (m_faces[face.neighbour[k]].isVisible)
                    continue;
                const std::int32_t edge = static_cast<std::int32_t>(m_edges.size()), from = face.corner[k];
                m_edges.push_back({from, face.corner[(k + 1) % 3], face.neighbour[k]});
                m_edgeFrom[from] = edge;
                lowest = m_sites[from].point < m_sites[m_edges[lowest].from].point ? edge : lowest;
            }
        }
        m_horizon.assign(1, m_edges[lowest]);
        while (m_horizon.size() < m_edges.size())
            m_horizon.push_back(m_edges[m_edgeFrom[m_horizon.back().to]]);
    }

    /// Stores the live faces in the order in which they were added.
    void compact()
    {
        std::vector<std::int32_t> triangleOf(m_faces.size(), kNone);
        m_triangles.reserve(m_faces.size() - m_free.size());
        // Left over are not only points from which no face was visible, but also vertices all of whose triangles were
        // replaced.
        std::vector<char> isVertex(m_points.size(), 0);
        for (std::size_t place = 0; place < m_queue.size(); ++place)
        {
            if (!isLive(place))
                continue;
            const Face& face = m_faces[m_queue[place]];
            triangleOf[m_queue[place]] = static_cast<std::int32_t>(m_triangles.size());
            m_triangles.push_back({face.corner, face.neighbour});
        }
        for (Triangle& triangle : m_triangles)
        {
            for (std::int32_t& neighbour : triangle.neighbour)
                neighbour = triangleOf[neighbour];
            for (std::int32_t& vertex : triangle.vertex)
            {
                vertex = m_sites[vertex].point;
                isVertex[vertex] = 1;
            }
        }
        for (std::size_t i = 0; i < m_points.size(); ++i)
        {
            if (isVertex[i] == 0)
                m_leftOver.push_back(static_cast<std::int32_t>(i));
        }
        m_hasReplacedVertices =
            std::any_of(m_inserted.begin(), m_inserted.end(),
                        [&](std::int32_t site) { return isVertex[m_sites[site].point] == 0; });
        std::vector<Face>().swap(m_faces);
        std::vector<Site>().swap(m_sites);
        for (std::vector<std::int32_t>* list : {&m_edgeFrom, &m_queue, &m_free, &m_outside, &m_inserted})
            std::vector<std::int32_t>().swap(*list);
    }

    static constexpr std::size_t kSpareFaces = 64;
    /// Outside sets that are stored, replaced ones included, in sites per point.
    static constexpr std::size_t kOutsides = 4;

    const std::vector<Eigen::Vector3d>& m_points;
    Eigen::Vector3d m_extent;  ///< of the box around all points
    std::vector<Site> m_sites;
    std::vector<Face> m_faces;
    std::vector<std::int32_t> m_queue;     ///< faces in the order in which they were added
    std::vector<std::int32_t> m_free;      ///< faces that were replaced
    std::vector<std::int32_t> m_edgeFrom;  ///< by site: the last edge of a horizon that started there
    std::vector<std::int32_t> m_outside;   ///< the outside sets
    std::vector<std::int32_t> m_inserted;  ///< sites that were vertices
    std::vector<std::int32_t> m_visible, m_orphans, m_cone;
    std::vector<Choice> m_chosen;
    std::size_t m_current = 0;  ///< in m_queue
    std::vector<HorizonEdge> m_edges, m_horizon;
    std::uint64_t m_testCount = 0;
    bool m_hasReplacedVertices = false;
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
