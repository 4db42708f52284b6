// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/build/cloud_builder.h"
#include "cullet/narrow/build/dk_builder.h"
#include "cullet/narrow/build/face_merger.h"
#include "cullet/narrow/build/neighbour_builder.h"
#include "cullet/narrow/build/quickhull.h"
#include "cullet/narrow/build/seed_search.h"
#include "cullet/narrow/build/surface_points.h"
#include "cullet/narrow/hull/hull.h"
#include "cullet/narrow/math/debug_containers.h"
#include "cullet/narrow/math/exact_orientation.h"
#include "cullet/narrow/math/unit_vector.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <numeric>
#include <utility>
#include <vector>

namespace cullet
{
/// Builds a Hull from points; use makeHull().
///
/// Tolerances, relative to the largest distance R of a point from the origin, eps the spacing of S at 1:
/// * 16 eps R: points at most this deep below the surface become vertices. The rounded product of a point deeper than 3
///    eps R is never the largest, since the error of a product is at most 1.5 eps R |d|; the rest covers thin
///    triangles.
/// * 16 eps R: triangles at most this far from a plane are merged into one face.
///
/// Coordinates: see CoordinateRange.
template <class S>
class HullBuilder
{
public:
    using Vector = Eigen::Matrix<S, 3, 1>;

    /// @param points [count] x, y, z each
    static Hull<S> build(const Vector* points, std::int32_t count, HullExtra extra)
    {
        HullBuilder builder;
        builder.m_extra = extra;
        builder.run(points, count);
        return std::move(builder.m_hull);
    }

    /// build(...).corners(), see makeCornerHull().
    static Hull<S> buildCorners(const Vector* points, std::int32_t count)
    {
        HullBuilder builder;
        builder.m_isOfCorners = true;
        builder.run(points, count);
        return builder.m_hull.m_corners ? *builder.m_hull.m_corners : std::move(builder.m_hull);
    }

private:
    /// False if there are no points, or one is not finite; the kind of the hull then says which.
    bool areUsable(const Vector* points, std::int32_t count)
    {
        for (std::int32_t i = 0; i < count; ++i)
        {
            // A NaN makes the comparison false.
            if (!(points[i].template cast<double>().array().abs() <= CoordinateRange::kLargest).all())
            {
                m_hull.m_kind = HullKind::NotFinite;
                return false;
            }
        }
        return count > 0;
    }

    static Eigen::Vector3d usable(const Vector& point)
    {
        const Eigen::Vector3d given = point.template cast<double>();
        return (given.array().abs() < CoordinateRange::kSmallest).select(0.0, given);
    }

    void run(const Vector* points, std::int32_t count)
    {
        if (!areUsable(points, count))
            return;
        removeDuplicates(points, count);
        std::array<std::int32_t, 4> seed = {};
        m_hull.m_kind = SeedSearch(m_points).find(seed);
        if (m_hull.m_kind == HullKind::Solid)
            buildSolid(seed);
        else
            keepAll();
        if (m_hull.m_kind == HullKind::Polygon)
            buildPolygon(seed);
    }

    /// Keeps the first of equal points, in the given order; 0 and -0 are equal.
    void removeDuplicates(const Vector* points, std::int32_t count)
    {
        std::size_t size = 16;
        while (size < 2 * static_cast<std::size_t>(count))
            size *= 2;
        std::vector<std::int32_t> table(size, -1);
        m_points.reserve(static_cast<std::size_t>(count));
        m_source.reserve(static_cast<std::size_t>(count));
        for (std::int32_t i = 0; i < count; ++i)
        {
            const Eigen::Vector3d point = usable(points[i]);
            std::size_t place = hashOf(point) & (size - 1);
            while (table[place] >= 0 && m_points[table[place]] != point)
                place = (place + 1) & (size - 1);
            if (table[place] >= 0)
                continue;
            table[place] = pointCount();
            m_points.push_back(point);
            m_source.push_back(i);
            m_radius = std::max(m_radius, point.norm());
        }
    }

    static std::size_t hashOf(const Eigen::Vector3d& point)
    {
        std::uint64_t hash = 0;
        for (int i = 0; i < 3; ++i)
        {
            std::uint64_t bits;
            std::memcpy(&bits, &point[i], sizeof(bits));
            hash = (hash ^ bits) * 0x9e3779b97f4a7c15u;
            hash ^= hash >> 32;
        }
        return static_cast<std::size_t>(hash);
    }

    void keepAll()
    {
        m_vertexOf.resize(m_points.size());
        std::iota(m_vertexOf.begin(), m_vertexOf.end(), 0);
        storeVertices();
        m_hull.m_vertexFaceBegin.assign(m_points.size() + 1, 0);
    }

    /// Finds the corners of a coplanar set by Andrew's monotone chain; a point off the plane orients the turns.
    void buildPolygon(const std::array<std::int32_t, 4>& seed)
    {
        const Eigen::Vector3d& a = m_points[seed[0]];
        const Eigen::Vector3d normal = unitOf(accurateCross(a, m_points[seed[1]], m_points[seed[2]]));
        const Eigen::Vector3d apex = a + m_radius * normal;
        std::vector<std::int32_t> order(m_points.size());
        std::iota(order.begin(), order.end(), 0);
        std::sort(order.begin(), order.end(),
                  [this](std::int32_t l, std::int32_t r)
                  {
                      return std::lexicographical_compare(m_points[l].data(), m_points[l].data() + 3,
                                                          m_points[r].data(), m_points[r].data() + 3);
                  });
        const auto chain = [&](auto begin, auto end, std::vector<std::int32_t>& loop)
        {
            const std::size_t base = loop.size();
            for (auto i = begin; i != end; ++i)
            {
                while (loop.size() >= base + 2 && orientation(m_points[loop[loop.size() - 2]],
                                                              m_points[loop.back()], m_points[*i], apex) <= 0)
                    loop.pop_back();
                loop.push_back(*i);
            }
            loop.pop_back();
        };
        std::vector<std::int32_t> loop;
        chain(order.begin(), order.end(), loop);
        chain(order.rbegin(), order.rend(), loop);
        std::vector<std::int32_t> corners = loop;
        std::sort(corners.begin(), corners.end());
        storeCorners(corners);
        addFace(normal, loop.data(), static_cast<std::int32_t>(loop.size()));
        std::reverse(loop.begin(), loop.end());
        addFace(-normal, loop.data(), static_cast<std::int32_t>(loop.size()));
        for (std::size_t i = 0; i < loop.size(); ++i)
            m_hull.m_edges.push_back({loop[i], loop[(i + 1) % loop.size()], 1, 0});
        indexFaces();
    }

    void buildSolid(const std::array<std::int32_t, 4>& seed)
    {
        const Quickhull surface(m_points, seed);
        const std::vector<std::int32_t> corners = surface.corners();
        m_areAllCorners = static_cast<std::int32_t>(corners.size()) == surface.vertexCount();
        if (m_isOfCorners && !isOfCornersAlone(surface))
        {
            m_hull = hullOf(corners);
            return;
        }
        if (m_isOfCorners)
            m_radius = radiusOf(corners);
        storeSolid(surface,
                   m_isOfCorners ? SurfacePoints(m_points) : SurfacePoints(m_points, surface, depth()));
        storeCorners(corners);
    }

    /// Points at most this deep below the surface become vertices, and triangles this far from a plane a face.
    double depth() const { return 16.0 * double(std::numeric_limits<S>::epsilon()) * m_radius; }

    /// Whether a surface is that of its corners without all other points.
    bool isOfCornersAlone(const Quickhull& surface) const
    {
        return m_areAllCorners &&
               (!surface.hasReplacedVertices() || !SurfacePoints::hasAny(m_points, surface, depth()));
    }

    double radiusOf(const std::vector<std::int32_t>& points) const
    {
        double radius = 0.0;
        for (const std::int32_t point : points)
            radius = std::max(radius, m_points[point].norm());
        return radius;
    }

    void storeSolid(const Quickhull& surface, const SurfacePoints& extra)
    {
        constexpr double kEpsilon = std::numeric_limits<S>::epsilon();
        m_areAllCorners = m_areAllCorners && extra.attached().empty();
        m_hull.m_slack = extra.slack();
        numberVertices(surface, extra);
        storeVertices();
        storeFaces(FaceMerger(m_points, surface.triangles(), depth()));
        // 4 E = 6 eps R |d|; the surplus covers the rounding of the band itself.
        m_hull.m_tieBand = static_cast<S>((6.5 * kEpsilon * m_radius + extra.slack()) * 1.01);
        NeighbourBuilder<S>(m_hull, m_points, m_vertexOf, m_areAllCorners).run(surface, extra);
        if (m_extra == HullExtra::Hierarchy)
            storeHierarchy(surface);
    }

    /// @param corners points that are extreme, ascending
    void storeCorners(const std::vector<std::int32_t>& corners)
    {
        if (static_cast<std::int32_t>(corners.size()) < m_hull.m_vertexCount)
            m_hull.m_corners = std::make_shared<const Hull<S>>(hullOf(corners));
    }

    Hull<S> hullOf(const std::vector<std::int32_t>& corners) const
    {
        std::vector<Vector> points;
        points.reserve(corners.size());
        for (const std::int32_t corner : corners)
            points.push_back(m_points[corner].template cast<S>());
        Hull<S> hull = build(points.data(), static_cast<std::int32_t>(points.size()), m_extra);
        for (std::int32_t& source : hull.m_source)
            source = m_source[corners[source]];
        return hull;
    }

    void numberVertices(const Quickhull& surface, const SurfacePoints& extra)
    {
        m_vertexOf.assign(m_points.size(), -1);
        for (const Quickhull::Triangle& t : surface.triangles())
        {
            for (const std::int32_t point : t.vertex)
                m_vertexOf[point] = 0;
        }
        for (const SurfacePoints::Attached& a : extra.attached())
            m_vertexOf[a.point] = 0;
        std::int32_t next = 0;
        for (std::int32_t& vertex : m_vertexOf)
        {
            if (vertex == 0)
                vertex = next++;
        }
    }

    void storeVertices()
    {
        reserveVertices(m_points.size());
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (std::int32_t point = 0; point < pointCount(); ++point)
        {
            if (m_vertexOf[point] < 0)
                continue;
            addVertex(m_points[point], m_source[point]);
            sum += m_points[point];
        }
        m_hull.m_vertexCount = static_cast<std::int32_t>(m_hull.m_x.size());
        // The farthest point is a corner, so the radius of the points is that of the vertices.
        CloudBuilder<S>::finish(m_hull, sum, m_radius);
    }

    void reserveVertices(std::size_t count)
    {
        for (std::vector<S>* axis : {&m_hull.m_x, &m_hull.m_y, &m_hull.m_z})
            axis->reserve(CloudBuilder<S>::paddedCount(count));
        m_hull.m_lanes.reserve(count);
        m_hull.m_source.reserve(count);
    }

    void addVertex(const Eigen::Vector3d& point, std::int32_t source)
    {
        m_hull.m_x.push_back(static_cast<S>(point[0]));
        m_hull.m_y.push_back(static_cast<S>(point[1]));
        m_hull.m_z.push_back(static_cast<S>(point[2]));
        m_hull.m_lanes.push_back(CloudBuilder<S>::lanesOf(point));
        m_hull.m_source.push_back(source);
    }

    void addFace(const Eigen::Vector3d& normal, const std::int32_t* corners, std::int32_t count)
    {
        double offset = -std::numeric_limits<double>::infinity();
        const std::int32_t begin = static_cast<std::int32_t>(m_hull.m_faceVertices.size());
        for (std::int32_t i = 0; i < count; ++i)
        {
            offset = std::max(offset, normal.dot(m_points[corners[i]]));
            m_hull.m_faceVertices.push_back(m_vertexOf[corners[i]]);
        }
        m_hull.m_faces.push_back({normal, offset, begin, count});
    }

    void storeFaces(const FaceMerger& merged)
    {
        m_hull.m_faces.reserve(merged.polygons().size());
        m_hull.m_faceVertices.reserve(merged.corners().size());
        m_hull.m_edges.reserve(merged.edges().size());
        for (const FaceMerger::Polygon& polygon : merged.polygons())
            addFace(polygon.normal, &merged.corners()[polygon.begin], polygon.count);
        for (const FaceMerger::Edge& e : merged.edges())
            m_hull.m_edges.push_back({m_vertexOf[e.from], m_vertexOf[e.to], e.left, e.right});
        indexFaces();
    }

    void indexFaces()
    {
        std::vector<std::int32_t>& begin = m_hull.m_vertexFaceBegin;
        begin.assign(static_cast<std::size_t>(m_hull.m_vertexCount) + 1, 0);
        for (const std::int32_t v : m_hull.m_faceVertices)
            ++begin[v + 1];
        std::partial_sum(begin.begin(), begin.end(), begin.begin());
        m_hull.m_vertexFaces.resize(m_hull.m_faceVertices.size());
        std::vector<std::int32_t> next(begin.begin(), begin.end() - 1);
        for (std::size_t face = 0; face < m_hull.m_faces.size(); ++face)
        {
            for (const std::int32_t v : m_hull.faceVertices(static_cast<std::int32_t>(face)))
                m_hull.m_vertexFaces[next[v]++] = static_cast<std::int32_t>(face);
        }
    }

    void storeHierarchy(const Quickhull& surface)
    {
        std::vector<Eigen::Vector3d> corners;
        for (std::int32_t v = 0; v < m_hull.m_vertexCount; ++v)
            corners.push_back(m_hull.vertex(v).template cast<double>());
        std::vector<DkBuilder::Triangle> triangles;
        for (const Quickhull::Triangle& t : surface.triangles())
            triangles.push_back({m_vertexOf[t.vertex[0]], m_vertexOf[t.vertex[1]], m_vertexOf[t.vertex[2]]});
        m_hull.m_hierarchy = DkBuilder::build(corners, triangles);
    }

    std::int32_t pointCount() const { return static_cast<std::int32_t>(m_points.size()); }

    Hull<S> m_hull;
    HullExtra m_extra = HullExtra::None;
    bool m_isOfCorners = false;  ///< only corners() is needed
    bool m_areAllCorners = false;
    std::vector<Eigen::Vector3d> m_points;
    std::vector<std::int32_t> m_source;
    std::vector<std::int32_t> m_vertexOf;  ///< by point; -1 where the point is no vertex
    double m_radius = 0.0;                 ///< of the points
};

/// Convex hull of points; HullKind defines every degenerate input. Cost: usually O(n log n), and O(n) more for each
/// artificial neighbour of a hull with more vertices than corners, if it lies in a face that a climb must scan; 2 ms
/// for 1,000 points on a sphere.
template <class S>
Hull<S> makeHull(const Eigen::Matrix<S, 3, 1>* points, std::int32_t count, HullExtra extra = HullExtra::None)
{
    return HullBuilder<S>::build(points, count, extra);
}

/// makeHull(points).corners(), at half the cost if some points on the surface are no corners.
template <class S>
Hull<S> makeCornerHull(const std::vector<Eigen::Matrix<S, 3, 1>>& points)
{
    return HullBuilder<S>::buildCorners(points.data(), static_cast<std::int32_t>(points.size()));
}

template <class S>
Hull<S> makeHull(const std::vector<Eigen::Matrix<S, 3, 1>>& points, HullExtra extra = HullExtra::None)
{
    return HullBuilder<S>::build(points.data(), static_cast<std::int32_t>(points.size()), extra);
}
}  // namespace cullet
