// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/block_scan.h"
#include "cullet/narrow/hull/posed_hull.h"

#include <Eigen/Core>

#include <cstdint>

namespace cullet
{
/// A hull whose supports are compared in double, at several times the cost; see PosedHull for the interface.
template <class S>
class PreciseHull
{
public:
    /// @param hull outlives this object
    explicit PreciseHull(const PosedHull<S>& hull) : m_hull(hull), m_basis(hull.basis()) {}

    Eigen::Vector3d origin() const { return m_hull.origin(); }
    Eigen::Vector3d centre() const { return m_hull.centre(); }
    std::int32_t vertexCount() const { return m_hull.vertexCount(); }
    Eigen::Vector3d point(std::int32_t vertex) const { return m_hull.point(vertex); }

    /// Climbs from the hull's own support; without a graph, compares all points that are nearly as high.
    SupportPoint support(const Eigen::Vector3d& direction, std::int32_t start) const
    {
        const Hull<S>& hull = m_hull.hull();
        const Eigen::Vector3d local = m_basis.transpose() * direction;
        const auto heightOf = [&](std::int32_t vertex)
        { return local.dot(hull.vertex(vertex).template cast<double>()); };
        std::int32_t highest = m_hull.support(direction, start).vertex, from = -1;
        double height = heightOf(highest);
        const auto raise = [&](std::int32_t vertex)
        {
            if (const double other = heightOf(vertex); other > height)
            {
                height = other;
                highest = vertex;
            }
            return true;
        };
        while (highest != from)
        {
            from = highest;
            allOfNeighbours<S>(hull, from, local, 0.0, 0.0, raise);
        }
        return {point(highest), highest};
    }

private:
    const PosedHull<S>& m_hull;
    const Eigen::Matrix3d m_basis;
};
}  // namespace cullet
