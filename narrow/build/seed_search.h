// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/hull.h"
#include "cullet/narrow/math/debug_containers.h"
#include "cullet/narrow/math/exact_orientation.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace cullet
{
/// Finds four points that span space, chosen greedily to be far apart; exact tests determine the kind of the hull.
/// Cost: O(n).
class SeedSearch
{
public:
    /// @param points distinct, at least one
    explicit SeedSearch(const std::vector<Eigen::Vector3d>& points) : m_points(points) {}

    /// @param seed [out] as many points as span the hull
    HullKind find(std::array<std::int32_t, 4>& seed) const
    {
        if (m_points.size() == 1)
            return HullKind::Point;
        seed[0] = indexOfMaximum([](const Eigen::Vector3d& p) { return p.squaredNorm(); });
        const Eigen::Vector3d a = m_points[seed[0]];
        seed[1] = indexOfMaximum([&](const Eigen::Vector3d& p) { return (p - a).squaredNorm(); });
        const Eigen::Vector3d b = m_points[seed[1]];
        const std::int32_t off =
            indexOfMaximum([&](const Eigen::Vector3d& p) { return (p - a).cross(b - a).squaredNorm(); });
        seed[2] = firstWhere(off, [&](std::int32_t i) { return !isCollinear(a, b, m_points[i]); });
        if (seed[2] < 0)
            return HullKind::Segment;
        const Eigen::Vector3d c = m_points[seed[2]];
        const Eigen::Vector3d normal = (b - a).cross(c - a);
        const std::int32_t above =
            indexOfMaximum([&](const Eigen::Vector3d& p) { return std::abs(normal.dot(p - a)); });
        seed[3] = firstWhere(above, [&](std::int32_t i) { return orientation(a, b, c, m_points[i]) != 0; });
        return seed[3] < 0 ? HullKind::Polygon : HullKind::Solid;
    }

private:
    template <class Measure>
    std::int32_t indexOfMaximum(const Measure& measure) const
    {
        std::int32_t best = 0;
        double bestValue = -1.0;
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(m_points.size()); ++i)
        {
            const double value = measure(m_points[i]);
            if (value > bestValue)
            {
                best = i;
                bestValue = value;
            }
        }
        return best;
    }

    template <class Predicate>
    std::int32_t firstWhere(std::int32_t guess, const Predicate& predicate) const
    {
        if (predicate(guess))
            return guess;
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(m_points.size()); ++i)
        {
            if (predicate(i))
                return i;
        }
        return -1;
    }

    const std::vector<Eigen::Vector3d>& m_points;
};
}  // namespace cullet
