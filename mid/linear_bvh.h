// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/mid/linear_bvh_steps.h"

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
/// @tparam Exec psap::HostExec, or another with its Buffer, reserve(), upload(), clear(), forEach(), forEachAppend() and
///              sortPairs(). It has to live as long as the tree.
template <class Exec>
class LinearBvh
{
public:
    explicit LinearBvh(Exec& exec) : m_exec(exec) {}
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
        using namespace linear_bvh;
        m_leaves = 0;
        reserve(count);
        if (count == 0)
            return;
        m_exec.upload(m_boxes.data(), boxes, count);
        m_exec.forEach(count, CodeStep{m_boxes.data(), bounds, m_codes.data(), m_unsorted.data()});
        m_exec.sortPairs(m_codes.data(), m_sortedCodes.data(), m_unsorted.data(), m_items.data(), count, 64);
        if (count == 1)
            m_exec.upload(m_parents.data(), &linear_bvh::kNoNode, 1);
        m_exec.forEach(count - 1, TreeStep{m_sortedCodes.data(), std::int64_t(count), m_children.data(),
                                           m_parents.data()});
        m_leaves = count;
        fit();
    }

    /// Replaces the boxes of all items and leaves the tree: right for any boxes, slower the farther they have moved. O(n).
    ///
    /// @param boxes [as many as build() got]
    void refit(const MeshBox* boxes)
    {
        m_exec.upload(m_boxes.data(), boxes, m_leaves);
        fit();
    }

    /// Appends a pair (query, item) to a list of the executor for each item whose box overlaps that of a query; closed boxes.
    ///
    /// @param queries [count] in memory that steps may read
    template <class List>
    void findOverlaps(const MeshBox* queries, std::uint32_t count, const List& list)
    {
        m_exec.forEachAppend(
            count,
            linear_bvh::OverlapStep{queries, m_children.data(), m_nodeBoxes.data(), m_items.data(), m_leaves},
            list);
    }

    std::uint32_t size() const noexcept { return m_leaves; }
    /// [2 size() - 1] in the executor's memory; see linear_bvh::NodeId.
    const MeshBox* nodeBoxes() const noexcept { return m_nodeBoxes.data(); }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    void reserve(std::uint32_t count)
    {
        m_exec.reserve(m_boxes, count);
        m_exec.reserve(m_codes, count);
        m_exec.reserve(m_sortedCodes, count);
        m_exec.reserve(m_unsorted, count);
        m_exec.reserve(m_items, count);
        m_exec.reserve(m_children, count);
        m_exec.reserve(m_arrivals, count);
        m_exec.reserve(m_parents, 2 * std::uint64_t(count));
        m_exec.reserve(m_nodeBoxes, 2 * std::uint64_t(count));
    }

    void fit()
    {
        if (m_leaves == 0)
            return;
        m_exec.clear(m_arrivals.data(), m_leaves);
        m_exec.forEach(m_leaves,
                       linear_bvh::RefitStep{m_boxes.data(), m_items.data(), m_leaves, m_children.data(),
                                             m_parents.data(), m_nodeBoxes.data(), m_arrivals.data()});
    }

    Exec& m_exec;
    std::uint32_t m_leaves = 0;
    Buffer<MeshBox> m_boxes, m_nodeBoxes;
    Buffer<std::uint64_t> m_codes, m_sortedCodes;
    Buffer<std::uint32_t> m_unsorted, m_items, m_arrivals;
    Buffer<linear_bvh::Children> m_children;
    Buffer<linear_bvh::NodeId> m_parents;
};
}  // namespace cullet
