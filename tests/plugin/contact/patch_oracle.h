// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/contact/contact_patch.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace cullet::test
{
using Corners = std::vector<Eigen::Vector3d>;

/// All faces of a core in double, by brute force. World axes, relative to a common point of both cores of a pair.
class CoreSurface
{
public:
    struct Side
    {
        Eigen::Vector3d normal;
        double offset;
        Corners corners;  ///< counter-clockwise seen from outside
    };

    CoreSurface(const PosedShape& shape, const Eigen::Vector3d& reference) : m_kind(shape.hull().kind())
    {
        const Eigen::Matrix3d basis = shape.basis();
        const Eigen::Vector3d origin = shape.origin() - reference;
        for (std::int32_t v = 0; v < shape.vertexCount(); ++v)
            m_points.push_back(origin + basis * shape.hull().vertex(v).cast<double>());
        const Eigen::Matrix3d normals = basis.determinant() * basis.inverse().transpose();
        const double turn = basis.determinant() < 0.0 ? -1.0 : 1.0;
        for (std::size_t f = 0; f < shape.hull().faces().size(); ++f)
        {
            Side side;
            side.normal = (turn * normals * shape.hull().faces()[f].normal).normalized();
            for (const std::int32_t v : shape.hull().faceVertices(static_cast<std::int32_t>(f)))
                side.corners.push_back(m_points[static_cast<std::size_t>(v)]);
            if (turn < 0.0)
                std::reverse(side.corners.begin(), side.corners.end());
            side.offset = -std::numeric_limits<double>::infinity();
            for (const Eigen::Vector3d& p : side.corners)
                side.offset = std::max(side.offset, side.normal.dot(p));
            m_sides.push_back(side);
        }
    }

    HullKind kind() const { return m_kind; }
    const Corners& points() const { return m_points; }
    const std::vector<Side>& sides() const { return m_sides; }

    /// Distance of a point from the nearest face plane, or from the segment.
    double offPlane(const Eigen::Vector3d& p) const
    {
        if (m_kind == HullKind::Segment)
            return offSegment(p);
        double least = std::numeric_limits<double>::infinity();
        for (const Side& side : m_sides)
            least = std::min(least, std::abs(side.normal.dot(p) - side.offset));
        return least;
    }

    /// Distance of a point outside of all face planes, and of the edges of a flat core.
    double outside(const Eigen::Vector3d& p) const
    {
        if (m_kind == HullKind::Segment)
            return offSegment(p);
        double most = -std::numeric_limits<double>::infinity();
        for (const Side& side : m_sides)
        {
            most = std::max(most, side.normal.dot(p) - side.offset);
            for (std::size_t i = 0; m_kind == HullKind::Polygon && i < side.corners.size(); ++i)
            {
                const Eigen::Vector3d& from = side.corners[i];
                const Eigen::Vector3d along = side.corners[(i + 1) % side.corners.size()] - from;
                most = std::max(most, along.cross(side.normal).normalized().dot(p - from));
            }
        }
        return most;
    }

    /// The face most aligned with a direction, if no other one is nearly as aligned.
    const Side* faceAlong(const Eigen::Vector3d& direction) const
    {
        const Side* best = nullptr;
        double cosine = 0.0, second = 0.0;
        for (const Side& side : m_sides)
        {
            const double c = side.normal.dot(direction);
            second = std::max(second, std::min(c, cosine));
            if (c > cosine)
                best = &side;
            cosine = std::max(c, cosine);
        }
        return cosine > 0.9998 && second < 0.99 ? best : nullptr;
    }

private:
    double offSegment(const Eigen::Vector3d& p) const
    {
        const Eigen::Vector3d along = m_points[1] - m_points[0];
        const double t = std::clamp((p - m_points[0]).dot(along) / along.squaredNorm(), 0.0, 1.0);
        return (p - m_points[0] - t * along).norm();
    }

    HullKind m_kind;
    Corners m_points;
    std::vector<Side> m_sides;
};

/// Clips a polygon, or a segment with two corners, to where a linear function is not negative.
template <class Height>
Corners cutPolygon(const Corners& polygon, const Height& height)
{
    Corners kept;
    for (std::size_t i = 0; i < polygon.size(); ++i)
    {
        const Eigen::Vector3d &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
        const double hp = height(p), hq = height(q);
        if (hp >= 0.0)
            kept.push_back(p);
        if ((hp < 0.0) != (hq < 0.0) && (polygon.size() > 2 || i == 0))
            kept.push_back(p + (q - p) * (hp / (hp - hq)));
    }
    return kept;
}

/// Area of the convex hull of points, in any order, projected along a unit vector.
inline double areaOf(Corners points, const Eigen::Vector3d& normal)
{
    if (points.size() < 3)
        return 0.0;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& p : points)
        centre += p / static_cast<double>(points.size());
    const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
    const auto angle = [&](const Eigen::Vector3d& p)
    { return std::atan2(v.dot(p - centre), u.dot(p - centre)); };
    std::sort(points.begin(), points.end(),
              [&](const auto& l, const auto& r) { return angle(l) < angle(r); });
    double doubled = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i)
        doubled += normal.dot((points[i] - centre).cross(points[(i + 1) % points.size()] - centre));
    return 0.5 * doubled;
}

/// Largest distance of two of the points, projected along a unit vector.
inline double lengthOf(const Corners& points, const Eigen::Vector3d& normal)
{
    double longest = 0.0;
    for (const Eigen::Vector3d& p : points)
    {
        for (const Eigen::Vector3d& q : points)
            longest = std::max(longest, normal.cross(p - q).norm());
    }
    return longest;
}

/// The corners of the intersection of a face of one core with a face of the other, or with a segment, projected along
/// the normal, filtered by `counts`.
///
/// @param other  corners of a face, or the ends of a segment
/// @param counts predicate of a corner and the distance of the cores there
template <class Counts>
Corners exactPatch(const CoreSurface::Side& face, const Corners& other, const Eigen::Vector3d& normal,
                   const Counts& counts)
{
    Corners patch = other;
    // Counter-clockwise seen against the face's normal: the inside is on the left of every side.
    for (std::size_t i = 0; i < face.corners.size(); ++i)
    {
        const Eigen::Vector3d& from = face.corners[i];
        const Eigen::Vector3d side = face.corners[(i + 1) % face.corners.size()] - from;
        const Eigen::Vector3d inside =
            (face.normal.dot(normal) > 0.0 ? normal : Eigen::Vector3d(-normal)).cross(side);
        patch = cutPolygon(patch, [&](const Eigen::Vector3d& p) { return inside.dot(p - from); });
    }
    const double slope = 1.0 / face.normal.dot(normal);
    const double sign = slope < 0.0 ? 1.0 : -1.0;
    const auto isOut = [&](const Eigen::Vector3d& p)
    { return !counts(p, sign * slope * (face.offset - face.normal.dot(p))); };
    patch.erase(std::remove_if(patch.begin(), patch.end(), isOut), patch.end());
    return patch;
}
}  // namespace cullet::test
