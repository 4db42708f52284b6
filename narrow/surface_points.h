// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "narrow/debug_containers.h"
#include "narrow/simplex.h"
#include "narrow/triangulation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace cullet
{
/// Hangs points that the triangulation left over, but that lie on the surface up to rounding, under its triangles.
///
/// Each such point gets the corners of the pieces of triangles that contain it as neighbours, of two if it lies on an edge, and
/// splits them for those after it, so that a fine grid in one plane stays a graph of low degree. What a triangle was split into
/// is a tree; a point goes down to the pieces that contain it.
///
/// A point on an edge splits what is on both sides of it in two, not in three: pieces without area would contain whatever comes on
/// that edge later, each of them, and their number would double with every point.
///
/// Cost: O(k t) for k points and t triangles, and O(k log k) as a rule to go down.
class SurfacePoints
{
public:
    struct Attached
    {
        std::int32_t point;
        std::vector<std::int32_t> corners;  ///< without duplicates
        Eigen::Vector3d normal;             ///< outward, sum of the triangles' weighted by area
    };

    /// @param depth points farther than this from the surface are inside and dropped
    SurfacePoints(const std::vector<Eigen::Vector3d>& points, const Triangulation& triangulation,
                  double depth)
        : m_points(points), m_slackOf(points.size(), 0.0), m_depth(depth)
    {
        for (const Triangulation::Triangle& t : triangulation.triangles())
            m_pieces.push_back({t.vertex, scaledNormal(m_points, t)});
        m_triangleCount = m_pieces.size();
        for (const std::int32_t point : scattered(triangulation.leftOver()))
            attach(point);
    }

    const std::vector<Attached>& attached() const { return m_attached; }

    /// Largest distance of an attached point from the surface that its corners span, summed along chains of pieces.
    double slack() const { return m_slack; }

private:
    struct Piece
    {
        std::array<std::int32_t, 3> corners;
        Eigen::Vector3d normal;  ///< of the triangle that was split, as long as that is large
        std::size_t parts = 0;   ///< the first one; 0: it is whole
        std::size_t partCount = 0;
    };

    /// A piece, and how far a point is from it.
    struct Place
    {
        double distance;
        std::size_t piece;

        bool operator<(const Place& other) const
        {
            return distance != other.distance ? distance < other.distance : piece < other.piece;
        }
    };

    // Where all is within rounding, as in a needle, there are as many as there are pieces.
    static constexpr std::size_t kMostPlaces = 4;

    /// In an order that follows no line of them, so that trees do not become lists.
    static std::vector<std::int32_t> scattered(std::vector<std::int32_t> points)
    {
        const auto hash = [](std::int32_t point)
        { return static_cast<std::uint32_t>(point) * 2654435769u; };  // odd: no two are equal
        std::sort(points.begin(), points.end(),
                  [&hash](std::int32_t l, std::int32_t r) { return hash(l) < hash(r); });
        return points;
    }

    /// Distance between a point and the piece. Through weights of the corners, so that a sliver, whose normal is mostly
    /// rounding, can make it too large but never too small.
    double distance(const Piece& piece, const Eigen::Vector3d& point) const
    {
        SimplexPoints corners;
        for (int k = 0; k < 3; ++k)
            corners[k] = m_points[piece.corners[k]] - point;
        ClosestOnSimplex best = nothingOnSimplex(corners, 3);
        considerSegment(corners, 0, 1, best);
        considerSegment(corners, 1, 2, best);
        considerSegment(corners, 2, 0, best);
        const double edge = best.point.norm();
        best.length2 = std::numeric_limits<double>::infinity();
        if (!considerInside(corners, 0, 1, 2, best))
            return edge;
        const std::array<double, 4> w = simplexWeights(corners, best.subset);
        return std::min(edge, (w[0] * corners[0] + w[1] * corners[1] + w[2] * corners[2]).norm());
    }

    Place placeOf(std::size_t piece, std::int32_t point) const
    {
        return {distance(m_pieces[piece], m_points[point]), piece};
    }

    void attach(std::int32_t point)
    {
        std::vector<Place> places;
        Place nearest = {m_depth, m_pieces.size()};
        for (std::size_t i = 0; i < m_triangleCount; ++i)
        {
            const Place place = placeOf(i, point);
            if (place.distance <= m_depth)
                findPieces(place, point, places);
            nearest = std::min(nearest, place);
        }
        if (nearest.piece == m_pieces.size())
            return;
        // Pieces reach as far as their triangle only up to rounding.
        if (places.empty())
            places.push_back(nearestPiece(nearest, point));
        std::sort(places.begin(), places.end());
        places.resize(std::min(places.size(), kMostPlaces));
        Attached added = {point, {}, Eigen::Vector3d::Zero()};
        for (const Place& place : places)
            split(place, added);
        std::sort(added.corners.begin(), added.corners.end());
        added.corners.erase(std::unique(added.corners.begin(), added.corners.end()), added.corners.end());
        m_attached.push_back(added);
        m_slack = std::max(m_slack, m_slackOf[point]);
    }

    /// Appends the whole pieces below a place that contain the point.
    void findPieces(const Place& place, std::int32_t point, std::vector<Place>& places) const
    {
        std::vector<Place> open = {place};
        while (!open.empty())
        {
            const Place next = open.back();
            open.pop_back();
            const Piece& piece = m_pieces[next.piece];
            if (piece.parts == 0)
                places.push_back(next);
            for (std::size_t part = piece.parts; part < piece.parts + piece.partCount; ++part)
            {
                const Place below = placeOf(part, point);
                if (below.distance <= m_depth)
                    open.push_back(below);
            }
        }
    }

    Place nearestPiece(Place place, std::int32_t point) const
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
        // On all three it is the piece that is as small as rounding, and stays whole.
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
    std::size_t m_triangleCount = 0;  ///< the first pieces
    double m_depth;
    double m_slack = 0.0;
};
}  // namespace cullet
