// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/mid/mesh_box.h"

#include <algorithm>
#include <cstdint>

/// The steps of LinearBvh; each is called for every index of a launch, in any order and concurrently.
namespace cullet::linear_bvh
{
/// Inner nodes come first: node i of n - 1, then leaf k of n, in the order of the codes, as node n - 1 + k.
using NodeId = std::uint32_t;

inline constexpr NodeId kNoNode = UINT32_MAX;

struct Children
{
    NodeId left, right;
};

/// Writes the Morton code of a box's centre: 21 bits an axis.
struct CodeStep
{
    const MeshBox* boxes;
    MeshBox bounds;  ///< of the centres; those outside are moved to its surface
    std::uint64_t* codes;
    std::uint32_t* items;

    void operator()(std::uint64_t i) const
    {
        codes[i] = isValid(boxes[i]) ? codeOf(boxes[i]) : ~std::uint64_t{0};
        items[i] = static_cast<std::uint32_t>(i);
    }

private:
    static constexpr int kBits = 21;

    std::uint64_t codeOf(const MeshBox& box) const
    {
        std::uint64_t code = 0;
        for (int axis = 0; axis < 3; ++axis)
        {
            const double low = bounds.min[axis], size = double(bounds.max[axis]) - low;
            const double centre = 0.5 * (double(box.min[axis]) + double(box.max[axis]));
            constexpr double kCells = double(1u << kBits);
            const double place = size > 0.0 ? (centre - low) / size * kCells : 0.0;
            // False for a NaN, of infinite boxes.
            const double cell = place > 0.0 ? std::min(place, kCells - 1.0) : 0.0;
            code |= spread(static_cast<std::uint64_t>(cell)) << axis;
        }
        return code;
    }

    /// Two zeros before each bit.
    static std::uint64_t spread(std::uint64_t bits)
    {
        bits = (bits | bits << 32) & 0x1F00000000FFFFu;
        bits = (bits | bits << 16) & 0x1F0000FF0000FFu;
        bits = (bits | bits << 8) & 0x100F00F00F00F00Fu;
        bits = (bits | bits << 4) & 0x10C30C30C30C30C3u;
        return (bits | bits << 2) & 0x1249249249249249u;
    }
};

/// Finds the children of an inner node (Karras 2012, "Maximizing Parallelism in the Construction of BVHs, Octrees, and
/// k-d Trees", figure 4). Items of equal codes are told apart by their places.
struct TreeStep
{
    const std::uint64_t* codes;  ///< [leaves] ascending
    std::int64_t leaves;
    Children* children;  ///< [leaves - 1]
    NodeId* parents;     ///< [2 leaves - 1]

    void operator()(std::uint64_t index) const
    {
        const auto i = static_cast<std::int64_t>(index);
        const std::int64_t ahead = common(i, i + 1) > common(i, i - 1) ? 1 : -1;
        const int least = common(i, i - ahead);
        std::int64_t reach = 2;
        while (common(i, i + reach * ahead) > least)
            reach *= 2;
        const std::int64_t length = farthest(i, ahead, reach, least);
        const std::int64_t end = i + length * ahead;
        const std::int64_t split = i + farthest(i, ahead, roundedUp(length), common(i, end)) * ahead +
                                   std::min<std::int64_t>(ahead, 0);
        const NodeId left = childAt(split, std::min(i, end)), right = childAt(split + 1, std::max(i, end));
        const auto node = static_cast<NodeId>(i);
        children[node] = {left, right};
        parents[left] = parents[right] = node;
        if (node == 0)
            parents[0] = kNoNode;
    }

private:
    /// Equal leading bits of two codes and places; -1 beyond the ends.
    int common(std::int64_t i, std::int64_t k) const
    {
        if (k < 0 || k >= leaves)
            return -1;
        const std::uint64_t differing = codes[i] ^ codes[k];
        if (differing != 0)
            return __builtin_clzll(differing);
        return i == k ? 128 : 64 + __builtin_clzll(static_cast<std::uint64_t>(i ^ k));
    }

    static std::int64_t roundedUp(std::int64_t length)
    {
        std::int64_t power = 2;
        while (power <= length)
            power *= 2;
        return power;
    }

    /// The largest distance, below a power of two, up to which more bits than `least` are common.
    std::int64_t farthest(std::int64_t i, std::int64_t ahead, std::int64_t power, int least) const
    {
        std::int64_t length = 0;
        for (std::int64_t step = power / 2; step > 0; step /= 2)
        {
            if (common(i, i + (length + step) * ahead) > least)
                length += step;
        }
        return length;
    }

    /// A range of one place is a leaf.
    NodeId childAt(std::int64_t place, std::int64_t end) const
    {
        return static_cast<NodeId>(place == end ? leaves - 1 + place : place);
    }
};

/// Sets the box of a leaf, and those of the nodes above whose other child is done.
struct RefitStep
{
    const MeshBox* boxes;
    const std::uint32_t* items;  ///< [leaves]
    std::uint32_t leaves;
    const Children* children;
    const NodeId* parents;
    MeshBox* nodeBoxes;       ///< [2 leaves - 1]
    std::uint32_t* arrivals;  ///< [leaves - 1] zeros

    void operator()(std::uint64_t place) const
    {
        NodeId node = leaves - 1 + static_cast<NodeId>(place);
        const MeshBox& own = boxes[items[place]];
        nodeBoxes[node] = isValid(own) ? own : kEmptyMeshBox;
        while (parents[node] != kNoNode)
        {
            node = parents[node];
            // The second to arrive sees what the first has written.
            if (__atomic_fetch_add(&arrivals[node], 1u, __ATOMIC_ACQ_REL) == 0)
                return;
            nodeBoxes[node] = around(nodeBoxes[children[node].left], nodeBoxes[children[node].right]);
        }
    }

private:
    static MeshBox around(const MeshBox& a, const MeshBox& b)
    {
        MeshBox box;
        for (int axis = 0; axis < 3; ++axis)
        {
            box.min[axis] = std::min(a.min[axis], b.min[axis]);
            box.max[axis] = std::max(a.max[axis], b.max[axis]);
        }
        return box;
    }
};

/// Appends a pair (query, item) for each item whose box overlaps that of a query.
struct OverlapStep
{
    const MeshBox* queries;
    const Children* children;
    const MeshBox* nodeBoxes;
    const std::uint32_t* items;
    std::uint32_t leaves;

    template <class Emit>
    void operator()(std::uint64_t index, Emit& emit) const
    {
        const MeshBox& query = queries[index];
        // A code and a place have 64 and 32 bits, and each level decides one.
        NodeId stack[97];
        int size = 0;
        std::uint64_t tests = 1;
        if (leaves > 0 && overlap(query, nodeBoxes[0]))
            stack[size++] = 0;
        while (size > 0)
        {
            const NodeId node = stack[--size];
            if (node >= leaves - 1)
            {
                emit.push({static_cast<std::uint32_t>(index), items[node - (leaves - 1)]});
                continue;
            }
            tests += 2;
            for (const NodeId child : {children[node].right, children[node].left})
            {
                if (overlap(query, nodeBoxes[child]))
                    stack[size++] = child;
            }
        }
        emit.tested(tests);
    }

private:
    static bool overlap(const MeshBox& a, const MeshBox& b)
    {
        return a.min[0] <= b.max[0] && b.min[0] <= a.max[0] && a.min[1] <= b.max[1] && b.min[1] <= a.max[1] &&
               a.min[2] <= b.max[2] && b.min[2] <= a.max[2];
    }
};
}  // namespace cullet::linear_bvh
