// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/mid/mesh_tree.h"
#include "cullet/plugin/core/precision.h"
#include "cullet/plugin/queries/bullet_nodes.h"
#include "cullet/plugin/queries/mesh_arrays.h"

#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// A tree over the triangles of a shape, for queries, and what the shape was like when the tree was built.
///
/// The items of the tree are the triangles by their numbers.
class MeshQueries
{
public:
    /// Null for a shape that is left to Bullet; see prepare().
    static std::unique_ptr<MeshQueries> make(const btBvhTriangleMeshShape& shape, int threads);

    const btBvhTriangleMeshShape& shape() const noexcept { return m_shape; }

    /// Not 0, and of no other mesh that the process has prepared or will prepare: addresses are used again.
    std::uint64_t serial() const noexcept { return m_serial; }

    /// Whether the shape is as it was; see prepare().
    bool isCurrent() const;

    const MeshTree& tree() const noexcept { return m_tree; }
    const BulletNodes& nodes() const noexcept { return m_nodes; }

    /// The node of Bullet's tree of an item that the tree holds. Bullet visits nodes in ascending order.
    std::uint32_t nodeOf(std::uint32_t item) const { return m_nodeOf[item]; }

    /// @param corners [out] three corners
    TriangleName read(std::uint32_t item, btVector3* corners) const
    {
        const TriangleName name = m_arrays.nameOf(item);
        m_arrays.read(name, corners);
        return name;
    }

    /// What a swept box may touch, in the order in which Bullet visits it; see MeshTree::findOnPath().
    bool findOnPath(const SweptBox& box, double limit, std::vector<MeshCandidate>& found) const;

    /// Of any corner along any axis, at most.
    double largestCoordinate() const noexcept { return m_largest; }

    std::uint64_t bytes() const noexcept;

private:
    using Corners = std::array<btVector3, 3>;
    static constexpr std::size_t kSamples = 4;

    MeshQueries(const btBvhTriangleMeshShape& shape, btOptimizedBvh& tree);
    bool fill(int threads);
    Corners sampleAt(std::size_t sample) const;

    const btBvhTriangleMeshShape& m_shape;
    const std::uint64_t m_serial;
    const btStridingMeshInterface* m_interface;
    btVector3 m_min, m_max;  ///< the shape's bounds
    BulletNodes m_nodes;
    MeshArrays m_arrays;
    std::vector<std::uint32_t> m_nodeOf;  ///< by item
    std::array<Corners, kSamples> m_samples;
    MeshTree m_tree;
    double m_largest = 0.0;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
