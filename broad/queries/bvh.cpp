// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/queries/bvh.h"

#include "cullet/base/trees/wide_tree_order.h"

#include <algorithm>
#include <cmath>

namespace cullet
{
namespace
{
/// @param inner valid or kEmptyAabb, which nothing contains
bool contains(const Aabb& outer, const Aabb& inner) noexcept
{
    return inner.min[0] <= inner.max[0] && inner.min[0] >= outer.min[0] && inner.min[1] >= outer.min[1] &&
           inner.min[2] >= outer.min[2] && inner.max[0] <= outer.max[0] && inner.max[1] <= outer.max[1] &&
           inner.max[2] <= outer.max[2];
}

double halfArea(const Aabb& box) noexcept
{
    const double x = static_cast<double>(box.max[0]) - box.min[0];
    const double y = static_cast<double>(box.max[1]) - box.min[1];
    const double z = static_cast<double>(box.max[2]) - box.min[2];
    return x >= 0.0 ? x * y + y * z + z * x : 0.0;
}

Aabb laneBox(const WideNode& node, std::uint32_t lane) noexcept
{
    return {{node.planes[0][lane], node.planes[1][lane], node.planes[2][lane]},
            {node.planes[3][lane], node.planes[4][lane], node.planes[5][lane]}};
}
}  // namespace

/// Prefetches the boxes of a later leaf: neighbours in space are far apart in the table. Inlined, since GCC drops calls
/// that do nothing but prefetch.
[[gnu::always_inline]] inline void Bvh::prefetch(std::uint32_t leaf, const Aabb* boxes) const noexcept
{
    constexpr std::uint32_t kAhead = 32;  // slots
    for (std::uint32_t slot = 8 * leaf + kAhead; slot < std::min(8 * leaf + kAhead + 8, slotCount()); ++slot)
    {
        if (m_rows[slot] != kNoRow)
            __builtin_prefetch(boxes + m_rows[slot]);
    }
}

void Bvh::build(const Aabb* boxes, const std::vector<ProxyId>& rows)
{
    static_assert(sizeof(Aabb) == sizeof(float[6]) && kEmptySlot == kNoRow, "the same planes and marks");
    const BoxesToOrder toOrder = {reinterpret_cast<const float(*)[6]>(boxes), rows.data(), rows.size()};
    const std::vector<std::uint32_t> order = wideTreeOrder(toOrder, nullptr);
    layOut(static_cast<std::uint32_t>(order.size()));
    std::copy(order.begin(), order.end(), m_rows.begin());
    m_rowCount = static_cast<std::uint32_t>(rows.size());
    m_leafArea = 0.0;
    for (std::uint32_t leaf = 0; leaf < slotCount() / 8; ++leaf)
    {
        Aabb around;
        prefetch(leaf, boxes);
        fillLanes(leaf, boxes, around);
        closeLeaf(leaf, around);
    }
    refitInner();
    m_leafAreaAtBuild = m_leafArea;
    m_meanLeafSize =
        order.empty() ? 0.0f : static_cast<float>(std::sqrt(m_leafArea / (3.0 * (slotCount() / 8))));
}

void Bvh::layOut(std::uint32_t slots)
{
    m_levelCount = layOutLevels(slots / 8, m_levelStart);
    m_nodes.assign(m_levelStart[m_levelCount], nodeOf(kEmptyAabb));
    m_rootBounds = kEmptyAabb;
    m_rows.assign(slots, kNoRow);
    for (int level = 0; level < m_levelCount; ++level)
        m_view.levels[level] = m_nodes.data() + m_levelStart[level];
    m_view.levelCount = m_levelCount;
    m_view.rows = m_rows.data();
}

/// Reads the boxes of a leaf's rows into its lanes; returns true if all of its rows have valid boxes.
bool Bvh::fillLanes(std::uint32_t leaf, const Aabb* boxes, Aabb& around)
{
    const Aabb* lanes[8];
    std::uint32_t held = 0;
    for (std::uint32_t lane = 0; lane < 8; ++lane)
    {
        const ProxyId row = m_rows[8 * leaf + lane];
        lanes[lane] = row == kNoRow ? &kEmptyAabb : boxes + row;
        held |= (row == kNoRow ? 0u : 1u) << lane;
    }
    return m_kernels.fillNode(lanes, node(0, leaf), around) == held;
}

void Bvh::closeLeaf(std::uint32_t leaf, const Aabb& around) noexcept
{
    m_leafArea += halfArea(around);
    setBounds(0, leaf, around);
}

/// Removes the rows whose boxes do not fit from a leaf.
void Bvh::removeUnfitRows(std::uint32_t leaf, const Aabb* boxes, std::vector<ProxyId>& left)
{
    const Aabb limits = limitsOf(leaf);
    for (std::uint32_t slot = 8 * leaf; slot < 8 * leaf + 8; ++slot)
    {
        ProxyId& row = m_rows[slot];
        if (row == kNoRow || contains(limits, boxes[row]))
            continue;
        left.push_back(row);
        row = kNoRow;
        --m_rowCount;
    }
}

Aabb Bvh::bounds(int level, std::uint32_t index) const noexcept
{
    if (level + 1 == m_levelCount)
        return m_rootBounds;
    return laneBox(m_nodes[m_levelStart[level + 1] + index / 8], index % 8);
}

bool Bvh::setBounds(int level, std::uint32_t index, const Aabb& box) noexcept
{
    if (level + 1 == m_levelCount)
    {
        m_rootBounds = box;
        return false;
    }
    WideNode& parent = node(level + 1, index / 8);
    if (laneBox(parent, index % 8) == box)
        return false;
    setLane(parent, index % 8, box);
    return true;
}

/// An empty leaf has limits that contain nothing.
Aabb Bvh::limitsOf(std::uint32_t leaf) const noexcept
{
    Aabb limits = bounds(0, leaf);
    for (int axis = 0; axis < 3; ++axis)
    {
        const float allowance = limits.max[axis] - limits.min[axis] + m_meanLeafSize;
        limits.min[axis] = std::max(limits.min[axis] - allowance, -kMaxTreeCoordinate);
        limits.max[axis] = std::min(limits.max[axis] + allowance, kMaxTreeCoordinate);
    }
    return limits;
}

bool Bvh::fits(std::uint32_t slot, const Aabb& box) const noexcept
{
    return contains(limitsOf(slot / 8), box);
}

bool Bvh::holds(std::uint32_t slot, const Aabb& box) const noexcept
{
    const Aabb stored = laneBox(m_nodes[slot / 8], slot % 8);
    bool isFilled = true;
    for (int axis = 0; axis < 3; ++axis)
        isFilled &= stored.max[axis] - stored.min[axis] <= 2.0f * (box.max[axis] - box.min[axis]);
    return isFilled && contains(stored, box);
}

void Bvh::move(std::uint32_t slot, const Aabb& box) noexcept
{
    std::uint32_t index = slot / 8;
    setLane(node(0, index), slot % 8, box);
    m_leafArea -= halfArea(bounds(0, index));
    m_leafArea += halfArea(boundsOfLanes<Aabb>(node(0, index)));
    for (int level = 0; setBounds(level, index, boundsOfLanes<Aabb>(node(level, index))); ++level)
        index /= 8;
}

void Bvh::remove(std::uint32_t slot) noexcept
{
    m_rows[slot] = kNoRow;
    --m_rowCount;
    move(slot, kEmptyAabb);
}

void Bvh::refit(const Aabb* boxes, std::vector<ProxyId>& left)
{
    m_leafArea = 0.0;
    for (std::uint32_t leaf = 0; leaf < slotCount() / 8; ++leaf)
    {
        prefetch(leaf, boxes);
        Aabb around;
        // Nearly always the leaf fits as a whole, and with it each of its rows.
        if (!fillLanes(leaf, boxes, around) || !contains(limitsOf(leaf), around))
        {
            removeUnfitRows(leaf, boxes, left);
            fillLanes(leaf, boxes, around);
        }
        closeLeaf(leaf, around);
    }
    refitInner();
}

void Bvh::refitInner() noexcept
{
    for (int level = 1; level < m_levelCount; ++level)
    {
        const std::uint32_t count = m_levelStart[level + 1] - m_levelStart[level];
        for (std::uint32_t index = 0; index < count; ++index)
            setBounds(level, index, boundsOfLanes<Aabb>(node(level, index)));
    }
}

std::uint64_t Bvh::bytes() const noexcept
{
    return m_nodes.capacity() * sizeof(WideNode) + m_rows.capacity() * sizeof(ProxyId);
}
}  // namespace cullet
