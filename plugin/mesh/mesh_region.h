// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/plugin/mesh/triangle_batch.h"
#include "cullet/plugin/queries/bullet_nodes.h"

#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <BulletCollision/CollisionShapes/btStridingMeshInterface.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The leaves of Bullet's tree over a mesh in a box, found once for many smaller boxes in it: those of the children of a
/// compound. For each of these it answers what forEachTriangle() does, without a search from the root, and reads each
/// triangle once.
///
/// Valid while the mesh stays as it is, so within one call of an algorithm only. Boxes are in the shape's frame.
class MeshRegion
{
public:
    /// Finds the leaves in a box, none for a shape that is not exactly Bullet's mesh with a tree, with materials or without.
    ///
    /// @param most if there are more leaves, or out of memory, the region is forgotten
    /// Cost: a search of the tree that ends after so many leaves
    void find(const btConcaveShape& shape, const btVector3& low, const btVector3& high, std::size_t most);
    void forget() noexcept { m_nodes.reset(); }

    /// Whether the region can answer for a box; false for a NaN.
    bool covers(const btVector3& low, const btVector3& high) const;
    /// Whether forEachTriangle() calls for any triangle.
    ///
    /// @pre covers()
    bool hasTriangles(const btVector3& low, const btVector3& high) const;
    /// The same calls in the same order as forEachTriangle() for the shape.
    ///
    /// @pre covers()
    void forEachTriangle(btTriangleCallback& callback, const btVector3& low, const btVector3& high);

    /// The frame along the axes of a core.
    CoreFrame frameOf(const btTransform& core, const btTransform& mesh)
    {
        return m_lastFrame.frameOf(core, mesh);
    }

private:
    /// Neighbours in the order of the tree lie close together.
    static constexpr std::size_t kBlock = 8;

    struct Triangle
    {
        btVector3 corners[3];
        TriangleName name;
    };

    /// The boxes of kBlock leaves or blocks, coordinate by coordinate.
    struct Block
    {
        unsigned near(const BulletBox& box, std::size_t count) const;

        unsigned short min[3][kBlock], max[3][kBlock];
    };

    bool addLeaves(const BulletBox& box, std::size_t most);
    void makeBlocks();
    void makeGroups();
    unsigned nearBlocks(std::size_t group, const BulletBox& box) const;
    unsigned nearLeaves(std::size_t block, const BulletBox& box) const;
    void readTriangles();
    template <class Visit>
    bool anyLeaf(const btVector3& low, const btVector3& high, const Visit& visit) const;

    const btStridingMeshInterface* m_mesh = nullptr;
    std::optional<BulletNodes> m_nodes;  ///< empty: no region
    btVector3 m_low, m_high;
    std::vector<std::uint32_t> m_leaves;  ///< nodes, in the order of the tree
    BulletBox m_bounds;                   ///< of all leaves
    std::vector<Block> m_blocks;          ///< of leaves, for a quantized tree
    std::vector<Block> m_groups;          ///< of blocks, likewise
    std::vector<Triangle> m_triangles;    ///< of the leaves, once one is asked for
    LastFrame m_lastFrame;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
