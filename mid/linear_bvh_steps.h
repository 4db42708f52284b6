// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/host_device.h"
#include "cullet/mid/mesh_box.h"

#include <cstdint>
#include <limits>

/// The steps of LinearBvh; each is called for every index of a launch, in any order and concurrently, by the CPU or by a
/// GPU.
namespace cullet::linear_bvh
{
/// Inner nodes come first: node i of n - 1, then leaf k of n, in the order of the codes, as node n - 1 + k. Node 0 is the
/// root.
using NodeId = std::uint32_t;

/// The left one's leaves come first: up to the leaf, or inner node, of the left one's own number.
struct alignas(8) Children
{
    NodeId left, right;
};

/// Enough for any tree: a code and a place have 64 and 32 bits, and each level decides one.
inline constexpr int kMostLevels = 97;

inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// kEmptyMeshBox, which a GPU does not read.
CULLET_HOST_DEVICE inline MeshBox noBox()
{
    return {{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
}

CULLET_HOST_DEVICE inline MeshBox around(const MeshBox& a, const MeshBox& b)
{
    MeshBox box;
    for (int axis = 0; axis < 3; ++axis)
    {
        box.min[axis] = b.min[axis] < a.min[axis] ? b.min[axis] : a.min[axis];
        box.max[axis] = a.max[axis] < b.max[axis] ? b.max[axis] : a.max[axis];
    }
    return box;
}

CULLET_HOST_DEVICE inline bool overlap(const MeshBox& a, const MeshBox& b)
{
    return a.min[0] <= b.max[0] && b.min[0] <= a.max[0] && a.min[1] <= b.max[1] && b.min[1] <= a.max[1] &&
           a.min[2] <= b.max[2] && b.min[2] <= a.max[2];
}

/// A box of an array that begins at a multiple of 8 bytes, as those of executors do: a GPU loads it in three parts instead
/// of six.
CULLET_HOST_DEVICE inline MeshBox loadBox(const MeshBox* boxes, std::uint64_t i)
{
    return *static_cast<const MeshBox*>(__builtin_assume_aligned(boxes + i, 8));
}

/// Writes the Morton code of a box's centre: 21 bits an axis.
struct CodeStep
{
    const MeshBox* boxes;
    const MeshBox* bounds;  ///< of the centres; those outside are moved to its surface
    std::uint64_t* codes;
    std::uint32_t* items;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        codes[i] = isValid(boxes[i]) ? codeOf(boxes[i]) : ~std::uint64_t{0};
        items[i] = static_cast<std::uint32_t>(i);
    }

private:
    static constexpr int kBits = 21;

    CULLET_HOST_DEVICE std::uint64_t codeOf(const MeshBox& box) const
    {
        std::uint64_t code = 0;
        for (int axis = 0; axis < 3; ++axis)
        {
            const double low = bounds->min[axis], size = double(bounds->max[axis]) - low;
            const double centre = 0.5 * (double(box.min[axis]) + double(box.max[axis]));
            constexpr double kCells = double(1u << kBits);
            const double place = size > 0.0 ? (centre - low) / size * kCells : 0.0;
            // False for a NaN, of infinite boxes.
            const double cell = place > 0.0 ? (place < kCells - 1.0 ? place : kCells - 1.0) : 0.0;
            code |= spread(static_cast<std::uint64_t>(cell)) << axis;
        }
        return code;
    }

    /// Two zeros before each bit.
    CULLET_HOST_DEVICE static std::uint64_t spread(std::uint64_t bits)
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
    NodeId* parents;     ///< [2 leaves - 1], without the root's

    CULLET_HOST_DEVICE void operator()(std::uint64_t index) const
    {
        const auto i = static_cast<std::int64_t>(index);
        const std::int64_t ahead = common(i, i + 1) > common(i, i - 1) ? 1 : -1;
        const int least = common(i, i - ahead);
        std::int64_t reach = 2;
        while (common(i, i + reach * ahead) > least)
            reach *= 2;
        const std::int64_t length = farthest(i, ahead, reach, least);
        const std::int64_t end = i + length * ahead;
        const std::int64_t split =
            i + farthest(i, ahead, roundedUp(length), common(i, end)) * ahead + (ahead < 0 ? ahead : 0);
        const NodeId left = childAt(split, i < end ? i : end), right = childAt(split + 1, i < end ? end : i);
        const auto node = static_cast<NodeId>(i);
        children[node] = {left, right};
        parents[left] = parents[right] = node;
    }

private:
    /// Equal leading bits of two codes and places; -1 beyond the ends.
    CULLET_HOST_DEVICE int common(std::int64_t i, std::int64_t k) const
    {
        if (k < 0 || k >= leaves)
            return -1;
        const std::uint64_t differing = codes[i] ^ codes[k];
        if (differing != 0)
            return leadingZeros(differing);
        return i == k ? 128 : 64 + leadingZeros(static_cast<std::uint64_t>(i ^ k));
    }

    CULLET_HOST_DEVICE static std::int64_t roundedUp(std::int64_t length)
    {
        std::int64_t power = 2;
        while (power <= length)
            power *= 2;
        return power;
    }

    /// The largest distance, below a power of two, up to which more bits than `least` are common.
    CULLET_HOST_DEVICE std::int64_t farthest(std::int64_t i, std::int64_t ahead, std::int64_t power,
                                             int least) const
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
    CULLET_HOST_DEVICE NodeId childAt(std::int64_t place, std::int64_t end) const
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

    CULLET_HOST_DEVICE void operator()(std::uint64_t place) const
    {
        NodeId node = leaves - 1 + static_cast<NodeId>(place);
        const MeshBox own = loadBox(boxes, items[place]);
        nodeBoxes[node] = isValid(own) ? own : noBox();
        while (node != 0)
        {
            node = parents[node];
            // The second to arrive sees what the first has written.
            if (arriveAt(&arrivals[node]) == 0)
                return;
            const auto [left, right] = children[node];
            nodeBoxes[node] = around(loadBox(nodeBoxes, left), loadBox(nodeBoxes, right));
        }
    }
};

/// A finished tree, for steps that search it.
struct TreeView
{
    const Children* children;
    const MeshBox* nodeBoxes;
    const std::uint32_t* items;  ///< [leaves] numbers of the boxes, by leaf
    std::uint32_t leaves;

    CULLET_HOST_DEVICE MeshBox leafBox(std::uint64_t place) const
    {
        return loadBox(nodeBoxes, leaves - 1 + place);
    }

    /// Calls found(place) for each leaf from a place on whose box overlaps another one.
    ///
    /// @return number of boxes that were tested
    template <class Found>
    CULLET_HOST_DEVICE std::uint64_t search(const MeshBox& query, std::uint32_t from,
                                            const Found& found) const
    {
        NodeId stack[kMostLevels];
        int size = 0;
        std::uint64_t tests = 1;
        if (from < leaves && overlap(query, loadBox(nodeBoxes, 0)))
            stack[size++] = 0;
        // The last leaf of each node on the stack is at the place `from` or after it.
        while (size > 0)
        {
            const NodeId node = stack[--size];
            if (node >= leaves - 1)
            {
                found(node - (leaves - 1));
                continue;
            }
            const auto [left, right] = children[node];
            tests += 2;
            if (overlap(query, loadBox(nodeBoxes, right)))
                stack[size++] = right;
            if (lastOfLeft(left) >= from && overlap(query, loadBox(nodeBoxes, left)))
                stack[size++] = left;
        }
        return tests;
    }

private:
    /// The place of the last leaf of a left child: that of its number.
    CULLET_HOST_DEVICE std::uint32_t lastOfLeft(NodeId left) const
    {
        return left >= leaves - 1 ? left - (leaves - 1) : left;
    }
};

/// Appends a pair (query, item) for each item whose box overlaps that of a query.
struct OverlapStep
{
    const MeshBox* queries;
    TreeView tree;

    template <class Emit>
    CULLET_HOST_DEVICE void operator()(std::uint64_t index, Emit& emit) const
    {
        const auto append = [&](std::uint32_t place) {
            emit.push({static_cast<std::uint32_t>(index), tree.items[place]});
        };
        emit.tested(tree.search(queries[index], 0, append));
    }
};
}  // namespace cullet::linear_bvh
