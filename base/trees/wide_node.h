// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <algorithm>
#include <cfloat>
#include <cstdint>

namespace cullet
{
/// A node of a tree of wideTreeOrder(): the boxes of eight children or items. An empty lane has minima above its maxima.
struct alignas(64) WideNode
{
    float planes[6][8];  ///< [0..2] minima, [3..5] maxima
};

/// Levels of a tree, enough for 2^32 items.
inline constexpr int kMaxWideLevels = 11;

/// Finds where each level of a tree begins among its nodes, leaves first, the root last.
///
/// @param starts [out, kMaxWideLevels + 1] for each level, and then the number of all nodes
/// @return number of levels
inline int layOutLevels(std::uint32_t leaves, std::uint32_t* starts) noexcept
{
    int levels = 0;
    std::uint32_t start = 0;
    for (std::uint32_t count = leaves; count > 0; count = count == 1 ? 0 : (count + 7) / 8)
    {
        starts[levels++] = start;
        start += count;
    }
    starts[levels] = start;
    return levels;
}

template <class Box>
void setLane(WideNode& node, std::uint32_t lane, const Box& box) noexcept
{
    for (int axis = 0; axis < 3; ++axis)
    {
        node.planes[axis][lane] = box.min[axis];
        node.planes[axis + 3][lane] = box.max[axis];
    }
}

/// A node with the same box in all lanes.
template <class Box>
WideNode nodeOf(const Box& box) noexcept
{
    WideNode node;
    for (std::uint32_t lane = 0; lane < 8; ++lane)
        setLane(node, lane, box);
    return node;
}

template <class Box>
Box boundsOfLanes(const WideNode& node) noexcept
{
    Box box;
    for (int axis = 0; axis < 3; ++axis)
    {
        box.min[axis] = *std::min_element(node.planes[axis], node.planes[axis] + 8);
        box.max[axis] = *std::max_element(node.planes[axis + 3], node.planes[axis + 3] + 8);
    }
    return box;
}

/// The box without infinities, which the limits of empty lanes would equal.
template <class Box>
Box finitePart(const Box& box) noexcept
{
    Box part;
    for (int axis = 0; axis < 3; ++axis)
    {
        part.min[axis] = std::max(box.min[axis], -FLT_MAX);
        part.max[axis] = std::min(box.max[axis], FLT_MAX);
    }
    return part;
}
}  // namespace cullet
