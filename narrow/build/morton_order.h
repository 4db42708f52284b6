// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/math/debug_containers.h"

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace cullet
{
/// An order of points in which those near each other in space mostly follow each other: by the bits of their places in
/// a grid over their box, interleaved (Morton 1966). Points of one cell keep their order. Few points, which are in a
/// cache anyway, all keep their order.
///
/// Cost: O(n), 20 ns for a point; two passes of a radix sort.
class MortonOrder
{
public:
    /// @param points finite
    explicit MortonOrder(const std::vector<Eigen::Vector3d>& points)
        : m_points(points.size()), m_placeOf(points.size())
    {
        Eigen::Vector3d low = points.empty() ? Eigen::Vector3d(0, 0, 0) : points[0], high = low;
        for (const Eigen::Vector3d& point : points)
        {
            low = low.cwiseMin(point);
            high = high.cwiseMax(point);
        }
        m_extent = high - low;
        if (points.size() < kLeastSorted)
            std::iota(m_points.begin(), m_points.end(), 0);
        else
            sort(points, low);
        for (std::size_t place = 0; place < m_points.size(); ++place)
            m_placeOf[static_cast<std::size_t>(m_points[place])] = static_cast<std::int32_t>(place);
    }

    /// Indices of the points in this order.
    const std::vector<std::int32_t>& points() const { return m_points; }
    /// The place of a point in points().
    std::int32_t placeOf(std::int32_t point) const { return m_placeOf[static_cast<std::size_t>(point)]; }
    /// Of the box around all points.
    const Eigen::Vector3d& extent() const { return m_extent; }

private:
    static constexpr std::size_t kLeastSorted = 4096;
    static constexpr int kCellBits = 7, kDigitBits = 11;

    struct Keyed
    {
        std::uint32_t key;
        std::int32_t point;
    };

    /// The bits of a number below 2^10, two places apart.
    static std::uint32_t spread(std::uint32_t v)
    {
        v = (v | v << 16) & 0x030000ffu;
        v = (v | v << 8) & 0x0300f00fu;
        v = (v | v << 4) & 0x030c30c3u;
        return (v | v << 2) & 0x09249249u;
    }

    void sort(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& low)
    {
        constexpr double kCells = 1 << kCellBits;
        const double largest = m_extent.maxCoeff(), factor = largest > 0.0 ? kCells / largest : 0.0;
        std::vector<Keyed> keyed, byLowDigit(points.size());
        keyed.reserve(points.size());
        for (const Eigen::Vector3d& point : points)
        {
            std::uint32_t key = 0;
            for (int axis = 0; axis < 3; ++axis)
                key |= spread(static_cast<std::uint32_t>(
                           std::min((point[axis] - low[axis]) * factor, kCells - 1.0)))
                       << axis;
            keyed.push_back({key, static_cast<std::int32_t>(keyed.size())});
        }
        sortByDigit(keyed, 0, [&](std::size_t place, const Keyed& k) { byLowDigit[place] = k; });
        sortByDigit(byLowDigit, kDigitBits,
                    [&](std::size_t place, const Keyed& k) { m_points[place] = k.point; });
    }

    /// Calls put(place, keyed) for all, ordered by a digit of their keys; equal ones keep their order.
    template <class Put>
    static void sortByDigit(const std::vector<Keyed>& keyed, int shift, const Put& put)
    {
        constexpr std::uint32_t kDigits = 1u << kDigitBits;
        std::array<std::uint32_t, kDigits + 1> begin = {};
        for (const Keyed& k : keyed)
            ++begin[(k.key >> shift) % kDigits + 1];
        for (std::size_t digit = 1; digit <= kDigits; ++digit)
            begin[digit] += begin[digit - 1];
        for (const Keyed& k : keyed)
            put(begin[(k.key >> shift) % kDigits]++, k);
    }

    std::vector<std::int32_t> m_points, m_placeOf;
    Eigen::Vector3d m_extent;
};
}  // namespace cullet
