// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"

#include <cstdint>
#include <vector>

namespace cullet
{
/// The boxes of the ghosts, packed for finding those that overlap a box.
///
/// Blocks of eight boxes with the bounds of each block, and the bounds of all ghosts, which reject a body far from
/// every ghost with one box test. Bounds only grow until tighten(). 28 bytes per ghost and 4 per row.
class GhostBoxes
{
public:
    std::uint32_t size() const noexcept { return m_size; }
    bool isEmpty() const noexcept { return m_size == 0; }
    bool contains(std::uint32_t row) const noexcept { return row < m_slots.size() && m_slots[row] != kNone; }

    /// @pre the row is not in the list
    void insert(std::uint32_t row, const Aabb& box);
    /// @pre the row is in the list
    void set(std::uint32_t row, const Aabb& box) noexcept;
    /// @pre the row is in the list
    void erase(std::uint32_t row) noexcept;
    void clear();

    /// Makes all bounds exact. O(ghosts).
    void tighten() noexcept;

    /// Whether the box may touch a ghost; false for almost every body.
    bool mayTouch(const Aabb& box) const noexcept { return overlaps(m_bounds, box); }

    /// Calls visit(row) for every ghost with a valid box that overlaps `box`, which must be valid; ghosts with empty
    /// boxes may be visited too. The list must not change during the call.
    template <class Visit>
    void forEachOverlap(const Aabb& box, Visit visit) const
    {
        if (!mayTouch(box))
            return;
        for (const Block& block : m_blocks)
        {
            if (!overlaps(block.bounds, box))
                continue;
            for (std::uint32_t mask = overlapMask(block, box), lane = 0; mask != 0; mask >>= 1, ++lane)
            {
                // An infinite box also overlaps the empty box of a free lane.
                if ((mask & 1) != 0 && block.rows[lane] != kNone)
                    visit(block.rows[lane]);
            }
        }
    }

    std::uint64_t bytes() const noexcept
    {
        return m_blocks.capacity() * sizeof(Block) + m_slots.capacity() * sizeof(std::uint32_t);
    }

private:
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};
    static constexpr std::uint32_t kLanes = 8;

    struct Block
    {
        float min[3][kLanes];
        float max[3][kLanes];
        std::uint32_t rows[kLanes];
        Aabb bounds;
    };

    static std::uint32_t overlapMask(const Block& block, const Aabb& box) noexcept;
    static Aabb boxAt(const Block& block, std::uint32_t lane) noexcept;
    void put(std::uint32_t slot, std::uint32_t row, const Aabb& box) noexcept;

    std::vector<Block> m_blocks;
    std::vector<std::uint32_t> m_slots;  // by row: index in the list, or kNone
    std::uint32_t m_size = 0;
    Aabb m_bounds = kEmptyAabb;
};
}  // namespace cullet
