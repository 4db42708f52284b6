// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/math/unit_vector.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>

namespace cullet
{
/// Four points of A - B from which an expansion begins, made from the simplex in which a search has enclosed the
/// origin.
template <class Search>
class SeedTetrahedron
{
public:
    using Support = typename Search::Support;

    /// Extents below this, times the size, have no volume in double.
    static constexpr double kFlat = 1e-10;

    explicit SeedTetrahedron(Search& search) : m_search(search) {}

    /// Adds support points until four span space. The origin stays in the convex hull of the simplex, hence in that of
    /// the four points.
    ///
    /// @return false if A - B has no extent along normal()
    bool complete()
    {
        int count = m_search.count();
        for (int i = 0; i < count; ++i)
            m_points[i] = m_search.support(i);
        m_normal = Eigen::Vector3d::UnitX();
        if (count == 4)
            return true;
        const Support far = farthestAlongAxes();
        // The size is read after these supports: the points before may be rounding errors around the origin.
        const double flat = kFlat * std::sqrt(m_search.size2());
        if (count == 1)
        {
            if (!((far.w - m_points[0].w).norm() > flat))
                return false;
            m_points[count++] = far;
        }
        if (count == 2)
        {
            const Eigen::Vector3d along = unitOf(m_points[1].w - m_points[0].w);
            const Eigen::Vector3d side = along.unitOrthogonal();
            const Eigen::Vector3d other = along.cross(side);
            m_normal = side;
            if (!addFarthest(count, side, flat) && !addFarthest(count, other, flat))
                return false;
        }
        if (count == 3)
        {
            m_normal = unitOf((m_points[1].w - m_points[0].w).cross(m_points[2].w - m_points[0].w));
            return addFarthest(count, m_normal, flat);
        }
        return true;
    }

    /// Valid once complete() has returned true.
    const std::array<Support, 4>& points() const { return m_points; }
    /// Unit length.
    const Eigen::Vector3d& normal() const { return m_normal; }

private:
    /// Of the support points along the axes, the one farthest from the first point.
    Support farthestAlongAxes()
    {
        Support far = m_points[0];
        for (int axis = 0; axis < 6; ++axis)
        {
            const Eigen::Vector3d direction = Eigen::Vector3d::Unit(axis / 2) * (axis % 2 == 0 ? 1.0 : -1.0);
            const Support s = m_search.supportAgainst(direction);
            if ((s.w - m_points[0].w).squaredNorm() > (far.w - m_points[0].w).squaredNorm())
                far = s;
        }
        return far;
    }

    /// Adds the support point along +direction or -direction, whichever is farther from the points so far, whose
    /// extent along `direction` is 0.
    bool addFarthest(int& count, const Eigen::Vector3d& direction, double flat)
    {
        const Support up = m_search.supportAgainst(-direction);
        const Support down = m_search.supportAgainst(direction);
        const double high = direction.dot(up.w - m_points[0].w);
        const double low = -direction.dot(down.w - m_points[0].w);
        if (!(std::max(high, low) > flat))
            return false;
        m_points[count++] = high > low ? up : down;
        return true;
    }

    Search& m_search;
    std::array<Support, 4> m_points;
    Eigen::Vector3d m_normal;
};
}  // namespace cullet
