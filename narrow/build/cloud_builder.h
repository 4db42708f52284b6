// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/hull.h"
#include "cullet/narrow/math/debug_containers.h"
#include "cullet/narrow/math/lanes.h"

#include <Eigen/Core>

#include <algorithm>
#include <array>
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
    using L = Lanes<S>;
    using Part = typename L::Vector;  ///< half of a point, or all of it
    using Mask = typename L::Mask;
    using Wide = Lanes<double>::Vector;
    static constexpr std::size_t kWidth = L::kWidth, kParts = 4 / kWidth;
    static constexpr S kMost = std::numeric_limits<S>::max();
    static constexpr S kLargest = CoordinateRange::kLargest < kMost ? S(CoordinateRange::kLargest) : kMost;

    struct Totals
    {
        Wide sumXy = {}, sumZ = {}, radius2 = {};
        Part largest = {};  ///< magnitude of a coordinate; a NaN shows in the sum alone
    };

    /// In one pass: the points as they are, their coordinates in rows, and what finish() needs.
    ///
    /// @return false if a point is not finite
    static bool copy(Hull<S>& cloud, const S* points, std::int32_t count)
    {
        const auto size = static_cast<std::size_t>(count), padded = paddedCount(size);
        resize(cloud, size, padded);
        S* const lanes = cloud.m_lanes.front().of.data();
        const std::array<S*, 3> rows = {cloud.m_x.data(), cloud.m_y.data(), cloud.m_z.data()};
        Totals totals;
        std::size_t done = 0;
        for (; done + kWidth <= size; done += kWidth)
        {
            for (std::size_t i = 0; i < kWidth; ++i)
                copyPoint(points + 4 * (done + i), lanes + 4 * (done + i), totals);
            fillRows(lanes, rows, done, totals);
        }
        for (std::size_t i = done; i < size; ++i)
            copyPoint(points + 4 * i, lanes + 4 * i, totals);
        std::fill(cloud.m_lanes.begin() + count, cloud.m_lanes.end(), cloud.m_lanes.front());
        for (; done < padded; done += kWidth)
            fillRows(lanes, rows, done, totals);
        const Eigen::Vector3d sum(totals.sumXy[0], totals.sumXy[1], totals.sumZ[0]);
        if (largestLane(totals.largest) > kLargest || sum.hasNaN())
            return false;
        finish(cloud, sum, std::sqrt(largestLane(totals.radius2)));
        if (count > Hull<S>::kMostInOneScan)
            cloud.m_pointBlocks = PointBlocks<S>(cloud.lanes(0), count);
        else if (!cloud.m_pointBlocks.isEmpty())
            cloud.m_pointBlocks = PointBlocks<S>();
        return true;
    }

    static void resize(Hull<S>& cloud, std::size_t count, std::size_t padded)
    {
        cloud.m_kind = HullKind::Cloud;
        cloud.m_vertexCount = static_cast<std::int32_t>(count);
        for (std::vector<S>* axis : {&cloud.m_x, &cloud.m_y, &cloud.m_z})
            axis->resize(padded);
        cloud.m_lanes.resize(padded);
        if (cloud.m_source.size() == count)
            return;
        cloud.m_source.resize(count);
        std::iota(cloud.m_source.begin(), cloud.m_source.end(), 0);
    }

    /// Copies a point as it is used, and adds it to the sum.
    [[gnu::always_inline]] static void copyPoint(const S* point, S* place, Totals& totals)
    {
        const Part first = usable(L::load(point), kIsCoordinate.front(), totals.largest);
        store(first, place);
        if constexpr (kParts == 1)
        {
            totals.sumXy += wideFirst(first);
            totals.sumZ += wideLast(first);
        }
        else
        {
            const Part last = usable(L::load(point + kWidth), kIsCoordinate.back(), totals.largest);
            store(last, place + kWidth);
            totals.sumXy += first;
            totals.sumZ += last;
        }
    }

    static void store(const Part& part, S* place) { std::memcpy(place, &part, sizeof(part)); }

    /// Replaces a negative zero, a coordinate below the range and what is no coordinate by 0.
    [[gnu::always_inline]] static Part usable(Part part, const Mask& isCoordinate, Part& largest)
    {
        part = reinterpret_cast<Part>(reinterpret_cast<Mask>(part) & isCoordinate);
        const Part size = L::magnitude(part);
        largest = size > largest ? size : largest;
        if constexpr (CoordinateRange::kSmallest > std::numeric_limits<S>::min())
            return size < L::fill(S(CoordinateRange::kSmallest)) ? Part{} : part;
        else
            return part + Part{};
    }

    /// Writes the coordinates of kWidth points that are copied.
    [[gnu::always_inline]] static void fillRows(const S* lanes, const std::array<S*, 3>& rows,
                                                std::size_t begin, Totals& totals)
    {
        const S* const from = lanes + 4 * begin;
        const Part p0 = L::load(from), p1 = L::load(from + kWidth), p2 = L::load(from + 2 * kWidth),
                   p3 = L::load(from + 3 * kWidth);
        Part x, y, z;
        if constexpr (kParts == 1)
        {
            const Part low = CULLET_SHUFFLE(p0, p1, 0, 4, 1, 5), high = CULLET_SHUFFLE(p2, p3, 0, 4, 1, 5);
            const Part lowZ = CULLET_SHUFFLE(p0, p1, 2, 6, 3, 7), highZ = CULLET_SHUFFLE(p2, p3, 2, 6, 3, 7);
            x = CULLET_SHUFFLE(low, high, 0, 1, 4, 5);
            y = CULLET_SHUFFLE(low, high, 2, 3, 6, 7);
            z = CULLET_SHUFFLE(lowZ, highZ, 0, 1, 4, 5);
            keepFarthest(wideFirst(x), wideFirst(y), wideFirst(z), totals.radius2);
            keepFarthest(wideLast(x), wideLast(y), wideLast(z), totals.radius2);
        }
        else
        {
            x = CULLET_SHUFFLE(p0, p2, 0, 2);
            y = CULLET_SHUFFLE(p0, p2, 1, 3);
            z = CULLET_SHUFFLE(p1, p3, 0, 2);
            keepFarthest(x, y, z, totals.radius2);
        }
        store(x, rows[0] + begin);
        store(y, rows[1] + begin);
        store(z, rows[2] + begin);
    }

    [[gnu::always_inline]] static void keepFarthest(const Wide& x, const Wide& y, const Wide& z,
                                                    Wide& radius2)
    {
        const Wide square = x * x + y * y + z * z;
        radius2 = square > radius2 ? square : radius2;
    }

    static constexpr std::array<Mask, kParts> kIsCoordinate = []
    {
        if constexpr (kParts == 1)
            return std::array<Mask, 1>{Mask{-1, -1, -1, 0}};
        else
            return std::array<Mask, 2>{Mask{-1, -1}, Mask{-1, 0}};
    }();
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
