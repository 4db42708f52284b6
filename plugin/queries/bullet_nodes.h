// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/core/precision.h"
#include "cullet/plugin/queries/mesh_arrays.h"

#include <BulletCollision/CollisionShapes/btOptimizedBvh.h>
#include <LinearMath/btAabbUtil2.h>

#include <algorithm>
#include <cstdint>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// A box in Bullet's tree; of the two kinds of coordinates those of the tree.
struct BulletBox
{
    btVector3 min, max;
    unsigned short quantizedMin[3] = {}, quantizedMax[3] = {};
};

/// The nodes of Bullet's tree over a mesh. Bullet visits the leaves in the order of the array.
class BulletNodes
{
    /// Names the members of a base class that it keeps from others.
    struct Access : btOptimizedBvh
    {
        static auto count() { return &Access::m_curNodeIndex; }
        static auto nodes() { return &Access::m_contiguousNodes; }
        static auto traversal() { return &Access::m_traversalMode; }
    };

public:
    explicit BulletNodes(btOptimizedBvh& tree) : m_tree(&tree), m_isQuantized(tree.isQuantized())
    {
        if (m_isQuantized)
            m_nodes = quantized();
        else
            m_nodes = plain();
        m_count = static_cast<std::uint32_t>(tree.*Access::count());
    }

    std::uint32_t count() const noexcept { return m_count; }
    bool isQuantized() const noexcept { return m_isQuantized; }

    bool isLeaf(std::uint32_t node) const
    {
        return m_isQuantized ? quantized()[node].isLeafNode() : plain()[node].m_escapeIndex == -1;
    }

    /// Whether Bullet reads the nodes in the order of the array, and leaves out what is below a node that a box misses.
    bool areReadInOrder() const
    {
        return m_tree->*Access::traversal() == btQuantizedBvh::TRAVERSAL_STACKLESS;
    }

    /// The number of nodes from one to the next that is not below it.
    ///
    /// @pre not isLeaf(node)
    std::uint32_t escapeOf(std::uint32_t node) const
    {
        return static_cast<std::uint32_t>(m_isQuantized ? quantized()[node].getEscapeIndex()
                                                        : plain()[node].m_escapeIndex);
    }

    /// @pre isLeaf(node)
    TriangleName nameOf(std::uint32_t node) const
    {
        if (m_isQuantized)
            return {quantized()[node].getPartId(), quantized()[node].getTriangleIndex()};
        return {plain()[node].m_subPart, plain()[node].m_triangleIndex};
    }

    void readBox(std::uint32_t node, BulletBox& box) const
    {
        if (!m_isQuantized)
        {
            box.min = plain()[node].m_aabbMinOrg;
            box.max = plain()[node].m_aabbMaxOrg;
            return;
        }
        const btQuantizedBvhNode& read = quantized()[node];
        for (int axis = 0; axis < 3; ++axis)
        {
            box.quantizedMin[axis] = read.m_quantizedAabbMin[axis];
            box.quantizedMax[axis] = read.m_quantizedAabbMax[axis];
        }
        box.min = m_tree->unQuantize(read.m_quantizedAabbMin);
        box.max = m_tree->unQuantize(read.m_quantizedAabbMax);
    }

    /// Makes a box larger, so that it contains another one.
    void include(const BulletBox& other, BulletBox& box) const
    {
        box.min.setMin(other.min);
        box.max.setMax(other.max);
        for (int axis = 0; axis < 3 && m_isQuantized; ++axis)
        {
            box.quantizedMin[axis] = std::min(box.quantizedMin[axis], other.quantizedMin[axis]);
            box.quantizedMax[axis] = std::max(box.quantizedMax[axis], other.quantizedMax[axis]);
        }
    }

    /// The box of a query, as Bullet compares it with nodes.
    void setQuery(const btVector3& min, const btVector3& max, BulletBox& box) const
    {
        box.min = min;
        box.max = max;
        if (!m_isQuantized)
            return;
        m_tree->quantizeWithClamp(box.quantizedMin, min, 0);
        m_tree->quantizeWithClamp(box.quantizedMax, max, 1);
    }

    bool overlap(const BulletBox& query, const BulletBox& node) const
    {
        if (m_isQuantized)
            return testQuantizedAabbAgainstQuantizedAabb(query.quantizedMin, query.quantizedMax,
                                                         node.quantizedMin, node.quantizedMax) != 0;
        return TestAabbAgainstAabb2(query.min, query.max, node.min, node.max);
    }

    bool overlaps(const BulletBox& query, std::uint32_t node) const
    {
        if (!m_isQuantized)
            return TestAabbAgainstAabb2(query.min, query.max, plain()[node].m_aabbMinOrg,
                                        plain()[node].m_aabbMaxOrg);
        const btQuantizedBvhNode& read = quantized()[node];
        return testQuantizedAabbAgainstQuantizedAabb(query.quantizedMin, query.quantizedMax,
                                                     read.m_quantizedAabbMin, read.m_quantizedAabbMax) != 0;
    }

    friend bool operator==(const BulletNodes& a, const BulletNodes& b)
    {
        return a.m_tree == b.m_tree && a.m_isQuantized == b.m_isQuantized && a.m_nodes == b.m_nodes &&
               a.m_count == b.m_count;
    }

private:
    const btOptimizedBvhNode* plain() const
    {
        const auto& nodes = m_tree->*Access::nodes();
        return nodes.size() > 0 ? &nodes[0] : nullptr;
    }
    const btQuantizedBvhNode* quantized() const
    {
        const auto& nodes = m_tree->getQuantizedNodeArray();
        return nodes.size() > 0 ? &nodes[0] : nullptr;
    }

    btOptimizedBvh* m_tree;
    bool m_isQuantized;
    const void* m_nodes;
    std::uint32_t m_count;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
