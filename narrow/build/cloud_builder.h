// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/hull.h"
#include "cullet/narrow/math/debug_containers.h"
#include "cullet/narrow/math/lanes.h"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numeric>
#include <vector>

namespace cullet
{
/// Fourth powers of coordinates must not overflow, and products of three must be exact. So in double, points beyond
/// kLargest count as not finite, and coordinates below kSmallest as 0; float has neither.
struct CoordinateRange
{
    static constexpr double kLargest = 1e60, kSmallest = 1e-60;
};

/// Makes hulls of kind Cloud: points for support searches only, by scans. The support is as far along a direction as
/// that of makeHull(points), up to rounding.
template <class S>
class CloudBuilder
{
public:
    /// Replaces the points of a cloud, or of a hull without points. For as many points as before, or fewer, nothing is
    /// allocated. Cost: O(n), 3 ns per point.
    ///
    /// @param points [count] x, y, z and a number that is not used
    static void refill(Hull<S>& cloud, const S* points, std::int32_t count)
    {
        if (count > 0 && copy(cloud, points, count))
            return;
        cloud = Hull<S>();
        cloud.m_kind = count > 0 ? HullKind::NotFinite : HullKind::Empty;
    }

    /// Sets what follows from the points of any hull.
    ///
    /// @param sum    of the vertices
    /// @param radius the largest distance of a vertex
    static void finish(Hull<S>& hull, const Eigen::Vector3d& sum, double radius)
    {
        hull.m_centre = sum / hull.m_vertexCount;
        hull.m_centreLanes = lanesOf(hull.m_centre);
        hull.m_radius = radius;
        hull.m_isCentred = hull.m_centre.norm() <= 0.1 * radius;
        hull.m_reach = static_cast<S>(radius * (1.0 + 2.0 * std::numeric_limits<S>::epsilon()));
        const std::size_t padded = paddedCount(static_cast<std::size_t>(hull.m_vertexCount));
        for (std::vector<S>* axis : {&hull.m_x, &hull.m_y, &hull.m_z})
        {
            axis->resize(padded);
            std::fill(axis->begin() + hull.m_vertexCount, axis->end(), axis->front());
        }
    }

    static typename Hull<S>::FourLanes lanesOf(const Eigen::Vector3d& v)
    {
        return {{static_cast<S>(v[0]), static_cast<S>(v[1]), static_cast<S>(v[2]), S(0)}};
    }

    static std::size_t paddedCount(std::size_t count) { return (count + 7) / 8 * 8; }

private:
    using Quad = typename cullet::Quad<S>::Vector;

    using Mask = typename cullet::Quad<S>::Mask;
    using Wide = typename cullet::Quad<double>::Vector;

    /// @return false if a point is not finite
    static bool copy(Hull<S>& cloud, const S* points, std::int32_t count)
    {
        resize(cloud, static_cast<std::size_t>(count));
        Wide sum = {};
        double radius2 = 0.0;
        Mask areUsable = Mask{} == Mask{};
        for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
        {
            Quad point;
            std::memcpy(&point, points + 4 * i, sizeof(point));
            makeUsable(point, areUsable);
            std::memcpy(cloud.m_lanes[i].of.data(), &point, sizeof(point));
            cloud.m_x[i] = point[0];
            cloud.m_y[i] = point[1];
            cloud.m_z[i] = point[2];
            const Wide wide = __builtin_convertvector(point, Wide);
            sum += wide;
            const Wide squares = wide * wide;
            radius2 = std::max(radius2, squares[0] + squares[1] + squares[2]);
        }
        if (quadBits<S>(areUsable) != 0xfu)
            return false;
        finish(cloud, {sum[0], sum[1], sum[2]}, std::sqrt(radius2));
        cloud.m_pointBlocks =
            count > Hull<S>::kMostInOneScan ? PointBlocks<S>(cloud.lanes(0), count) : PointBlocks<S>();
        return true;
    }

    static void resize(Hull<S>& cloud, std::size_t count)
    {
        cloud.m_kind = HullKind::Cloud;
        cloud.m_vertexCount = static_cast<std::int32_t>(count);
        for (std::vector<S>* axis : {&cloud.m_x, &cloud.m_y, &cloud.m_z})
            axis->resize(paddedCount(count));
        cloud.m_lanes.resize(count);
        if (cloud.m_source.size() == count)
            return;
        cloud.m_source.resize(count);
        std::iota(cloud.m_source.begin(), cloud.m_source.end(), 0);
    }

    /// Replaces the coordinates by those that are used: a negative zero by 0, too.
    ///
    /// @param areUsable cleared in the lanes of NaN, infinities and coordinates beyond the range
    static void makeUsable(Quad& point, Mask& areUsable)
    {
        constexpr S kMost = std::numeric_limits<S>::max();
        constexpr S kLargest = CoordinateRange::kLargest < kMost ? S(CoordinateRange::kLargest) : kMost;
        cullet::Quad<S>::clearLast(point);
        Quad size = point;
        cullet::Quad<S>::makePositive(size);
        // A NaN makes the comparison false.
        areUsable &= size <= Quad{} + kLargest;
        // Turns a negative zero into 0.
        point += Quad{};
        if constexpr (CoordinateRange::kSmallest > std::numeric_limits<S>::min())
            point = size < Quad{} + S(CoordinateRange::kSmallest) ? Quad{} : point;
    }
};

/// Points as a hull for support searches only; see CloudBuilder. Cost: O(n).
template <class S>
Hull<S> makeCloud(const std::vector<Eigen::Matrix<S, 3, 1>>& points)
{
    std::vector<S> quads;
    quads.reserve(4 * points.size());
    for (const Eigen::Matrix<S, 3, 1>& point : points)
        quads.insert(quads.end(), {point[0], point[1], point[2], S(0)});
    Hull<S> cloud;
    CloudBuilder<S>::refill(cloud, quads.data(), static_cast<std::int32_t>(points.size()));
    return cloud;
}
}  // namespace cullet
