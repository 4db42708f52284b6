// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/dk_hierarchy.h"
#include "cullet/narrow/math/debug_containers.h"
#include "cullet/narrow/math/exact_orientation.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace cullet
{
/// Builds a DkHierarchy from the triangulated surface of a convex hull.
///
/// The hole of a removed vertex is filled by ear clipping: an ear is a triangle of three consecutive neighbours with no
/// other neighbour above it. A vertex whose hole cannot be filled is kept; neighbours of a removed vertex are kept at
/// that level. The surface is a topological sphere at each step for any coordinates, and convex up to coplanar
/// neighbours. Cost: O(n).
class DkBuilder
{
public:
    using Triangle = std::array<std::int32_t, 3>;

    /// @param points    [n]; points without a triangle are ignored
    /// @param triangles counter-clockwise from outside
    static DkHierarchy build(const std::vector<Eigen::Vector3d>& points,
                             const std::vector<Triangle>& triangles)
    {
        DkBuilder builder(points);
        for (const Triangle& t : triangles)
            builder.add(t);
        return builder.run();
    }

private:
    static constexpr std::size_t kTop = 16;
    static constexpr std::size_t kDegree = 8;

    /// The edge opposite to a vertex in one of its triangles, counter-clockwise.
    struct OppositeEdge
    {
        std::int32_t from, to;
    };

    struct Loss
    {
        std::int32_t level, vertex;
    };

    explicit DkBuilder(const std::vector<Eigen::Vector3d>& points)
        : m_points(points),
          m_oppositeEdges(points.size()),
          m_losses(points.size()),
          m_height(points.size(), 0)
    {
    }

    void add(const Triangle& t)
    {
        for (int k = 0; k < 3; ++k)
            m_oppositeEdges[t[k]].push_back({t[(k + 1) % 3], t[(k + 2) % 3]});
    }

    DkHierarchy run()
    {
        for (std::int32_t v = 0; v < vertexCount(); ++v)
        {
            if (!m_oppositeEdges[v].empty())
                m_remaining.push_back(v);
        }
        while (m_remaining.size() > kTop && removeLevel())
            ++m_level;
        for (const std::int32_t v : m_remaining)
            m_height[v] = m_level;
        return store();
    }

    /// @return false if no vertex could be removed
    bool removeLevel()
    {
        m_isLocked.assign(m_points.size(), false);
        std::vector<std::int32_t> rest;
        for (const std::int32_t v : m_remaining)
        {
            if (m_isLocked[v] || m_oppositeEdges[v].size() > kDegree || !remove(v))
                rest.push_back(v);
        }
        const std::size_t before = m_remaining.size();
        m_remaining.swap(rest);
        return m_remaining.size() < before;
    }

    bool remove(std::int32_t v)
    {
        const std::vector<std::int32_t> ring = ringOf(v);
        const std::vector<Triangle> fill = fillOf(v, ring);
        if (fill.empty())
            return false;
        for (const std::int32_t u : ring)
        {
            std::vector<OppositeEdge>& opposite = m_oppositeEdges[u];
            opposite.erase(std::remove_if(opposite.begin(), opposite.end(),
                                          [v](const OppositeEdge& w) { return w.from == v || w.to == v; }),
                           opposite.end());
            m_losses[u].push_back({m_level, v});
            m_isLocked[u] = true;
        }
        for (const Triangle& t : fill)
            add(t);
        m_height[v] = m_level;
        return true;
    }

    /// Neighbours in order, counter-clockwise.
    std::vector<std::int32_t> ringOf(std::int32_t v) const
    {
        const std::vector<OppositeEdge>& opposite = m_oppositeEdges[v];
        std::vector<std::int32_t> ring = {opposite[0].from};
        while (ring.size() < opposite.size())
        {
            ring.push_back(std::find_if(opposite.begin(), opposite.end(),
                                        [&ring](const OppositeEdge& w) { return w.from == ring.back(); })
                               ->to);
        }
        return ring;
    }

    /// @return empty if some stage has no ear
    std::vector<Triangle> fillOf(std::int32_t v, std::vector<std::int32_t> ring) const
    {
        std::vector<Triangle> fill;
        while (ring.size() > 3)
        {
            std::size_t ear = 0;
            while (ear < ring.size() && !isEar(v, ring, ear))
                ++ear;
            if (ear == ring.size())
                return {};
            fill.push_back(earOf(ring, ear));
            ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(ear));
        }
        fill.push_back({ring[0], ring[1], ring[2]});
        return fill;
    }

    /// A corner of the ring with its predecessor and successor.
    static Triangle earOf(const std::vector<std::int32_t>& ring, std::size_t corner)
    {
        const std::size_t n = ring.size();
        return {ring[(corner + n - 1) % n], ring[corner], ring[(corner + 1) % n]};
    }

    bool isEar(std::int32_t v, const std::vector<std::int32_t>& ring, std::size_t corner) const
    {
        // Not by structured bindings, which a lambda cannot capture.
        const Triangle ear = earOf(ring, corner);
        const std::int32_t a = ear[0], b = ear[1], c = ear[2];
        // A second edge between the same vertices would break the rings of both.
        const bool isEdge = std::any_of(m_oppositeEdges[a].begin(), m_oppositeEdges[a].end(),
                                        [c](const OppositeEdge& w) { return w.from == c || w.to == c; });
        if (isEdge || !isConvexEar(v, a, b, c))
            return false;
        return std::none_of(ring.begin(), ring.end(),
                            [&](std::int32_t u)
                            { return u != a && u != b && u != c && side(a, b, c, u) > 0; });
    }

    /// False for a corner that is straight or reflex within a face.
    bool isConvexEar(std::int32_t v, std::int32_t a, std::int32_t b, std::int32_t c) const
    {
        const auto normal = [this](std::int32_t i, std::int32_t j, std::int32_t k)
        { return (m_points[j] - m_points[i]).cross(m_points[k] - m_points[i]).eval(); };
        return normal(a, b, c).dot(normal(v, a, b) + normal(v, b, c)) > 0.0;
    }

    int side(std::int32_t a, std::int32_t b, std::int32_t c, std::int32_t u) const
    {
        return orientation(m_points[a], m_points[b], m_points[c], m_points[u]);
    }

    DkHierarchy store() const
    {
        DkHierarchy out;
        out.m_levelCount = m_level;
        out.m_top = m_remaining;
        for (std::int32_t v = 0; v < vertexCount(); ++v)
        {
            out.m_first.push_back(static_cast<std::int32_t>(out.m_begin.size()));
            auto loss = m_losses[v].begin();
            for (std::int32_t level = 0; level < m_height[v]; ++level)
            {
                out.m_begin.push_back(static_cast<std::int32_t>(out.m_removed.size()));
                for (; loss != m_losses[v].end() && loss->level == level; ++loss)
                    out.m_removed.push_back(loss->vertex);
            }
        }
        out.m_begin.push_back(static_cast<std::int32_t>(out.m_removed.size()));
        return out;
    }

    std::int32_t vertexCount() const { return static_cast<std::int32_t>(m_points.size()); }

    const std::vector<Eigen::Vector3d>& m_points;
    std::vector<std::vector<OppositeEdge>> m_oppositeEdges;
    std::vector<std::vector<Loss>> m_losses;  ///< by vertex, levels ascending
    std::vector<std::int32_t> m_height;       ///< by vertex: levels that contain it, without the coarsest
    std::vector<std::int32_t> m_remaining;
    std::vector<bool> m_isLocked;
    std::int32_t m_level = 0;
};
}  // namespace cullet
