// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/posed_hull.h"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace cullet
{
/// A hull with its basis in double. Points are relative to its origin.
template <class S>
struct FeatureSide
{
    static constexpr std::int32_t kMostScanned = 64;

    const PosedHull<S>& shape;
    Eigen::Matrix3d basis;

    const Hull<S>& hull() const { return shape.hull(); }
    /// No point is farther from the origin. Exact for a triangle, on which the third axis of the basis has no influence.
    double reach() const
    {
        if (hull().kind() != HullKind::Polygon || hull().vertexCount() > 3)
            return double(shape.size());
        return std::sqrt(std::max(point(1).squaredNorm(), point(2).squaredNorm()));
    }
    Eigen::Vector3d point(std::int32_t vertex) const
    {
        const S* const v = hull().lanes(vertex);
        return basis.col(0) * double(v[0]) + basis.col(1) * double(v[1]) + basis.col(2) * double(v[2]);
    }
    /// The corner from which the plane of a face is computed. The corners of a triangle are in another order while the
    /// hull has no graph.
    static std::int32_t firstOf(const typename Hull<S>::Span& corners)
    {
        const bool isTriangle = corners.size() == 3;
        return isTriangle ? std::int32_t(std::min_element(corners.begin(), corners.end()) - corners.begin())
                          : 0;
    }
    /// In the axes of the hull.
    Eigen::Vector3d localPoint(std::int32_t vertex) const
    {
        const S* const v = hull().lanes(vertex);
        return {double(v[0]), double(v[1]), double(v[2])};
    }
    /// Whether scanSupport() may be called: the hull has few vertices.
    bool isScanned() const { return hull().vertexCount() <= kMostScanned; }
    /// The vertex that is farthest along a direction, compared in double; the first of several.
    std::int32_t scanSupport(const Eigen::Vector3d& direction) const
    {
        const Eigen::Vector3d local = basis.transpose() * direction;
        const S *const x = hull().x(), *const y = hull().y(), *const z = hull().z();
        const std::int32_t count = hull().vertexCount();
        std::int32_t best = 0;
        double highest = -std::numeric_limits<double>::infinity();
        for (std::int32_t i = 0; i < count; ++i)
        {
            const double height = local[0] * double(x[i]) + local[1] * double(y[i]) + local[2] * double(z[i]);
            best = height > highest ? i : best;
            highest = std::max(height, highest);
        }
        return best;
    }
    /// A height larger than the rounding of a direction and of products in the hull's scalar, and than that of a slope
    /// from any vertex to any other.
    S clearHeight(double slope) const
    {
        const S rounding = shape.tieBand() + S(8) * std::numeric_limits<S>::epsilon() * shape.size();
        return std::max(rounding, static_cast<S>(2.0 * slope) * shape.size());
    }
};

/// Whether a vertex of a hull is behind another one along a direction, by a slope at least.
template <class S>
class StrictlyBehind
{
public:
    StrictlyBehind(const FeatureSide<S>& side, const Eigen::Vector3d& direction, double slope)
        : m_side(side),
          m_local(side.basis.transpose() * direction),
          // The norm bounds lengths in the world: along some directions a basis may flatten the hull to nothing.
          m_slope(slope * double(side.shape.norm()))
    {
    }

    /// @param from the other vertex, in the axes of the hull
    bool operator()(std::int32_t vertex, const Eigen::Vector3d& from) const
    {
        const Eigen::Vector3d way = m_side.localPoint(vertex) - from;
        const double rise = m_local.dot(way);
        return rise < 0.0 && rise * rise > m_slope * m_slope * way.squaredNorm();
    }

    /// In the axes of the hull; of any length, also zero.
    const Eigen::Vector3d& direction() const { return m_local; }
    /// How far a vertex is behind another one at most along direction() if it is not strictly behind.
    double longestFall() const { return 2.0 * m_slope * m_side.hull().radius(); }

private:
    const FeatureSide<S>& m_side;
    const Eigen::Vector3d m_local;
    const double m_slope;
};
}  // namespace cullet
