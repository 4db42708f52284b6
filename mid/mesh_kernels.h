// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/trees/wide_node.h"
#include "cullet/mid/mesh_box.h"

#include <cstdint>

namespace cullet
{
/// A box that moves along a segment, prepared for conservative slab tests in float; made by SweptBox::prepare().
///
/// A child is a candidate when, with the near and far plane of every axis chosen by the sign of `inverse`,
/// max((near - nearOrigin) * inverse) <= limit, min((far - farOrigin) * inverse) >= 0 and max(near) <= min(far).
struct SweptQuery
{
    float nearOrigin[3];
    float farOrigin[3];
    float inverse[3];
    float limit;  ///< share of the segment; the caller may lower it between the calls of a kernel
};

/// A complete tree of eight-lane nodes: child i of node n is node 8 n + i of the level below.
struct MeshTreeView
{
    const WideNode* levels[kMaxWideLevels];  ///< [0] holds the leaves, whose lanes are items
    int levelCount;
    const std::uint32_t* items;  ///< [8 * leaves] the item in each lane of a leaf
};

/// Position of a traversal: nodes that are still to be visited, the next one last.
struct MeshWalk
{
    struct Entry
    {
        std::uint32_t node;
        int level;
        float enter;  ///< lower bound of the share of the segment at which the query enters the node
    };

    // Each level leaves seven children behind the one that is visited.
    Entry stack[7 * kMaxWideLevels + 1];
    int size;

    void start(const MeshTreeView& tree) noexcept
    {
        size = tree.levelCount == 0 ? 0 : 1;
        stack[0] = {0, tree.levelCount - 1, 0.0f};
    }
};

/// An item that a swept box may touch.
struct MeshCandidate
{
    std::uint32_t item;
    float enter;  ///< see MeshWalk::Entry
};

/// Corners of eight triangles, one lane each.
struct alignas(32) TriangleBlock
{
    float corners[3][3][8];  ///< [corner][axis][lane]
};

/// Items that one call of a kernel may write.
inline constexpr std::uint32_t kMeshBatch = 64;

/// The inner loops of the queries for one instruction set. All sets give the same items in the same order.
///
/// Each call continues the walk, writes at most kMeshBatch items and returns their number; zero means that the walk is
/// over. Nothing is allocated and nothing shared is written, so calls may run concurrently and nested.
struct MeshKernels
{
    std::uint32_t (*overlaps)(const MeshTreeView&, const MeshBox&, MeshWalk&, std::uint32_t* items);
    std::uint32_t (*onPath)(const MeshTreeView&, const SweptQuery&, MeshWalk&, MeshCandidate* found);
    /// The candidates of one leaf, by entry: nearer nodes come first, and none that lies beyond the limit.
    std::uint32_t (*nearestLeaf)(const MeshTreeView&, const SweptQuery&, MeshWalk&, MeshCandidate* found);
    /// See trianglesApart().
    std::uint32_t (*apart)(const TriangleBlock&, const float (&)[3][3]);
};

extern const MeshKernels kMeshKernelsBaseline;
/// Equal to the baseline where the compiler has no AVX2.
extern const MeshKernels kMeshKernelsAvx2;

/// The fastest kernels that this machine runs, or the baseline ones.
const MeshKernels& meshKernels(bool baselineSimd) noexcept;
}  // namespace cullet
