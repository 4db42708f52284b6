// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/hull.h"
#include "cullet/narrow/hull/linear_scan.h"
#include "cullet/narrow/hull/planar_hull.h"
#include "cullet/narrow/math/debug_containers.h"
#include "cullet/narrow/math/lanes.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace cullet
{
/// The points of a Cloud as seen from one of them, in perspective on a plane: the edges of the hull at that point go to
/// the corners of the convex hull in the plane.
///
/// Rounded: the edges are a guess, which the caller tests.
///
/// Cost: a division per point, and that of a PlanarHull; no allocation.
template <class S>
class CornerProjection
{
public:
    static constexpr std::int32_t kMostPoints = 256;
    static constexpr std::size_t kMostEdges = PlanarHull<S>::kMostCorners;

    /// @param axis unit, in the frame of the points
    CornerProjection(const Hull<S>& cloud, std::int32_t vertex, const Eigen::Vector3d& axis)
    {
        if (cloud.vertexCount() >= 4 && cloud.vertexCount() <= kMostPoints && project(cloud, vertex, axis))
            wrap(cloud, vertex);
    }

    /// The ends of the edges, counter-clockwise from outside; none if there are more than kMostEdges, more than
    /// kMostPoints, or points that are not clearly below the vertex along the axis.
    const std::int32_t* begin() const { return m_ends.data(); }
    const std::int32_t* end() const { return m_ends.data() + m_count; }

private:
    using L = Lanes<S>;
    using Vector = typename L::Vector;
    using Mask = typename L::Mask;

    /// Least drop below the vertex, in units of the radius: products of coordinates in the plane do not overflow.
    static constexpr double kLeastDrop = 1e-5;

    struct Frame
    {
        LaneDirection<S> down, right, up;
    };

    static LaneDirection<S> spread(const Eigen::Vector3d& v)
    {
        return LaneDirection<S>(Eigen::Matrix<S, 3, 1>(v.cast<S>()));
    }

    bool project(const Hull<S>& cloud, std::int32_t vertex, const Eigen::Vector3d& axis)
    {
        const Eigen::Vector3d right = axis.unitOrthogonal();
        const Frame frame = {spread(-axis), spread(right), spread(axis.cross(right))};
        const S* const from = cloud.lanes(vertex);
        const Vector x = L::fill(from[0]), y = L::fill(from[1]), z = L::fill(from[2]);
        const Vector least = L::fill(static_cast<S>(kLeastDrop * cloud.radius()));
        Mask below = {};
        for (std::int32_t i = 0; i < cloud.paddedCount(); i += L::kWidth)
            below -= projectLanes(frame, L::load(cloud.x() + i) - x, L::load(cloud.y() + i) - y,
                                  L::load(cloud.z() + i) - z, least, i);
        const std::int32_t copies = vertex == 0 ? cloud.paddedCount() - cloud.vertexCount() : 0;
        typename L::Integer count = 0;
        for (int lane = 0; lane < L::kWidth; ++lane)
            count += below[lane];
        return count == cloud.paddedCount() - copies - 1 && hideVertex(cloud, vertex, frame);
    }

    /// @return the lanes that are clearly below the vertex
    Mask projectLanes(const Frame& frame, const Vector& x, const Vector& y, const Vector& z,
                      const Vector& least, std::int32_t i)
    {
        const auto along = [&](const LaneDirection<S>& d) __attribute__((always_inline))
        {
            return x * d.x + y * d.y + z * d.z;
        };
        const Vector drop = along(frame.down);
        const Mask isBelow = drop > least;
        // No division by zero at the vertex.
        const Vector scale = L::fill(S(1)) / (isBelow ? drop : L::fill(S(1)));
        const Vector right = along(frame.right) * scale, up = along(frame.up) * scale;
        std::memcpy(&m_right[static_cast<std::size_t>(i)], &right, sizeof(right));
        std::memcpy(&m_up[static_cast<std::size_t>(i)], &up, sizeof(up));
        return isBelow;
    }

    /// Puts the vertex itself, and its copies in the padding, where the hull's centre is seen.
    bool hideVertex(const Hull<S>& cloud, std::int32_t vertex, const Frame& frame)
    {
        const S *const from = cloud.lanes(vertex), *const centre = cloud.centreLanes();
        const S way[] = {centre[0] - from[0], centre[1] - from[1], centre[2] - from[2]};
        const auto along = [&](const LaneDirection<S>& d)
        { return way[0] * d.x[0] + way[1] * d.y[0] + way[2] * d.z[0]; };
        const S drop = along(frame.down);
        if (!(drop > static_cast<S>(kLeastDrop * cloud.radius())))
            return false;
        const std::int32_t last = vertex == 0 ? cloud.paddedCount() : cloud.vertexCount();
        for (std::int32_t i = vertex; i < last; i = i < cloud.vertexCount() ? cloud.vertexCount() : i + 1)
        {
            m_right[static_cast<std::size_t>(i)] = along(frame.right) / drop;
            m_up[static_cast<std::size_t>(i)] = along(frame.up) / drop;
        }
        return true;
    }

    void wrap(const Hull<S>& cloud, std::int32_t vertex)
    {
        const auto v = static_cast<std::size_t>(vertex);
        const PlanarHull<S> corners({m_right.data(), m_up.data(), cloud.vertexCount()},
                                    {m_right[v], m_up[v]});
        if (std::find(corners.begin(), corners.end(), vertex) != corners.end())
            return;
        m_count = static_cast<std::size_t>(corners.end() - corners.begin());
        std::copy(corners.begin(), corners.end(), m_ends.begin());
    }

    // Set as far as there are points.
    std::array<S, kMostPoints> m_right, m_up;
    std::array<std::int32_t, kMostEdges> m_ends;
    std::size_t m_count = 0;
};
}  // namespace cullet
