// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

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
/// Each such point gets the corners of every triangle that contains it as neighbours, two triangles if it lies on an
/// edge, and splits them for those after it, so that a fine grid in one plane stays a graph of low degree.
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
        : m_points(points), m_slackOf(points.size(), 0.0)
    {
        for (const Triangulation::Triangle& t : triangulation.triangles())
            m_pieces.push_back({t.vertex, scaledNormal(m_points, t)});
        for (const std::int32_t point : triangulation.leftOver())
            attach(point, depth);
    }

    const std::vector<Attached>& attached() const { return m_attached; }

    /// Largest distance of an attached point from the surface that its corners span, summed along chains of pieces.
    double slack() const { return m_slack; }

private:
    struct Piece
    {
        std::array<std::int32_t, 3> corners;
        Eigen::Vector3d normal;  ///< of the triangle that was split, as long as that is large
    };

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

    void attach(std::int32_t point, double depth)
    {
        Attached added = {point, {}, Eigen::Vector3d::Zero()};
        const std::size_t pieceCount = m_pieces.size();
        for (std::size_t i = 0; i < pieceCount; ++i)
        {
            const double off = distance(m_pieces[i], m_points[point]);
            if (off <= depth)
                split(i, off, added);
        }
        if (added.corners.empty())
            return;
        std::sort(added.corners.begin(), added.corners.end());
        added.corners.erase(std::unique(added.corners.begin(), added.corners.end()), added.corners.end());
        m_attached.push_back(added);
        m_slack = std::max(m_slack, m_slackOf[point]);
    }

    void split(std::size_t index, double off, Attached& added)
    {
        const Piece piece = m_pieces[index];
        for (int k = 0; k < 3; ++k)
        {
            const std::int32_t corner = piece.corners[k];
            m_slackOf[added.point] = std::max(m_slackOf[added.point], m_slackOf[corner] + off);
            added.corners.push_back(corner);
            const Piece part = {{corner, piece.corners[(k + 1) % 3], added.point}, piece.normal};
            if (k == 0)
                m_pieces[index] = part;
            else
                m_pieces.push_back(part);
        }
        added.normal += piece.normal;
    }

    const std::vector<Eigen::Vector3d>& m_points;
    std::vector<Piece> m_pieces;
    std::vector<Attached> m_attached;
    std::vector<double> m_slackOf;
    double m_slack = 0.0;
};
}  // namespace cullet
