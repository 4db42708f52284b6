// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/mesh/mesh_region.h"

#include "cullet/base/simd_vector.h"
#include "cullet/plugin/core/dynamic_type.h"
#include "cullet/plugin/mesh/locked_part.h"

#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btMultimaterialTriangleMeshShape.h>

#include <algorithm>
#include <cstring>
#include <new>

namespace cullet
{
inline namespace CULLET_PRECISION
{
void MeshRegion::find(const btConcaveShape& shape, const btVector3& low, const btVector3& high,
                      std::size_t most)
try
{
    forget();
    if (!isExactly<btBvhTriangleMeshShape>(shape) && !isExactly<btMultimaterialTriangleMeshShape>(shape))
        return;
    const auto& mesh = static_cast<const btBvhTriangleMeshShape&>(shape);
    btOptimizedBvh* const tree = const_cast<btBvhTriangleMeshShape&>(mesh).getOptimizedBvh();
    if (tree == nullptr)
        return;
    m_mesh = mesh.getMeshInterface();
    m_low = low;
    m_high = high;
    m_nodes.emplace(*tree);
    BulletBox box;
    m_nodes->setQuery(low, high, box);
    if (!m_nodes->areReadInOrder() || !addLeaves(box, most))
        return forget();
    makeBlocks();
    makeGroups();
    m_triangles.clear();
    m_triangles.reserve(m_leaves.size());
}
catch (const std::bad_alloc&)
{
    forget();
}

/// @return false if there are more leaves than may be
bool MeshRegion::addLeaves(const BulletBox& box, std::size_t most)
{
    m_leaves.clear();
    for (std::uint32_t node = 0; node < m_nodes->count();)
    {
        const bool isNear = m_nodes->overlaps(box, node), isLeaf = m_nodes->isLeaf(node);
        if (isNear && isLeaf)
        {
            if (m_leaves.size() == most)
                return false;
            m_leaves.push_back(node);
        }
        node += isNear || isLeaf ? 1 : m_nodes->escapeOf(node);
    }
    return true;
}

void MeshRegion::makeBlocks()
{
    m_blocks.clear();
    if (m_nodes->isQuantized())
        m_blocks.resize((m_leaves.size() + kBlock - 1) / kBlock);
    for (std::size_t i = 0; i < m_leaves.size(); ++i)
    {
        BulletBox leaf;
        m_nodes->readBox(m_leaves[i], leaf);
        if (i == 0)
            m_bounds = leaf;
        else
            m_nodes->include(leaf, m_bounds);
        for (std::size_t axis = 0; axis < 3 && m_nodes->isQuantized(); ++axis)
        {
            m_blocks[i / kBlock].min[axis][i % kBlock] = leaf.quantizedMin[axis];
            m_blocks[i / kBlock].max[axis][i % kBlock] = leaf.quantizedMax[axis];
        }
    }
}

void MeshRegion::makeGroups()
{
    m_groups.clear();
    m_groups.resize((m_blocks.size() + kBlock - 1) / kBlock);
    for (std::size_t i = 0; i < m_blocks.size(); ++i)
    {
        const std::size_t count = std::min(m_leaves.size() - i * kBlock, kBlock);
        Block& group = m_groups[i / kBlock];
        for (std::size_t axis = 0; axis < 3; ++axis)
        {
            const auto &min = m_blocks[i].min[axis], &max = m_blocks[i].max[axis];
            group.min[axis][i % kBlock] = *std::min_element(min, min + count);
            group.max[axis][i % kBlock] = *std::max_element(max, max + count);
        }
    }
}

/// Those of the boxes that a box overlaps, a bit for each.
unsigned MeshRegion::Block::near(const BulletBox& box, std::size_t count) const
{
    using Eight = VectorOf<unsigned short, kBlock>::Type;
    MaskOf<Eight> areNear = MaskOf<Eight>{} - 1;
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
        Eight low, high;
        std::memcpy(&low, min[axis], sizeof(low));
        std::memcpy(&high, max[axis], sizeof(high));
        areNear &= (low <= Eight{} + box.quantizedMax[axis]) & (high >= Eight{} + box.quantizedMin[axis]);
    }
    areNear &= MaskOf<Eight>{1, 2, 4, 8, 16, 32, 64, 128};
    std::uint64_t halves[2];
    std::memcpy(halves, &areNear, sizeof(halves));
    std::uint64_t bits = halves[0] | halves[1];
    bits |= bits >> 32;
    bits |= bits >> 16;
    return static_cast<unsigned>(bits) & ((1u << count) - 1);
}

/// Those of the blocks of a group that may have leaves which a box overlaps.
unsigned MeshRegion::nearBlocks(std::size_t group, const BulletBox& box) const
{
    const std::size_t blocks = (m_leaves.size() + kBlock - 1) / kBlock,
                      count = std::min(blocks - group * kBlock, kBlock);
    return m_nodes->isQuantized() ? m_groups[group].near(box, count) : (1u << count) - 1;
}

/// Those of the leaves of a block that a box overlaps.
unsigned MeshRegion::nearLeaves(std::size_t block, const BulletBox& box) const
{
    const std::size_t begin = block * kBlock, count = std::min(m_leaves.size() - begin, kBlock);
    if (m_nodes->isQuantized())
        return m_blocks[block].near(box, count);
    unsigned near = 0;
    for (std::size_t i = 0; i < count; ++i)
        near |= unsigned(m_nodes->overlaps(box, m_leaves[begin + i])) << i;
    return near;
}

void MeshRegion::readTriangles()
{
    LockedPart part(*m_mesh);
    for (const std::uint32_t leaf : m_leaves)
    {
        Triangle triangle;
        triangle.name = m_nodes->nameOf(leaf);
        part.lock(triangle.name.part);
        part.read(triangle.name.index, triangle.corners);
        m_triangles.push_back(triangle);
    }
}

bool MeshRegion::covers(const btVector3& low, const btVector3& high) const
{
    if (!m_nodes)
        return false;
    bool isCovered = true;
    for (int axis = 0; axis < 3; ++axis)
        isCovered &= m_low[axis] <= low[axis] && high[axis] <= m_high[axis];
    return isCovered;
}

/// Calls visit(place of a leaf) for the leaves in a box until it returns true.
///
/// @return whether it did
template <class Visit>
bool MeshRegion::anyLeaf(const btVector3& low, const btVector3& high, const Visit& visit) const
{
    BulletBox box;
    m_nodes->setQuery(low, high, box);
    if (m_leaves.empty() || !m_nodes->overlap(box, m_bounds))
        return false;
    for (std::size_t group = 0; group * kBlock * kBlock < m_leaves.size(); ++group)
    {
        for (unsigned blocks = nearBlocks(group, box); blocks != 0; blocks &= blocks - 1)
        {
            const std::size_t block = group * kBlock + static_cast<std::size_t>(__builtin_ctz(blocks));
            for (unsigned near = nearLeaves(block, box); near != 0; near &= near - 1)
            {
                if (visit(block * kBlock + static_cast<std::size_t>(__builtin_ctz(near))))
                    return true;
            }
        }
    }
    return false;
}

bool MeshRegion::hasTriangles(const btVector3& low, const btVector3& high) const
{
    return anyLeaf(low, high, [](std::size_t) { return true; });
}

void MeshRegion::forEachTriangle(btTriangleCallback& callback, const btVector3& low, const btVector3& high)
{
    if (m_triangles.size() < m_leaves.size())
        readTriangles();
    anyLeaf(low, high,
            [&](std::size_t i)
            {
                // A callback may write to the corners.
                Triangle triangle = m_triangles[i];
                callback.processTriangle(triangle.corners, triangle.name.part, triangle.name.index);
                return false;
            });
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
