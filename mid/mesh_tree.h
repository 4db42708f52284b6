// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/mid/mesh_kernels.h"
#include "cullet/mid/swept_box.h"

#include <cstdint>
#include <vector>

namespace cullet
{
class ParallelLoops;

/// Eight-wide tree over the boxes of a mesh's triangles. It stores boxes and numbers, no vertices: the caller reads a
/// candidate's vertices from the application's arrays and tests them.
///
/// Items are numbered by the caller, and queries report them in ascending order, or by the place where a swept box
/// meets them: the answers do not depend on how the tree is built. Items with empty boxes are never found.
///
/// Memory: 28 to 32 bytes per item, for large meshes. One thread at a time may build or refit the tree; any number of
/// threads may query it while no thread does.
class MeshTree
{
public:
    explicit MeshTree(const MeshKernels& kernels = meshKernels(false)) : m_kernels(&kernels) {}
    MeshTree(const MeshTree&) = delete;
    MeshTree& operator=(const MeshTree&) = delete;

    /// Replaces the tree. O(n log n).
    ///
    /// @param boxes [count] by item
    /// @param count below 2^32 - 1
    /// @param loops null: one thread; the tree is the same, bit for bit, for any number of threads
    /// Errors: std::bad_alloc, after which the tree is empty.
    void build(const MeshBox* boxes, std::uint32_t count, ParallelLoops* loops);

    /// Replaces the boxes of all items and leaves the order: right for any boxes, slower the farther they have moved.
    /// An item whose box was empty when the tree was built is left out. O(n).
    ///
    /// @param boxes [count] as for build()
    void refit(const MeshBox* boxes, ParallelLoops* loops);

    /// Appends the items whose boxes overlap a box, ascending.
    void findOverlaps(const MeshBox& box, std::vector<std::uint32_t>& items) const;

    /// Appends the items that a swept box may touch, ascending: all whose boxes it touches, and few others.
    ///
    /// @param limit share of the segment to search
    /// @return false, and no item, if the box is not finite or too large (see SweptBox::prepare())
    bool findOnPath(const SweptBox& box, double limit, std::vector<MeshCandidate>& found) const;

    /// Calls limit = test(candidate) for the items that a swept box may touch, nearer nodes first.
    ///
    /// @param limit share of the segment to search
    /// @param test  returns the share of the segment up to which to go on: items that are entered at a larger one are
    ///              left out
    /// @return false, without a call, if the box is not finite or too large (see SweptBox::prepare())
    template <class Test>
    bool visitByEntry(const SweptBox& box, double limit, const Test& test) const
    {
        SweptQuery query;
        if (!box.prepare(query))
            return false;
        query.limit = sweptLimit(limit);
        MeshWalk walk;
        walk.start(m_view);
        MeshCandidate found[8];
        while (const std::uint32_t count = m_kernels->nearestLeaf(m_view, query, walk, found))
        {
            for (std::uint32_t i = 0; i < count; ++i)
            {
                if (found[i].enter <= query.limit)
                    query.limit = sweptLimit(test(found[i]));
            }
        }
        return true;
    }

    const MeshTreeView& view() const noexcept { return m_view; }
    std::uint64_t bytes() const noexcept;

private:
    void layOut();
    void fill(const MeshBox* boxes, ParallelLoops& loops);
    void fillLeaf(std::uint32_t leaf, const MeshBox* boxes) noexcept;
    void setBounds(int level, std::uint32_t index, const MeshBox& box) noexcept;
    WideNode& node(int level, std::uint32_t index) noexcept { return m_nodes[m_levelStart[level] + index]; }
    std::uint32_t nodeCount(int level) const noexcept
    {
        return m_levelStart[level + 1] - m_levelStart[level];
    }

    const MeshKernels* m_kernels;
    std::vector<WideNode> m_nodes;  // leaves first, the root last
    std::vector<std::uint32_t> m_items;
    std::uint32_t m_levelStart[kMaxWideLevels + 1] = {};
    MeshTreeView m_view = {};  // points into the two vectors
};
}  // namespace cullet
