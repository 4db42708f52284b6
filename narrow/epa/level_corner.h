// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/gjk/gjk_search.h"
#include "cullet/narrow/gjk/gjk_types.h"
#include "cullet/narrow/hull/posed_hull.h"

#include <Eigen/Core>

#include <array>
#include <cmath>
#include <cstdint>

namespace cullet
{
/// The ends of the edges at a support vertex that are most perpendicular to the direction, which are likely corners of
/// the face there. Up to three, the most level first. Cost: one pass over the neighbours of the vertex.
class LevelNeighbours
{
public:
    static constexpr int kMaxCount = 3;

    /// @param vertex    of a hull that has a graph
    /// @param direction world axes, any length; the vertex is the support along it
    template <class S>
    LevelNeighbours(const PosedHull<S>& shape, std::int32_t vertex, const Eigen::Vector3d& direction)
    {
        const Hull<S>& hull = shape.hull();
        const Eigen::Vector3d local = shape.basis().transpose() * direction;
        const Eigen::Vector3d corner = hull.vertex(vertex).template cast<double>();
        for (const std::int32_t neighbour : hull.naturalNeighbours(vertex))
        {
            const Eigen::Vector3d edge = corner - hull.vertex(neighbour).template cast<double>();
            const double fall = local.dot(edge);
            // The square keeps the sign of the fall, which rounding may flip.
            insert({fall * std::abs(fall) / edge.squaredNorm(), neighbour});
        }
    }

    int count() const { return m_count; }
    std::int32_t operator[](int i) const { return m_ends[static_cast<std::size_t>(i)].vertex; }

private:
    struct End
    {
        double slope2;  ///< squared, with the sign of the slope
        std::int32_t vertex;
    };

    /// Inserts an end before all steeper ones; drops the steepest if there are too many.
    void insert(const End& end)
    {
        int place = m_count;
        m_count += m_count < kMaxCount ? 1 : 0;
        for (; place > 0 && end.slope2 < at(place - 1).slope2; --place)
            at(place) = at(place - 1);
        at(place) = end;
    }
    End& at(int i) { return m_ends[static_cast<std::size_t>(i)]; }

    int m_count = 0;
    std::array<End, kMaxCount + 1> m_ends = {};
};

/// A corner of A - B and the ends of its most level edges: the support point along the cached axis, else along the line
/// between the centres. Where shapes have just begun to overlap, the face of the least depth is likely at that corner.
template <class Search>
struct LevelCorner
{
    static constexpr int kMaxCount = 1 + 2 * LevelNeighbours::kMaxCount;

    /// @param search of A and B
    template <class S, class H>
    LevelCorner(const PosedHull<H>& a, const PosedHull<H>& b, const GjkCache<S>& cache, Search& search)
    {
        Eigen::Vector3d axis(cache.axis[0], cache.axis[1], cache.axis[2]);
        if (axis.isZero(0.0))
            axis = search.centreDifference();
        const auto corner = search.supportAgainst(axis, known(cache.startA, a), known(cache.startB, b));
        points[0] = corner;
        count = 1;
        const LevelNeighbours ofA(a, corner.vertexA, -axis), ofB(b, corner.vertexB, axis);
        for (int i = 0; i < ofA.count(); ++i)
            points[static_cast<std::size_t>(count++)] = search.supportOf(ofA[i], corner.vertexB);
        for (int i = 0; i < ofB.count(); ++i)
            points[static_cast<std::size_t>(count++)] = search.supportOf(corner.vertexA, ofB[i]);
    }

    std::array<typename Search::Support, kMaxCount> points;
    int count;

private:
    template <class H>
    static std::int32_t known(std::uint16_t vertex, const PosedHull<H>& shape)
    {
        return vertex < shape.vertexCount() ? vertex : -1;
    }
};
}  // namespace cullet
