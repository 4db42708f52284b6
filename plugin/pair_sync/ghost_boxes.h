// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cullet
{
/// The boxes of the ghosts, as a tree for finding those that overlap a box.
///
/// A block has eight boxes: those of ghosts at level 0, the bounds of eight blocks of the level below at the others. The
/// last level is one block. Bounds only grow until tighten(), which also sorts the ghosts by place when they have moved
/// so far that the bounds of their blocks have become wide. 36 bytes per ghost and 4 per row.
class GhostBoxes
{
public:
    std::uint32_t size() const noexcept { return m_size; }
    bool isEmpty() const noexcept { return m_size == 0; }
    bool contains(std::uint32_t row) const noexcept { return row < m_slots.size() && m_slots[row] != kNone; }

    /// The box of the last insert() or set(). @pre the row is in the list
    Aabb box(std::uint32_t row) const noexcept
    {
        return boxAt(m_levels[0][m_slots[row] / kLanes], m_slots[row] % kLanes);
    }

    /// @pre the row is not in the list
    void insert(std::uint32_t row, const Aabb& box);
    /// @pre the row is in the list
    void set(std::uint32_t row, const Aabb& box) noexcept;
    /// @pre the row is in the list
    void erase(std::uint32_t row) noexcept;
    void clear();

    /// Makes all bounds exact. O(ghosts) if a ghost has changed since the last call; O(ghosts log(ghosts)) if an
    /// eighth of them have.
    void tighten() noexcept;

    /// Whether the box may touch a ghost; false for almost every body.
    bool mayTouch(const Aabb& box) const noexcept { return overlaps(m_bounds, box); }

    /// Calls visit(row) for every ghost with a valid box that overlaps `box`, which must be valid; ghosts with empty
    /// boxes may be visited too. The list must not change during the call.
    ///
    /// @return number of blocks that were tested
    template <class Visit>
    std::uint32_t forEachOverlap(const Aabb& box, Visit visit) const
    {
        if (m_levels.empty() || !mayTouch(box))
            return 0;
        return visitBlock(m_levels.size() - 1, 0, box, visit);
    }

    std::uint64_t bytes() const noexcept;

private:
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};
    static constexpr std::uint32_t kLanes = 8;

    struct Block
    {
        float min[3][kLanes];
        float max[3][kLanes];
    };

    struct Ghost
    {
        Aabb box;
        float centre[3];
        std::uint32_t row;
    };

    template <class Visit>
    std::uint32_t visitBlock(std::size_t level, std::uint32_t index, const Aabb& box, Visit& visit) const
    {
        std::uint32_t tested = 1;
        std::uint32_t child = index * kLanes;
        for (std::uint32_t mask = overlapMask(m_levels[level][index], box); mask != 0; mask >>= 1, ++child)
        {
            // An infinite box also overlaps the empty box of a free lane.
            if ((mask & 1) == 0)
                continue;
            if (level == 0 && m_rows[child] != kNone)
                visit(m_rows[child]);
            else if (level != 0 && child < m_levels[level - 1].size())
                tested += visitBlock(level - 1, child, box, visit);
        }
        return tested;
    }

    static Block emptyBlock() noexcept;
    static std::uint32_t overlapMask(const Block& block, const Aabb& box) noexcept;
    static Aabb boxAt(const Block& block, std::uint32_t lane) noexcept;
    static void setBox(Block& block, std::uint32_t lane, const Aabb& box) noexcept;
    static Aabb boundsOf(const Block& block) noexcept;
    static void divide(Ghost* first, Ghost* last) noexcept;

    void growLevels();
    void put(std::uint32_t slot, std::uint32_t row, const Aabb& box) noexcept;
    void dropEmptyBlocks() noexcept;
    void tightenLevels() noexcept;
    double meanSpan() const noexcept;
    void sortByPlace();

    std::vector<std::vector<Block>> m_levels;
    std::vector<std::uint32_t> m_rows;   // by slot: lane of level 0
    std::vector<std::uint32_t> m_slots;  // by row: index in the list, or kNone
    std::uint32_t m_size = 0;
    Aabb m_bounds = kEmptyAabb;
    bool m_isLoose = false;       // a box has changed since tighten()
    std::uint64_t m_changes = 0;  // since the ghosts were sorted
    double m_spanWhenSorted = 0.0;
};
}  // namespace cullet
