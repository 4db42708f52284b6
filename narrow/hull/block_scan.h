// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/hull/linear_scan.h"
#include "cullet/narrow/hull/point_blocks.h"

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

/// Scans of the points of a hull that has PointBlocks; support.h defines what all searches return.
///
/// The highest product within a box is that of one of its corners. Rounded sums and products keep the order of what is
/// rounded, so the rounded product of that corner is an upper bound of those of the block's points, without allowance.
namespace cullet
{
/// A scan along one direction. Cost: a product for every block, and for every point of the blocks that are high enough.
template <class S>
class BlockScan
{
public:
    BlockScan(const PointBlocks<S>& blocks, const Eigen::Matrix<S, 3, 1>& direction)
        : m_blocks(blocks), m_lanes(direction)
    {
        for (int axis = 0; axis < 3; ++axis)
            m_ends[axis] = direction[axis] >= S(0) ? blocks.high(axis) : blocks.low(axis);
    }

    /// The lowest id among the points with the largest product; id 0 where products are NaN.
    std::int32_t highest()
    {
        S best = -std::numeric_limits<S>::infinity();
        std::int32_t id = std::numeric_limits<std::int32_t>::max();
        raise(highestBox(), best, id);
        forEachBlock(best, [&](std::int32_t block) { return raise(block, best, id), true; });
        return id == std::numeric_limits<std::int32_t>::max() ? 0 : id;
    }

    /// Whether visit(id) is true for all points with a product of at least `low`, in unspecified order; stops where it
    /// is false. The last point of the last block may be visited several times.
    template <class Visit>
    bool allAbove(S low, const Visit& visit)
    {
        const Vector level = L::fill(low);
        return forEachBlock(low, [&](std::int32_t block) { return allAbove(block, level, visit); });
    }

    /// Blocks whose points were tested.
    std::int64_t blockTotal() const { return m_blockTotal; }

private:
    using L = Lanes<S>;
    using Vector = typename L::Vector;
    static constexpr std::int32_t kSize = PointBlocks<S>::kSize;

    Vector boundsOf(std::int32_t first) const
    {
        return L::load(m_ends[0] + first) * m_lanes.x + L::load(m_ends[1] + first) * m_lanes.y +
               L::load(m_ends[2] + first) * m_lanes.z;
    }

    Vector productsOf(std::int32_t block, std::int32_t first) const
    {
        return L::load(m_blocks.points(0, block) + first) * m_lanes.x +
               L::load(m_blocks.points(1, block) + first) * m_lanes.y +
               L::load(m_blocks.points(2, block) + first) * m_lanes.z;
    }

    /// A block whose box is highest.
    std::int32_t highestBox() const
    {
        Vector best = boundsOf(0);
        typename L::Mask where = {}, index = {};
        for (std::int32_t first = L::kWidth; first < m_blocks.boxCount(); first += L::kWidth)
        {
            index += L::kWidth;
            const Vector bounds = boundsOf(first);
            const typename L::Mask isHigher = bounds > best;
            best = isHigher ? bounds : best;
            where = isHigher ? index : where;
        }
        const unsigned bits = laneBits(best == L::fill(largestLane(best)));
        const int lane = bits == 0 ? 0 : __builtin_ctz(bits);
        return std::min(static_cast<std::int32_t>(where[lane]) + lane, m_blocks.blockCount() - 1);
    }

    /// Calls visit(block) for the blocks that may have a product of at least `low`, which visit() may raise, until it
    /// returns false.
    template <class Visit>
    bool forEachBlock(const S& low, const Visit& visit)
    {
        for (std::int32_t first = 0; first < m_blocks.blockCount(); first += L::kWidth)
        {
            const Vector bounds = boundsOf(first);
            for (unsigned bits = laneBits(bounds >= L::fill(low)); bits != 0; bits &= bits - 1)
            {
                const std::int32_t block = first + __builtin_ctz(bits);
                if (block < m_blocks.blockCount() && !visit(block))
                    return false;
            }
        }
        return true;
    }

    void raise(std::int32_t block, S& best, std::int32_t& id)
    {
        ++m_blockTotal;
        Vector highest = productsOf(block, 0);
        for (std::int32_t i = L::kWidth; i < kSize; i += L::kWidth)
        {
            const Vector products = productsOf(block, i);
            highest = products > highest ? products : highest;
        }
        const S height = largestLane(highest);
        if (!(height >= best))
            return;
        id = height > best ? std::numeric_limits<std::int32_t>::max() : id;
        best = height;
        const Vector level = L::fill(height);
        for (std::int32_t i = 0; i < kSize; i += L::kWidth)
        {
            for (unsigned bits = laneBits(productsOf(block, i) == level); bits != 0; bits &= bits - 1)
                id = std::min(id, m_blocks.ids(block)[i + __builtin_ctz(bits)]);
        }
    }

    template <class Visit>
    bool allAbove(std::int32_t block, const Vector& level, const Visit& visit)
    {
        ++m_blockTotal;
        for (std::int32_t i = 0; i < kSize; i += L::kWidth)
        {
            for (unsigned bits = laneBits(productsOf(block, i) >= level); bits != 0; bits &= bits - 1)
            {
                if (!visit(m_blocks.ids(block)[i + __builtin_ctz(bits)]))
                    return false;
            }
        }
        return true;
    }

    const PointBlocks<S>& m_blocks;
    LaneDirection<S> m_lanes;
    std::array<const S*, 3> m_ends;  ///< of the boxes, along the direction
    std::int64_t m_blockTotal = 0;
};

/// Whether visit(id) is true for all points that may be higher along a direction than a vertex, or lower by less than a
/// slope times their distance from it. Products are rounded, hence some lower points are visited, too.
///
/// @param depth below the vertex, within which all points are visited
/// @pre the hull has PointBlocks
template <class S, class Visit>
bool allOfHighPoints(const Hull<S>& hull, std::int32_t vertex, const Eigen::Vector3d& direction, double slope,
                     double depth, const Visit& visit)
{
    using Vector = Eigen::Matrix<S, 3, 1>;
    const double largest = direction.cwiseAbs().maxCoeff(), scale = largest > 0.0 ? 1.0 / largest : 1.0;
    const Vector d = (direction * scale).template cast<S>();
    // No two points are farther apart than twice the radius. The rounded direction and its rounded products with both
    // points are off by 6 eps R |d| in all.
    const double allowance = (16.0 * double(std::numeric_limits<S>::epsilon()) + 4.0 * slope) *
                                 double(hull.reach()) * double(d.template lpNorm<1>()) +
                             depth * scale;
    const S low = static_cast<S>(double(supportProduct(hull, vertex, d)) - 2.0 * allowance);
    return BlockScan<S>(hull.pointBlocks(), d).allAbove(low, visit);
}

/// Whether visit(neighbour) is true for all neighbours of a vertex; of a hull without a graph, for all vertices, or for
/// those of allOfHighPoints().
template <class S, class Visit>
bool allOfNeighbours(const Hull<S>& hull, std::int32_t vertex, const Eigen::Vector3d& direction, double slope,
                     double depth, const Visit& visit)
{
    if (hull.hasNeighbours())
    {
        const typename Hull<S>::Span neighbours = hull.naturalNeighbours(vertex);
        return std::all_of(neighbours.begin(), neighbours.end(), visit);
    }
    if (!hull.pointBlocks().isEmpty())
        return allOfHighPoints(hull, vertex, direction, slope, depth, visit);
    for (std::int32_t i = 0; i < hull.vertexCount(); ++i)
    {
        if (!visit(i))
            return false;
    }
    return true;
}
}  // namespace cullet
