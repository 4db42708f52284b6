// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/posed_hull.h"

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
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
    [[gnu::always_inline]] Eigen::Vector3d point(std::int32_t vertex) const
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
    /// Whether all vertices may be compared: the hull has few.
    bool isScanned() const { return hull().vertexCount() <= kMostScanned; }
    /// The vertex that is farthest along a direction, compared in double; the first of several. @pre isScanned()
    std::int32_t scanSupport(const Eigen::Vector3d& direction) const
    {
        Heights heights;
        measure(basis.transpose() * direction, heights);
        const std::int32_t count = hull().vertexCount();
        std::int32_t best = 0;
        for (std::int32_t i = 1; i < count; ++i)
            best = heights[std::size_t(i)] > heights[std::size_t(best)] ? i : best;
        return best;
    }
    /// The number of vertices that are at least so high along a direction in the axes of the hull. @pre isScanned()
    std::int32_t countAbove(const Eigen::Vector3d& local, double height) const
    {
        Heights heights;
        measure(local, heights);
        std::int32_t count = 0;
        for (std::int32_t i = 0; i < hull().vertexCount(); ++i)
            count += heights[std::size_t(i)] >= height ? 1 : 0;
        return count;
    }
    /// A height larger than the rounding of a direction and of products in the hull's scalar, and than that of a slope
    /// from any vertex to any other.
    S clearHeight(double slope) const
    {
        const S rounding = shape.tieBand() + S(8) * std::numeric_limits<S>::epsilon() * shape.size();
        return std::max(rounding, static_cast<S>(2.0 * slope) * shape.size());
    }

private:
    using Heights = std::array<double, kMostScanned>;

    /// In a loop of its own, which compilers compute several vertices at a time.
    void measure(const Eigen::Vector3d& local, Heights& heights) const
    {
        const double alongX = local[0], alongY = local[1], alongZ = local[2];
        const S *const x = hull().x(), *const y = hull().y(), *const z = hull().z();
        const auto count = std::size_t(hull().vertexCount());
        // Compilers cannot prove that a hull has a vertex.
        heights[0] = 0.0;
        for (std::size_t i = 0; i < count; ++i)
            heights[i] = alongX * double(x[i]) + alongY * double(y[i]) + alongZ * double(z[i]);
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
