// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/math/debug_containers.h"
#include "cullet/narrow/math/lanes.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace cullet
{
/// Points in a plane.
template <class S>
struct PlanarPoints
{
    /// [paddedCount()] copies of the first point follow the last one.
    const S *x, *y;
    std::int32_t count;

    std::int32_t paddedCount() const
    {
        return (count + Lanes<S>::kWidth - 1) / Lanes<S>::kWidth * Lanes<S>::kWidth;
    }
};

/// The corners of the convex hull of points in a plane, by wrapping it (Jarvis 1973, "On the Identification of the Convex
/// Hull of a Finite Set of Points in the Plane").
///
/// Of many points, only those far from a given centre are wrapped: no other point is outside if no edge comes nearer to
/// the centre. If an edge does, the points beyond its distance are wrapped.
///
/// Rounded. Cost: one product per point and corner, or three per point and one per far point and corner; no allocation.
template <class S>
class PlanarHull
{
public:
    static constexpr std::size_t kMostCorners = 16;

    /// @param centre a point in the hull
    PlanarHull(const PlanarPoints<S>& points, const std::array<S, 2>& centre)
        : m_points(points), m_centre(centre)
    {
        if (points.count < kLeastSelected || !wrapFarPoints())
            wrap(points, nullptr);
    }

    /// Indices of the corners, counter-clockwise; none if there are more than kMostCorners.
    const std::int32_t* begin() const { return m_corners.data(); }
    const std::int32_t* end() const { return m_corners.data() + m_count; }

private:
    using L = Lanes<S>;
    using Vector = typename L::Vector;
    using Mask = typename L::Mask;

    /// For fewer points, to find the far ones costs as much as it saves.
    static constexpr std::int32_t kLeastSelected = 64;
    static constexpr std::int32_t kMostSelected = 64;
    /// The points are dealt into as many sets as there are lanes in four vectors of two; each has a far point.
    static constexpr std::int32_t kVectors = 8 / L::kWidth;

    /// @return false if all points have to be wrapped
    bool wrapFarPoints()
    {
        const S far2 = leastOfFarthest();
        if (!wrapBeyond(far2))
            return false;
        const S near2 = nearestEdge();
        return near2 >= far2 || (near2 > S(0) && wrapBeyond(near2));
    }

    /// Squared distances from the centre.
    Vector distances2(std::int32_t i) const
    {
        const Vector x = L::load(m_points.x + i) - L::fill(m_centre[0]);
        const Vector y = L::load(m_points.y + i) - L::fill(m_centre[1]);
        return x * x + y * y;
    }

    /// The squared distance of the farthest point of each set, the least of them.
    S leastOfFarthest() const
    {
        std::array<Vector, kVectors> farthest = {};
        const std::int32_t end = m_points.count - m_points.count % 8;
        for (std::int32_t i = 0; i < end; i += 8)
        {
            for (std::int32_t k = 0; k < kVectors; ++k)
            {
                const Vector next = distances2(i + k * L::kWidth);
                Vector& most = farthest[static_cast<std::size_t>(k)];
                most = next > most ? next : most;
            }
        }
        Vector least = farthest[0];
        for (const Vector& most : farthest)
            least = most < least ? most : least;
        return -largestLane(-least);
    }

    /// Wraps the points at a distance from the centre.
    ///
    /// @return false if there are too many or too few points or corners
    bool wrapBeyond(S distance2)
    {
        std::array<S, kMostSelected + L::kWidth> x, y;
        std::array<std::int32_t, kMostSelected> ids;
        std::int32_t count = 0;
        for (std::int32_t i = 0; i < m_points.count; i += L::kWidth)
        {
            for (unsigned bits = laneBits(distances2(i) >= L::fill(distance2)); bits != 0; bits &= bits - 1)
            {
                const std::int32_t id = i + __builtin_ctz(bits);
                if (id >= m_points.count)
                    break;
                if (count == kMostSelected)
                    return false;
                const auto place = static_cast<std::size_t>(count++);
                x[place] = m_points.x[id];
                y[place] = m_points.y[id];
                ids[place] = id;
            }
        }
        if (count < 3)
            return false;
        std::fill_n(x.begin() + count, L::kWidth, x[0]);
        std::fill_n(y.begin() + count, L::kWidth, y[0]);
        wrap({x.data(), y.data(), count}, ids.data());
        return m_count > 0;
    }

    /// The squared distance of the nearest edge from the centre; 0 if the centre is outside.
    S nearestEdge() const
    {
        S nearest2 = std::numeric_limits<S>::infinity();
        for (std::size_t i = 0; i < m_count; ++i)
        {
            const std::int32_t from = m_corners[i], to = m_corners[i + 1 < m_count ? i + 1 : 0];
            const S x = m_points.x[to] - m_points.x[from], y = m_points.y[to] - m_points.y[from];
            const S area = x * (m_centre[1] - m_points.y[from]) - y * (m_centre[0] - m_points.x[from]);
            if (!(area > S(0)))
                return S(0);
            nearest2 = std::min(nearest2, area * area / (x * x + y * y));
        }
        return nearest2;
    }

    /// @param ids indices of these points among all points; null: they are all points
    void wrap(const PlanarPoints<S>& points, const std::int32_t* ids)
    {
        m_count = 0;
        const auto first =
            static_cast<std::int32_t>(std::max_element(points.x, points.x + points.count) - points.x);
        std::int32_t from = first, other = first == 0 ? 1 : 0;
        do
        {
            if (from >= points.count || m_count == kMostCorners)
            {
                m_count = 0;
                return;
            }
            m_corners[m_count++] = ids == nullptr ? from : ids[from];
            const std::int32_t next = nextAfter(points, from, other);
            other = first;
            from = next;
        } while (from != first);
    }

    /// The corner after another one: no point is to the right of the way to it.
    ///
    /// @param other any point but the first one
    static std::int32_t nextAfter(const PlanarPoints<S>& points, std::int32_t from, std::int32_t other)
    {
        const Vector x = L::fill(points.x[from]), y = L::fill(points.y[from]);
        Vector bestX = L::fill(points.x[other]) - x, bestY = L::fill(points.y[other]) - y;
        Mask best = Mask{} + other, index = L::counting();
        for (std::int32_t i = 0; i < points.count; i += L::kWidth, index += L::kWidth)
        {
            const Vector wayX = L::load(points.x + i) - x, wayY = L::load(points.y + i) - y;
            const Mask isRight = bestX * wayY < bestY * wayX;
            bestX = isRight ? wayX : bestX;
            bestY = isRight ? wayY : bestY;
            best = isRight ? index : best;
        }
        int lane = 0;
        for (int k = 1; k < L::kWidth; ++k)
            lane = bestX[lane] * bestY[k] < bestY[lane] * bestX[k] ? k : lane;
        return static_cast<std::int32_t>(best[lane]);
    }

    const PlanarPoints<S> m_points;
    const std::array<S, 2> m_centre;
    std::array<std::int32_t, kMostCorners> m_corners;
    std::size_t m_count = 0;
};
}  // namespace cullet
