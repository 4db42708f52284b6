// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/plugin/pair_sync/ghost_boxes.h"

#include <algorithm>

namespace cullet
{
namespace
{
void enclose(Aabb& bounds, const Aabb& box) noexcept
{
    for (int axis = 0; axis < 3; ++axis)
    {
        bounds.min[axis] = std::min(bounds.min[axis], box.min[axis]);
        bounds.max[axis] = std::max(bounds.max[axis], box.max[axis]);
    }
}
}  // namespace

std::uint32_t GhostBoxes::overlapMask(const Block& block, const Aabb& box) noexcept
{
    std::uint32_t mask = 0;
    for (std::uint32_t lane = 0; lane < kLanes; ++lane)
    {
        // Bitwise & avoids branches, so that the compiler vectorises the eight lanes.
        const bool isHit = (block.min[0][lane] <= box.max[0]) & (box.min[0] <= block.max[0][lane]) &
                           (block.min[1][lane] <= box.max[1]) & (box.min[1] <= block.max[1][lane]) &
                           (block.min[2][lane] <= box.max[2]) & (box.min[2] <= block.max[2][lane]);
        mask |= static_cast<std::uint32_t>(isHit) << lane;
    }
    return mask;
}

Aabb GhostBoxes::boxAt(const Block& block, std::uint32_t lane) noexcept
{
    return {{block.min[0][lane], block.min[1][lane], block.min[2][lane]},
            {block.max[0][lane], block.max[1][lane], block.max[2][lane]}};
}

void GhostBoxes::put(std::uint32_t slot, std::uint32_t row, const Aabb& box) noexcept
{
    Block& block = m_blocks[slot / kLanes];
    const std::uint32_t lane = slot % kLanes;
    for (int axis = 0; axis < 3; ++axis)
    {
        block.min[axis][lane] = box.min[axis];
        block.max[axis][lane] = box.max[axis];
    }
    block.rows[lane] = row;
    enclose(block.bounds, box);
    enclose(m_bounds, box);
}

void GhostBoxes::insert(std::uint32_t row, const Aabb& box)
{
    if (m_slots.size() <= row)
        m_slots.resize(row + 1 + row / 2, kNone);
    if (m_size % kLanes == 0 && m_size / kLanes == m_blocks.size())
    {
        Block block = {};
        block.bounds = kEmptyAabb;
        m_blocks.push_back(block);
        for (std::uint32_t lane = 0; lane < kLanes; ++lane)
            put(m_size + lane, kNone, kEmptyAabb);
    }
    m_slots[row] = m_size;
    put(m_size, row, box);
    ++m_size;
}

void GhostBoxes::set(std::uint32_t row, const Aabb& box) noexcept
{
    put(m_slots[row], row, box);
}

void GhostBoxes::erase(std::uint32_t row) noexcept
{
    const std::uint32_t hole = m_slots[row];
    const std::uint32_t last = --m_size;
    m_slots[row] = kNone;
    if (hole != last)
    {
        const Block& block = m_blocks[last / kLanes];
        const std::uint32_t mover = block.rows[last % kLanes];
        put(hole, mover, boxAt(block, last % kLanes));
        m_slots[mover] = hole;
    }
    put(last, kNone, kEmptyAabb);
}

void GhostBoxes::tighten() noexcept
{
    m_bounds = kEmptyAabb;
    m_blocks.resize((m_size + kLanes - 1) / kLanes);
    for (Block& block : m_blocks)
    {
        block.bounds = kEmptyAabb;
        for (std::uint32_t lane = 0; lane < kLanes; ++lane)
            enclose(block.bounds, boxAt(block, lane));
        enclose(m_bounds, block.bounds);
    }
}

void GhostBoxes::clear()
{
    std::vector<Block>().swap(m_blocks);
    std::vector<std::uint32_t>().swap(m_slots);
    m_size = 0;
    m_bounds = kEmptyAabb;
}
}  // namespace cullet
