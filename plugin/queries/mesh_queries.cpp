// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/queries/mesh_queries.h"

#include "cullet/base/bytes_of.h"
#include "cullet/base/threads/parallel_loops.h"
#include "cullet/plugin/core/dynamic_type.h"

#include <BulletCollision/CollisionShapes/btMultimaterialTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexMaterialArray.h>
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
std::atomic<std::uint64_t> lastSerial{0};

/// Bullet's test of a ray and a triangle accepts points outside of the triangle, by 1e-4 of a height: a barycentric
/// coordinate of -1e-4. Two of them, at a corner, are 2e-4 of the triangle's size; the rest is for rounding.
constexpr double kTriangleGrowth = 2.5e-4;

bool isBulletsInterface(const btStridingMeshInterface& mesh)
{
    return isExactly<btTriangleIndexVertexArray>(mesh) || isExactly<btTriangleMesh>(mesh) ||
           isExactly<btTriangleIndexVertexMaterialArray>(mesh);
}

bool isBulletsMesh(const btBvhTriangleMeshShape& shape)
{
    return isExactly<btBvhTriangleMeshShape>(shape) || isExactly<btMultimaterialTriangleMeshShape>(shape);
}

/// Bullet's function is not const, though it changes nothing.
btOptimizedBvh* treeOf(const btBvhTriangleMeshShape& shape)
{
    return const_cast<btBvhTriangleMeshShape&>(shape).getOptimizedBvh();
}
}  // namespace

std::unique_ptr<MeshQueries> MeshQueries::make(const btBvhTriangleMeshShape& shape, int threads)
{
    btOptimizedBvh* const tree = treeOf(shape);
    if (!isBulletsMesh(shape) || tree == nullptr || !isBulletsInterface(*shape.getMeshInterface()))
        return nullptr;
    std::unique_ptr<MeshQueries> made(new MeshQueries(shape, *tree));
    return made->fill(threads) ? std::move(made) : nullptr;
}

MeshQueries::MeshQueries(const btBvhTriangleMeshShape& shape, btOptimizedBvh& tree)
    : m_shape(shape),
      m_serial(lastSerial.fetch_add(1, std::memory_order_relaxed) + 1),
      m_interface(shape.getMeshInterface()),
      m_min(shape.getLocalAabbMin()),
      m_max(shape.getLocalAabbMax()),
      m_nodes(tree),
      m_arrays(*m_interface)
{
}

/// Builds the tree; returns false for a mesh with too many triangles, and if Bullet's tree has others than the mesh.
bool MeshQueries::fill(int threads)
{
    if (!m_arrays.isReadable() || m_arrays.triangleCount() >= UINT32_MAX)
        return false;
    const auto count = static_cast<std::uint32_t>(m_arrays.triangleCount());
    std::vector<MeshBox> boxes(count, kEmptyMeshBox);
    m_nodeOf.assign(count, 0);
    for (std::uint32_t node = 0; node < m_nodes.count(); ++node)
    {
        if (!m_nodes.isLeaf(node))
            continue;
        const TriangleName name = m_nodes.nameOf(node);
        if (!m_arrays.has(name))
            return false;
        Corners corners;
        m_arrays.read(name, corners.data());
        const std::uint32_t item = m_arrays.numberOf(name);
        m_nodeOf[item] = node;
        MeshBox& box = boxes[item];
        box = boxOfTriangle(corners.data(), kTriangleGrowth);
        for (int axis = 0; axis < 3 && isValid(box); ++axis)
            m_largest = std::max<double>(m_largest, std::max(-box.min[axis], box.max[axis]));
    }
    ParallelLoops loops(threads);
    m_tree.build(boxes.data(), count, &loops);
    for (std::size_t sample = 0; sample < kSamples; ++sample)
        m_samples[sample] = sampleAt(sample);
    return true;
}

MeshQueries::Corners MeshQueries::sampleAt(std::size_t sample) const
{
    Corners corners = {};
    if (!m_nodeOf.empty())
        read(static_cast<std::uint32_t>(sample * (m_nodeOf.size() - 1) / (kSamples - 1)), corners.data());
    return corners;
}

bool MeshQueries::isCurrent() const
{
    btOptimizedBvh* const tree = treeOf(m_shape);
    if (!isBulletsMesh(m_shape) || m_shape.getMeshInterface() != m_interface || tree == nullptr ||
        !hasSameBits(m_shape.getLocalAabbMin(), m_min) || !hasSameBits(m_shape.getLocalAabbMax(), m_max) ||
        !(BulletNodes(*tree) == m_nodes) || !isBulletsInterface(*m_interface) ||
        !m_arrays.areThoseOf(*m_interface))
        return false;
    for (std::size_t sample = 0; sample < kSamples; ++sample)
    {
        const Corners corners = sampleAt(sample);
        for (std::size_t corner = 0; corner < corners.size(); ++corner)
        {
            if (!hasSameBits(corners[corner], m_samples[sample][corner]))
                return false;
        }
    }
    return true;
}

bool MeshQueries::findOnPath(const SweptBox& box, double limit, std::vector<MeshCandidate>& found) const
{
    if (!m_tree.findOnPath(box, limit, found))
        return false;
    std::sort(found.begin(), found.end(),
              [this](const MeshCandidate& a, const MeshCandidate& b)
              { return m_nodeOf[a.item] < m_nodeOf[b.item]; });
    return true;
}

std::uint64_t MeshQueries::bytes() const noexcept
{
    return sizeof(*this) + m_tree.bytes() + bytesOf(m_nodeOf) + m_arrays.bytes();
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
