// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/mid/linear_bvh_steps.h"

#include <algorithm>
#include <cstdint>

namespace cullet
{
/// Binary tree over the boxes of a mesh that deforms: build, refit and search are sequences of steps that an executor runs,
/// as those of the psap backend are (Karras 2012; the thesis names Lauterbach 2009). MeshTree is the tree for meshes that
/// stay; this one is made anew, or refitted, in every step.
///
/// Tree and boxes are the same bits for any executor, order and number of threads, and so is the set of pairs; their order is not.
/// Items with empty boxes are never found.
///
/// @tparam Exec psap::HostExec, psap::CudaExec, or another with its Buffer, reserve(), upload(), clear(), forEach(),
///              forEachAppend() and sortPairs()
template <class Exec>
class LinearBvh
{
public:
    /// @param exec has to live as long as the tree, and not to move
    explicit LinearBvh(Exec& exec) : m_exec(&exec) {}
    LinearBvh(const LinearBvh&) = delete;
    LinearBvh& operator=(const LinearBvh&) = delete;

    /// Replaces the tree. O(n).
    ///
    /// @param boxes  [count] by item, in the CPU's memory
    /// @param count  below 2^31
    /// @param bounds around the centres; a tree of others finds the same pairs, more slowly
    /// Errors: what the executor's reserve() throws; the tree is then empty.
    void build(const MeshBox* boxes, std::uint32_t count, const MeshBox& bounds)
    {
        MeshBox* const to = reserveBoxes(count);
        m_exec->uploadAndWait(to, boxes, count);
        m_exec->uploadAndWait(m_bounds.data(), &bounds, 1);
        buildFromBoxes(m_bounds.data());
    }

    /// Empties the tree and makes room for the boxes of buildFromBoxes().
    ///
    /// @return [count] the executor's memory
    MeshBox* reserveBoxes(std::uint32_t count)
    {
        m_leaves = 0;
        reserve(count);
        m_items = count;
        return m_boxes.data();
    }

    /// Replaces the tree. @pre the boxes of reserveBoxes() are written before its steps run
    ///
    /// @param bounds as for build(), in the executor's memory
    void buildFromBoxes(const MeshBox* bounds)
    {
        using namespace linear_bvh;
        if (m_items == 0)
            return;
        m_exec->forEach(m_items, CodeStep{m_boxes.data(), bounds, m_codes.data(), m_unsorted.data()});
        m_exec->sortPairs(m_codes.data(), m_sortedCodes.data(), m_unsorted.data(), m_sorted.data(), m_items,
                          64);
        m_exec->forEach(m_items - 1, TreeStep{m_sortedCodes.data(), std::int64_t(m_items), m_children.data(),
                                              m_parents.data()});
        m_leaves = m_items;
        refitToBoxes();
    }

    /// Replaces the boxes of all items and leaves the tree: right for any boxes, slower the farther they have moved. O(n).
    ///
    /// @param boxes [as many as build() got]
    void refit(const MeshBox* boxes)
    {
        m_exec->uploadAndWait(m_boxes.data(), boxes, m_leaves);
        refitToBoxes();
    }

    /// refit() to boxes that are in boxes() when its steps run.
    void refitToBoxes()
    {
        if (m_leaves == 0)
            return;
        m_exec->clear(m_arrivals.data(), m_leaves);
        m_exec->forEach(m_leaves,
                        linear_bvh::RefitStep{m_boxes.data(), m_sorted.data(), m_leaves, m_children.data(),
                                              m_parents.data(), m_nodeBoxes.data(), m_arrivals.data()});
    }

    /// Appends a pair (query, item) to a list of the executor for each item whose box overlaps that of a query; closed boxes.
    ///
    /// @param queries [count] in memory that steps may read
    template <class List>
    void findOverlaps(const MeshBox* queries, std::uint32_t count, const List& list)
    {
        m_exec->forEachAppend(count, linear_bvh::OverlapStep{queries, view()}, list);
    }

    /// Empties the tree, also after a failure.
    void forget() { m_leaves = 0; }

    std::uint32_t size() const noexcept { return m_leaves; }
    /// [size()] in the executor's memory, by item.
    MeshBox* boxes() const noexcept { return m_boxes.data(); }
    /// [2 size() - 1] in the executor's memory; see linear_bvh::NodeId.
    const MeshBox* nodeBoxes() const noexcept { return m_nodeBoxes.data(); }
    /// In the executor's memory, for steps.
    linear_bvh::TreeView view() const noexcept
    {
        return {m_children.data(), m_nodeBoxes.data(), m_sorted.data(), m_leaves};
    }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    void reserve(std::uint32_t count)
    {
        const std::uint64_t room = std::max<std::uint64_t>(count, 1);
        m_exec->reserve(m_bounds, 1);
        m_exec->reserve(m_boxes, room);
        m_exec->reserve(m_codes, room);
        m_exec->reserve(m_sortedCodes, room);
        m_exec->reserve(m_unsorted, room);
        m_exec->reserve(m_sorted, room);
        m_exec->reserve(m_children, room);
        m_exec->reserve(m_arrivals, room);
        m_exec->reserve(m_parents, 2 * room);
        m_exec->reserve(m_nodeBoxes, 2 * room);
    }

    Exec* m_exec;
    std::uint32_t m_leaves = 0;  ///< of the tree
    std::uint32_t m_items = 0;   ///< of reserveBoxes()
    Buffer<MeshBox> m_bounds, m_boxes, m_nodeBoxes;
    Buffer<std::uint64_t> m_codes, m_sortedCodes;
    Buffer<std::uint32_t> m_unsorted, m_sorted;  ///< items
    Buffer<std::uint32_t> m_arrivals;
    Buffer<linear_bvh::Children> m_children;
    Buffer<linear_bvh::NodeId> m_parents;
};
}  // namespace cullet
