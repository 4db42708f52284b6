// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/build/quickhull.h"
#include "cullet/narrow/build/triangle_tree.h"
#include "cullet/narrow/math/debug_containers.h"
#include "cullet/narrow/math/simplex.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace cullet
{
/// Attaches points that the triangulation left over, but that lie on the surface up to rounding, to its triangles.
///
/// The neighbours of such a point are the corners of the pieces of triangles that contain it, two pieces if it lies on
/// an edge. It splits these pieces for later points, so that a fine grid in one plane stays a graph of low degree. The
/// pieces of a triangle form a tree, in which a point descends to the pieces that contain it.
///
/// A point on an edge splits the piece on each side of it in two, not in three: pieces without area would each contain
/// every later point on that edge, and their number would double with every point.
///
/// Cost: usually O((k + t) log(k + t)) for k points and t triangles; see testCount(). Where all is within rounding, as
/// in a needle, a point is compared with all pieces there.
class SurfacePoints
{
public:
    struct Attached
    {
        std::int32_t point;
        std::vector<std::int32_t> corners;  ///< without duplicates
        Eigen::Vector3d normal;             ///< outward, sum of the triangles' normals weighted by area
    };

    /// Attaches no point.
    explicit SurfacePoints(const std::vector<Eigen::Vector3d>& points) : m_points(points), m_depth(0.0) {}

    /// @param depth points farther than this from the surface are inside and ignored
    SurfacePoints(const std::vector<Eigen::Vector3d>& points, const Quickhull& triangulation, double depth)
        : m_points(points), m_slackOf(points.size(), 0.0), m_depth(depth)
    {
        if (triangulation.leftOver().empty())
            return;
        TriangleTree tree(points, triangulation.triangles(), depth);
        for (std::size_t i = 0; i < tree.normals().size(); ++i)
            m_pieces.push_back({triangulation.triangles()[i].vertex, tree.normals()[i]});
        for (const std::int32_t point : inScatteredOrder(triangulation.leftOver()))
            attach(point, tree);
        m_testCount += tree.testCount();
    }

    /// Whether any of the points that the triangulation left over would be attached.
    static bool hasAny(const std::vector<Eigen::Vector3d>& points, const Quickhull& triangulation,
                       double depth)
    {
        const std::vector<std::int32_t>& left = triangulation.leftOver();
        if (left.empty())
            return false;
        TriangleTree tree(points, triangulation.triangles(), depth);
        return std::any_of(left.begin(), left.end(),
                           [&](std::int32_t point) { return tree.isAnyNear(points[point]); });
    }

    const std::vector<Attached>& attached() const { return m_attached; }

    /// Largest distance of an attached point from the surface that its corners span, summed along chains of pieces.
    double slack() const { return m_slack; }

    /// Triangles, pieces and boxes that were compared with a point.
    std::uint64_t testCount() const { return m_testCount; }

private:
    struct Piece
    {
        std::array<std::int32_t, 3> corners;
        Eigen::Vector3d normal;  ///< normal of the original triangle, as long as twice its area
        std::size_t parts = 0;   ///< the first part; 0: not split
        std::size_t partCount = 0;
    };

    /// A piece, and its distance from a point.
    struct Place
    {
        double distance;
        std::size_t piece;

        bool operator<(const Place& other) const
        {
            return distance != other.distance ? distance < other.distance : piece < other.piece;
        }
    };

    // Where all is within rounding, as in a needle, all pieces may contain the point.
    static constexpr std::size_t kMaxPlaces = 4;

    /// Points in pseudo-random order, which keeps the trees balanced.
    static std::vector<std::int32_t> inScatteredOrder(std::vector<std::int32_t> points)
    {
        const auto hash = [](std::int32_t point)
        { return static_cast<std::uint32_t>(point) * 2654435769u; };  // odd: no two are equal
        std::sort(points.begin(), points.end(),
                  [&hash](std::int32_t l, std::int32_t r) { return hash(l) < hash(r); });
        return points;
    }

    Place placeOf(std::size_t piece, std::int32_t point)
    {
        ++m_testCount;
        return {distanceToTriangle(m_points, m_pieces[piece].corners, m_points[point]), piece};
    }

    void attach(std::int32_t point, TriangleTree& tree)
    {
        std::vector<Place> places;
        Place nearest = {m_depth, m_pieces.size()};
        tree.forEachNear(m_points[point],
                         [&](std::int32_t triangle, double distance)
                         {
                             const Place place = {distance, static_cast<std::size_t>(triangle)};
                             findPieces(place, point, places);
                             nearest = std::min(nearest, place);
                         });
        if (nearest.piece == m_pieces.size())
            return;
        // The pieces cover their triangle only up to rounding.
        if (places.empty())
            places.push_back(nearestPiece(nearest, point));
        std::sort(places.begin(), places.end());
        places.resize(std::min(places.size(), kMaxPlaces));
        Attached added = {point, {}, Eigen::Vector3d::Zero()};
        for (const Place& place : places)
            split(place, added);
        std::sort(added.corners.begin(), added.corners.end());
        added.corners.erase(std::unique(added.corners.begin(), added.corners.end()), added.corners.end());
        m_attached.push_back(added);
        m_slack = std::max(m_slack, m_slackOf[point]);
    }

    /// Appends the unsplit pieces below a place that contain the point.
    void findPieces(const Place& place, std::int32_t point, std::vector<Place>& places)
    {
        std::vector<Place> stack = {place};
        while (!stack.empty())
        {
            const Place next = stack.back();
            stack.pop_back();
            const Piece& piece = m_pieces[next.piece];
            if (piece.parts == 0)
                places.push_back(next);
            for (std::size_t part = piece.parts; part < piece.parts + piece.partCount; ++part)
            {
                const Place below = placeOf(part, point);
                if (below.distance <= m_depth)
                    stack.push_back(below);
            }
        }
    }

    Place nearestPiece(Place place, std::int32_t point)
    {
        while (m_pieces[place.piece].parts != 0)
        {
            const Piece& piece = m_pieces[place.piece];
            place = placeOf(piece.parts, point);
            for (std::size_t part = piece.parts + 1; part < piece.parts + piece.partCount; ++part)
                place = std::min(place, placeOf(part, point));
        }
        return place;
    }

    void split(const Place& place, Attached& added)
    {
        const Piece piece = m_pieces[place.piece];
        const std::size_t parts = m_pieces.size();
        for (int k = 0; k < 3; ++k)
        {
            const std::int32_t corner = piece.corners[k], next = piece.corners[(k + 1) % 3];
            m_slackOf[added.point] = std::max(m_slackOf[added.point], m_slackOf[corner] + place.distance);
            added.corners.push_back(corner);
            if (!isOnEdge(added.point, corner, next))
                m_pieces.push_back({{corner, next, added.point}, piece.normal});
        }
        added.normal += piece.normal;
        // A point on all three edges means that the piece is as small as rounding; it is not split.
        if (m_pieces.size() == parts)
            return;
        m_pieces[place.piece].parts = parts;
        m_pieces[place.piece].partCount = m_pieces.size() - parts;
    }

    bool isOnEdge(std::int32_t point, std::int32_t from, std::int32_t to) const
    {
        const SimplexPoints ends = {m_points[from] - m_points[point], m_points[to] - m_points[point]};
        ClosestOnSimplex best = nothingOnSimplex(ends, 2);
        considerSegment(ends, 0, 1, best);
        return best.point.norm() <= m_depth;
    }

    const std::vector<Eigen::Vector3d>& m_points;
    std::vector<Piece> m_pieces;
    std::vector<Attached> m_attached;
    std::vector<double> m_slackOf;
    std::uint64_t m_testCount = 0;
    double m_depth;
    double m_slack = 0.0;
};
}  // namespace cullet
