// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/block_scan.h"
#include "cullet/narrow/hull/corner_projection.h"
#include "cullet/narrow/hull/hull.h"
#include "cullet/narrow/hull/linear_scan.h"
#include "cullet/narrow/hull/support.h"
#include "cullet/narrow/math/debug_containers.h"
#include "cullet/narrow/math/exact_orientation.h"
#include "cullet/narrow/math/unit_vector.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

/// Faces of a hull of which only the points are known, computed where they equal the faces of a HullBuilder bit by bit.
namespace cullet
{
/// A triangle that is a face of the hull of a Cloud.
struct ClearFace
{
    std::array<std::int32_t, 3>
        corners;             ///< counter-clockwise from outside, the lowest first, as FaceMerger stores them
    Eigen::Vector3d normal;  ///< outward, unit
    double area2;            ///< twice the area
};

/// The same cycle of three vertices from the lowest one on, without a branch that nothing predicts.
inline std::array<std::int32_t, 3> lowestFirst(const std::array<std::int32_t, 3>& corners)
{
    const std::array<std::int32_t, 5> cycle = {corners[0], corners[1], corners[2], corners[0], corners[1]};
    const std::size_t ofTwo = corners[1] < corners[0] ? 1 : 0;
    const std::size_t low = corners[2] < corners[ofTwo] ? 2 : ofTwo;
    return {cycle[low], cycle[low + 1], cycle[low + 2]};
}

/// Whether three points of a Cloud are a face of its hull with all other points clearly below it.
///
/// HullBuilder merges triangles that are coplanar within t = 16 eps R. If the triangle were part of another face, the
/// plane of that face would be within t of all three points, and would pass through a fourth point. From a corner to a
/// point at distance d the plane falls by at most t d / h, where h is the least height of the triangle; so all other
/// points have to be farther below.
///
/// @param corners in any order
/// @param face    [out] valid if true is returned
/// Cost: O(n), one product per point, or per block of points.
template <class S>
bool findClearFace(const Hull<S>& cloud, std::array<std::int32_t, 3> corners, ClearFace& face)
{
    using Vector = Eigen::Vector3d;
    corners = lowestFirst(corners);
    const auto point = [&](std::int32_t i) -> Vector { return cloud.vertex(i).template cast<double>(); };
    const Vector a = point(corners[0]);
    Vector b = point(corners[1]), c = point(corners[2]);
    Vector scaled = scaledNormal(a, b, c);
    if (scaled.dot(cloud.centre() - a) > 0.0)
    {
        std::swap(corners[1], corners[2]);
        std::swap(b, c);
        scaled = scaledNormal(a, b, c);
    }
    face = {corners, unitOf(scaled), scaled.norm()};
    const double longest =
        std::sqrt(std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}));
    if (!(face.area2 > 1e-5 * cloud.radius() * longest))
        return false;
    const double least = face.area2 / longest, height = face.normal.dot(a);
    // 16 eps R and an allowance for the rounding of heights.
    const double level = 24.0 * double(std::numeric_limits<S>::epsilon()) * cloud.radius();
    const auto isClear = [&](std::int32_t i)
    {
        const Vector p = point(i);
        const double below = height - face.normal.dot(p);
        return below > level * (1.0 + (p - a).norm() / least);
    };
    const typename Hull<S>::Vector n = face.normal.template cast<S>();
    const double reach = cloud.radius() / least;
    if (!cloud.pointBlocks().isEmpty())
    {
        const S low = static_cast<S>(height - level * (1.0 + 2.0 * reach));
        const auto isCornerOrClear = [&](std::int32_t i)
        { return std::find(corners.begin(), corners.end(), i) != corners.end() || isClear(i); };
        return BlockScan<S>(cloud.pointBlocks(), n).allAbove(low, isCornerOrClear);
    }
    // Most points are farther below than the least for any point, and than the rounding of two products.
    const double sure = level * (2.0 + 2.0 * reach);
    return isTrueNear<S>(cloud, n, corners[0], static_cast<S>(sure), corners, isClear);
}

/// The faces around a vertex of a Cloud, by a CornerProjection; where that shows no clear faces, by gift wrapping (Chand
/// and Kapur 1970, "An Algorithm for Convex Polytopes").
///
/// Known only where findClearFace() accepts all of them, and no two have equal areas: then they equal Hull::facesOf(),
/// in the same order. Either way finds the same faces: a cycle of clear faces around the vertex is all of them.
///
/// Cost: O(n) for each of its faces, 1 us for 32 points; no allocation.
template <class S>
class VertexFan
{
public:
    /// @param outward in the frame of the points, of any length; the vertex is the support point along it
    VertexFan(const Hull<S>& cloud, std::int32_t vertex, const Eigen::Vector3d& outward)
    {
        if (cloud.vertexCount() < 4 || cloud.vertexCount() > kMaxPoints)
            return;
        if (!project(cloud, vertex, outward) && !wrap(cloud, vertex, outward))
            m_count = 0;
    }

    bool isKnown() const { return m_count > 0; }
    const ClearFace* begin() const { return m_faces.data(); }
    const ClearFace* end() const { return m_faces.data() + m_count; }

private:
    using Vector = Eigen::Vector3d;

    /// For more points, a face costs more than a support search on a graph.
    static constexpr std::int32_t kMaxPoints = 4096;
    static constexpr std::size_t kMaxFaces = CornerProjection<S>::kMostEdges;
    static constexpr int kMaxPivots = 64;

    /// Tests the edges that a projection along the way from the centre shows, or along the direction outward.
    bool project(const Hull<S>& cloud, std::int32_t vertex, const Vector& outward)
    {
        const Vector fromCentre = unitOf(point(cloud, vertex) - cloud.centre());
        return addFaces(cloud, vertex, CornerProjection<S>(cloud, vertex, fromCentre)) ||
               addFaces(cloud, vertex, CornerProjection<S>(cloud, vertex, unitOf(outward)));
    }

    bool addFaces(const Hull<S>& cloud, std::int32_t vertex, const CornerProjection<S>& edges)
    {
        m_count = 0;
        for (const std::int32_t& from : edges)
        {
            const std::int32_t to = &from + 1 == edges.end() ? *edges.begin() : *(&from + 1);
            if (!findClearFace(cloud, {vertex, from, to}, m_faces[m_count++]))
                return false;
        }
        return m_count > 2 && sortByArea();
    }

    bool wrap(const Hull<S>& cloud, std::int32_t vertex, const Vector& outward)
    {
        m_count = 0;
        if (outward.isZero(0.0))
            return false;
        // A line through the vertex in its supporting plane.
        const Vector tangent = outward.unitOrthogonal();
        const std::int32_t first = wrapEdge(cloud, vertex, tangent, vertex, firstOtherThan(vertex, vertex));
        std::int32_t from = first, last = firstOtherThan(vertex, first);
        do
        {
            const Vector edge = point(cloud, from) - point(cloud, vertex);
            const std::int32_t to = wrapEdge(cloud, vertex, edge, from, last);
            ClearFace face;
            if (from == to || m_count == kMaxFaces || !findClearFace(cloud, {vertex, from, to}, face))
                return false;
            m_faces[m_count++] = face;
            last = std::exchange(from, to);
        } while (from != first);
        return sortByArea();
    }

    static Vector point(const Hull<S>& cloud, std::int32_t i)
    {
        return cloud.vertex(i).template cast<double>();
    }

    static std::int32_t firstOtherThan(std::int32_t vertex, std::int32_t point)
    {
        std::int32_t other = 0;
        while (other == vertex || other == point)
            ++other;
        return other;
    }

    /// The first point met by a plane that rotates about an edge of the hull, counter-clockwise as seen from the edge's
    /// end: while there are points above the plane through the edge and the current point, the highest of them becomes
    /// the current point.
    ///
    /// @param edge from the vertex
    /// @param end  of the edge, or the vertex
    /// @param best a point that is not on the edge
    /// @return `end` if the iteration does not converge
    static std::int32_t wrapEdge(const Hull<S>& cloud, std::int32_t vertex, const Vector& edge,
                                 std::int32_t end, std::int32_t best)
    {
        const Vector origin = point(cloud, vertex);
        for (int pivot = 0; pivot < kMaxPivots; ++pivot)
        {
            const Vector above = edge.cross(point(cloud, best) - origin);
            const double size = above.cwiseAbs().maxCoeff();
            if (!(size > 0.0))
                return end;
            const std::int32_t highest = hitLinear<S>(cloud, (above / size).template cast<S>()).vertex;
            if (highest == best || highest == end || highest == vertex ||
                !(above.dot(point(cloud, highest) - origin) > 0.0))
                return best;
            best = highest;
        }
        return end;
    }

    /// Sorts into the order in which FaceMerger finds faces. Fails for equal areas, whose order depends on a
    /// triangulation.
    bool sortByArea()
    {
        const auto end = m_faces.begin() + static_cast<std::ptrdiff_t>(m_count);
        std::sort(m_faces.begin(), end,
                  [](const ClearFace& l, const ClearFace& r) { return l.area2 > r.area2; });
        return std::adjacent_find(m_faces.begin(), end,
                                  [](const ClearFace& l, const ClearFace& r)
                                  { return l.area2 == r.area2; }) == end;
    }

    std::array<ClearFace, kMaxFaces> m_faces;
    std::size_t m_count = 0;
};
}  // namespace cullet
