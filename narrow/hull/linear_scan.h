// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/hull.h"
#include "cullet/narrow/hull/linear_scan_avx2.h"
#include "cullet/narrow/math/lanes.h"

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cstdint>

/// Scans of all vertices of a hull; support.h defines what all searches return.
namespace cullet
{
template <class S>
inline S supportProduct(const Hull<S>& hull, std::int32_t v, const Eigen::Matrix<S, 3, 1>& d)
{
    // Reads one cache line.
    const S* const p = hull.lanes(v);
    return p[0] * d[0] + p[1] * d[1] + p[2] * d[2];
}

/// The support vertex, by a scan of all vertices. Cost: O(n).
template <class S>
std::int32_t supportLinear(const Hull<S>& hull, const Eigen::Matrix<S, 3, 1>& d)
{
    using L = Lanes<S>;
    using Vector = typename L::Vector;
    // Two accumulators of lanes. A lane stores its maximum and the index of the vector where it first occurred.
    const Vector dx = L::fill(d[0]), dy = L::fill(d[1]), dz = L::fill(d[2]);
    const auto product = [&](std::int32_t i)
    { return L::load(hull.x() + i) * dx + L::load(hull.y() + i) * dy + L::load(hull.z() + i) * dz; };
    Vector best0 = product(0), best1 = product(L::kWidth);
    using Mask = typename L::Mask;
    Mask where0 = {}, where1 = {};
    Mask index = {};
    for (std::int32_t i = 2 * L::kWidth; i < hull.paddedCount(); i += 2 * L::kWidth)
    {
        index += 1;
        const Vector s0 = product(i), s1 = product(i + L::kWidth);
        const Mask m0 = s0 > best0, m1 = s1 > best1;
        best0 = m0 ? s0 : best0;
        best1 = m1 ? s1 : best1;
        where0 = m0 ? index : where0;
        where1 = m1 ? index : where1;
    }
    // Lowest vertex among the lanes that have the maximum; none if the maximum is NaN.
    const Vector best = L::fill(largestLane(best0 > best1 ? best0 : best1));
    const Mask vertex0 = best0 == best ? where0 * (2 * L::kWidth) + L::counting() : L::largest();
    const Mask vertex1 = best1 == best ? where1 * (2 * L::kWidth) + L::counting() + L::kWidth : L::largest();
    const auto bestIndex = smallestLane(vertex0 < vertex1 ? vertex0 : vertex1);
    return bestIndex < hull.vertexCount() ? static_cast<std::int32_t>(bestIndex) : 0;
}

/// A direction with each component in all lanes.
template <class S>
struct LaneDirection
{
    explicit LaneDirection(const Eigen::Matrix<S, 3, 1>& d)
        : x(Lanes<S>::fill(d[0])), y(Lanes<S>::fill(d[1])), z(Lanes<S>::fill(d[2]))
    {
    }
    /// From the first three lanes.
    explicit LaneDirection(const typename Quad<S>::Vector& d)
        : x(Quad<S>::template spread<0>(d)),
          y(Quad<S>::template spread<1>(d)),
          z(Quad<S>::template spread<2>(d))
    {
    }
    typename Lanes<S>::Vector x, y, z;
};

/// Bit i: the product of a direction and vertex begin + i is not below a number; also where it is a NaN. Padding has the
/// bit of vertex 0.
///
/// @param begin multiple of 64
template <class S>
std::uint64_t bitsOfHigh(const Hull<S>& hull, const Eigen::Matrix<S, 3, 1>& direction, S low,
                         std::int32_t begin)
{
    using L = Lanes<S>;
#ifdef __SSE2__
    if (kHasAvx2)
        return bitsOfHighAvx2(hull, direction.data(), low, begin);
#endif
    const LaneDirection<S> d(direction);
    const S *const x = hull.x() + begin, *const y = hull.y() + begin, *const z = hull.z() + begin;
    const std::int32_t count = std::min(hull.paddedCount() - begin, 64);
    std::uint64_t below = 0;
    for (std::int32_t i = 0; i < count; i += L::kWidth)
    {
        const auto products = L::load(x + i) * d.x + L::load(y + i) * d.y + L::load(z + i) * d.z;
        below |= std::uint64_t(laneBits(products < L::fill(low))) << i;
    }
    return ~below;
}

/// Whether visit(vertex) is true for all vertices but some whose product with a direction is not below that of one vertex
/// by more than `drop`; a NaN is not.
///
/// @param but vertices that are not visited; any other numbers
/// Cost: O(n) without a branch, and the visits.
template <class S, class Visit>
bool isTrueNear(const Hull<S>& hull, const Eigen::Matrix<S, 3, 1>& direction, std::int32_t from, S drop,
                const std::array<std::int32_t, 3>& but, const Visit& visit)
{
    const S low = supportProduct(hull, from, direction) - drop;
    for (std::int32_t begin = 0; begin < hull.vertexCount(); begin += 64)
    {
        std::uint64_t high = bitsOfHigh(hull, direction, low, begin);
        if (hull.vertexCount() - begin < 64)
            high &= (std::uint64_t(1) << (hull.vertexCount() - begin)) - 1;
        for (const std::int32_t vertex : but)
            high &= ~(std::uint64_t((vertex ^ begin) >> 6 == 0) << (vertex & 63));
        for (; high != 0; high &= high - 1)
        {
            if (!visit(begin + __builtin_ctzll(high)))
                return false;
        }
    }
    return true;
}

/// The largest product of a direction and a vertex, without the vertex and without a branch. Cost: O(n).
template <class S>
[[gnu::always_inline]] inline S largestProduct(const Hull<S>& hull, const LaneDirection<S>& d)
{
    using L = Lanes<S>;
    using Vector = typename L::Vector;
    const S *x = hull.x(), *y = hull.y(), *z = hull.z();
    const auto product = [&](std::int32_t i) __attribute__((always_inline))
    {
        return L::load(x + i) * d.x + L::load(y + i) * d.y + L::load(z + i) * d.z;
    };
    const Vector first = product(0), second = product(L::kWidth);
    Vector best = first > second ? first : second;
    for (std::int32_t i = 2 * L::kWidth; i < hull.vertexCount(); i += L::kWidth)
    {
        const Vector next = product(i);
        best = best > next ? best : next;
    }
    return largestLane(best);
}
}  // namespace cullet
