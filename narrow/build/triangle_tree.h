// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/narrow/build/quickhull.h"
#include "cullet/narrow/math/debug_containers.h"
#include "cullet/narrow/math/simplex.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

namespace cullet
{
/// Distance between a point and a triangle. Computed from the weights of the corners, so that for a sliver, whose
/// normal is mostly rounding, it may be too large but never too small.
inline double distanceToTriangle(const std::vector<Eigen::Vector3d>& points,
                                 const std::array<std::int32_t, 3>& triangle, const Eigen::Vector3d& point)
{
    SimplexPoints corners;
    for (int k = 0; k < 3; ++k)
        corners[k] = points[triangle[k]] - point;
    ClosestOnSimplex best = nothingOnSimplex(corners, 3);
    considerSegment(corners, 0, 1, best);
    considerSegment(corners, 1, 2, best);
    considerSegment(corners, 2, 0, best);
    const double edge = best.point.norm();
    best.length2 = std::numeric_limits<double>::infinity();
    if (!considerInside(corners, 0, 1, 2, best))
        return edge;
    const std::array<double, 4> w = simplexWeights(corners, best.subset);
    return std::min(edge, (w[0] * corners[0] + w[1] * corners[1] + w[2] * corners[2]).norm());
}

/// Finds the triangles of a closed convex surface that are within a distance of a point: a tree of boxes, and the
/// planes of the triangles. Cost: O(t log t) to build, usually O(log t + found) per search; see testCount().
class TriangleTree
{
public:
    /// @param depth the distance, at least 16 spacings of doubles at the farthest coordinate
    TriangleTree(const std::vector<Eigen::Vector3d>& points,
                 const std::vector<Quickhull::Triangle>& triangles, double depth)
        : m_points(points), m_triangles(triangles), m_depth(depth), m_order(triangles.size())
    {
        m_normals.reserve(triangles.size());
        for (const Quickhull::Triangle& t : triangles)
            m_normals.push_back(scaledNormal(points, t));
        std::iota(m_order.begin(), m_order.end(), 0);
        m_nodes.reserve(triangles.size());
        m_nodes.emplace_back();
        build(0, 0, static_cast<std::int32_t>(m_order.size()));
    }

    /// scaledNormal() by triangle, outward.
    const std::vector<Eigen::Vector3d>& normals() const { return m_normals; }

    /// Boxes and triangles that were compared with a point.
    std::uint64_t testCount() const { return m_testCount; }

    /// Calls found(triangle, distance) for all triangles that are not farther away than the depth, in unspecified
    /// order.
    template <class Found>
    void forEachNear(const Eigen::Vector3d& point, const Found& found)
    {
        m_stack.assign(1, 0);
        while (!m_stack.empty())
        {
            const Node& node = m_nodes[m_stack.back()];
            m_stack.pop_back();
            ++m_testCount;
            if (!node.box.contains(point))
                continue;
            if (node.child >= 0)
            {
                m_stack.push_back(node.child);
                m_stack.push_back(node.child + 1);
                continue;
            }
            for (std::int32_t i = node.begin; i < node.end; ++i)
                visit(m_order[i], point, found);
        }
    }

    bool isAnyNear(const Eigen::Vector3d& point)
    {
        bool isAny = false;
        forEachNear(point, [&isAny](std::int32_t, double) { isAny = true; });
        return isAny;
    }

private:
    using Box = Eigen::AlignedBox3d;

    struct Node
    {
        Box box;                  ///< grown
        std::int32_t child = -1;  ///< the first of two, or none
        std::int32_t begin = 0, end = 0;
    };

    static constexpr std::int32_t kLeaf = 4;
    /// Times the depth: what is farther away than this is farther away after rounding, too.
    static constexpr double kAllowance = 8.0;

    void build(std::int32_t index, std::int32_t begin, std::int32_t end)
    {
        Box box, middles;
        for (std::int32_t i = begin; i < end; ++i)
        {
            const Box ofTriangle = boxOf(m_order[i]);
            box.extend(ofTriangle);
            middles.extend(ofTriangle.center());
        }
        m_nodes[index].box =
            Box(box.min().array() - kAllowance * m_depth, box.max().array() + kAllowance * m_depth);
        m_nodes[index].begin = begin;
        m_nodes[index].end = end;
        if (end - begin <= kLeaf)
            return;
        Eigen::Index axis;
        middles.sizes().maxCoeff(&axis);
        const std::int32_t middle = begin + (end - begin) / 2;
        std::nth_element(m_order.begin() + begin, m_order.begin() + middle, m_order.begin() + end,
                         [this, axis](std::int32_t l, std::int32_t r)
                         { return boxOf(l).center()[axis] < boxOf(r).center()[axis]; });
        const std::int32_t child = static_cast<std::int32_t>(m_nodes.size());
        m_nodes[index].child = child;
        m_nodes.resize(m_nodes.size() + 2);
        build(child, begin, middle);
        build(child + 1, middle, end);
    }

    Box boxOf(std::int32_t triangle) const
    {
        Box box;
        for (const std::int32_t vertex : m_triangles[triangle].vertex)
            box.extend(m_points[vertex]);
        return box;
    }

    template <class Found>
    void visit(std::int32_t triangle, const Eigen::Vector3d& point, const Found& found)
    {
        ++m_testCount;
        const std::array<std::int32_t, 3>& vertex = m_triangles[triangle].vertex;
        const Eigen::Vector3d& normal = m_normals[triangle];
        const Eigen::Vector3d from = point - m_points[vertex[0]];
        // The normal is off by 64 spacings at most.
        const double allowance = kAllowance * m_depth + 1e-13 * from.lpNorm<1>();
        if (std::abs(normal.dot(from)) > allowance * normal.lpNorm<1>())
            return;
        const double distance = distanceToTriangle(m_points, vertex, point);
        if (distance <= m_depth)
            found(triangle, distance);
    }

    const std::vector<Eigen::Vector3d>& m_points;
    const std::vector<Quickhull::Triangle>& m_triangles;
    double m_depth;
    std::vector<Eigen::Vector3d> m_normals;
    std::vector<std::int32_t> m_order;  ///< triangles
    std::vector<Node> m_nodes;
    std::vector<std::int32_t> m_stack;
    std::uint64_t m_testCount = 0;
};
}  // namespace cullet
