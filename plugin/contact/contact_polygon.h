// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/contact/contact_feature.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Faces with more corners are thinned out.
constexpr int kMostCorners = 16;

/// Two tangents of the contact and its normal, with the touch's point of B as origin. It maps a point in world space to
///  * its coordinates along both tangents (lanes 0 and 1),
///  * the height at which a line through it along the normal meets B, once the reference face is set (lane 2),
///  * and the distance of A and B on that line (lane 3). All of these are linear functions.
class ContactFrame
{
public:
    explicit ContactFrame(const Eigen::Vector3d& normal)
    {
        read(normal, m_axes[2]);
        // Duff et al. 2017, "Building an Orthonormal Basis, Revisited": no root, and no branch for special cases.
        const btScalar x = m_axes[2][0], y = m_axes[2][1], z = m_axes[2][2];
        const btScalar sign = std::copysign(btScalar(1), z);
        const btScalar a = btScalar(-1) / (sign + z);
        const btScalar b = x * y * a;
        m_axes[0] = Components{1 + sign * x * x * a, sign * b, -sign * x, 0};
        m_axes[1] = Components{b, sign + y * y * a, -y, 0};
    }

    /// Sets the plane from which distances of points of the other core are measured.
    ///
    /// @param planeNormal not perpendicular to the contact normal
    void setReference(const Eigen::Vector3d& planeNormal, const Eigen::Vector3d& normal, bool isOfA)
    {
        Components onB = m_axes[2], distance;
        const double slope = 1.0 / planeNormal.dot(normal);
        read(planeNormal * (isOfA ? -slope : slope), distance);
        if (!isOfA)
            onB -= distance;
        m_rows[0] = CULLET_SHUFFLE(m_axes[0], m_axes[1], 0, 4, 1, 5);
        m_rows[1] = CULLET_SHUFFLE(onB, distance, 0, 4, 1, 5);
        const Components ends = CULLET_SHUFFLE(m_axes[0], m_axes[1], 2, 6, 3, 7);
        const Components otherEnds = CULLET_SHUFFLE(onB, distance, 2, 6, 3, 7);
        m_rows[2] = CULLET_SHUFFLE(ends, otherEnds, 0, 1, 4, 5);
        const Components low = m_rows[0], high = m_rows[1];
        m_rows[0] = CULLET_SHUFFLE(low, high, 0, 1, 4, 5);
        m_rows[1] = CULLET_SHUFFLE(low, high, 2, 3, 6, 7);
    }

    /// Maps a vector in world axes.
    template <class V>
    void map(const V& v, Components& out) const
    {
        out = m_rows[0] * btScalar(v[0]) + m_rows[1] * btScalar(v[1]) + m_rows[2] * btScalar(v[2]);
    }

    /// The world vector to a point given by lanes 0 to 2.
    btVector3 world(const Components& p) const
    {
        const Components v = m_axes[0] * p[0] + m_axes[1] * p[1] + m_axes[2] * p[2];
        return btVector3(v[0], v[1], v[2]);
    }

private:
    std::array<Components, 3> m_axes;  ///< tangents and normal
    std::array<Components, 3> m_rows;  ///< of the matrix, transposed
};

/// Maps vertices of a core into the contact frame.
class CornerMap
{
public:
    /// @param origin of the core, relative to that of the frame
    CornerMap(const PosedShape& shape, const ContactFrame& frame, const Eigen::Vector3d& origin)
        : m_hull(shape.hull())
    {
        for (std::size_t k = 0; k < 3; ++k)
        {
            const btScalar column[] = {shape.row(0)[k], shape.row(1)[k], shape.row(2)[k]};
            frame.map(column, m_columns[k]);
        }
        frame.map(origin, m_origin);
    }

    /// The core's origin in the coordinates of the frame.
    const Components& origin() const { return m_origin; }

    /// Sum of the magnitudes of the origin's coordinates along the tangents and on B.
    btScalar originSize() const
    {
        Components magnitudes = m_origin;
        Quad<btScalar>::makePositive(magnitudes);
        return Quad<btScalar>::sumOfThree(magnitudes);
    }

    void shift(const Components& by) { m_origin += by; }

    void corner(std::int32_t vertex, Components& out) const
    {
        out = m_columns[0] * m_hull.x()[vertex] + m_columns[1] * m_hull.y()[vertex] +
              m_columns[2] * m_hull.z()[vertex] + m_origin;
    }

private:
    const Hull<btScalar>& m_hull;
    std::array<Components, 3> m_columns;
    Components m_origin;
};

/// Corners of a convex polygon, or the ends of a segment, in the coordinates of ContactFrame. Clipping by a plane adds
/// at most one corner.
struct ContactPolygon
{
    using Heights = std::array<btScalar, 2 * kMostCorners>;

    void set(const CornerMap& map, const Hull<btScalar>::Span& vertices)
    {
        count = std::min<std::int32_t>(vertices.size(), kMostCorners);
        for (std::int32_t i = 0; i < count; ++i)
            map.corner(vertices[count == vertices.size() ? i : i * vertices.size() / count],
                       corners[static_cast<std::size_t>(i)]);
    }

    std::array<Components, 2 * kMostCorners> corners;
    std::int32_t count = 0;
};

/// Clips a polygon to the heights of at least 0.
inline void clip(const ContactPolygon& in, const ContactPolygon::Heights& heights, ContactPolygon& out)
{
    const auto count = static_cast<std::size_t>(in.count);
    std::size_t kept = 0;
    const auto add = [&](const Components& corner)
    {
        // Only rounding can produce more corners than fit, and those lie next to another corner.
        if (kept < out.corners.size())
            out.corners[kept++] = corner;
    };
    bool isIn = heights[0] >= 0;
    for (std::size_t i = 0; i < count; ++i)
    {
        if (isIn)
            add(in.corners[i]);
        const std::size_t next = i + 1 < count ? i + 1 : 0;
        const bool wasIn = isIn;
        isIn = heights[next] >= 0;
        // A segment has no edge from its last end back to its first.
        if (isIn == wasIn || (next == 0 && count == 2))
            continue;
        const btScalar t = heights[i] / (heights[i] - heights[next]);
        add(in.corners[i] + (in.corners[next] - in.corners[i]) * t);
    }
    out.count = static_cast<std::int32_t>(kept);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
