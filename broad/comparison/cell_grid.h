// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/broad/cell_visitor.h"
#include "cullet/broad/comparison/uniform_grid.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace cullet
{
struct CellGridOptions
{
    /// a and b of the lecture: a box belongs to the grid of cell size s with a < size / s <= b. For b = 2 a there is
    /// exactly one; for b > 2 a a box takes the finest and stays there while the rule holds.
    /// Needs 0 < 2 a <= b <= 8 (at b = 8 a box touches up to 9^3 cells).
    double a = 0.5;
    double b = 1.0;
    std::uint32_t bucketCount = 0;       ///< n of each grid's hash, see UniformGrid
    bool updatesByRemoveAndAdd = false;  ///< the lecture's simple update instead of the one of changed cells
    GridStorage storage = GridStorage::Chained;
    GridPlacement placement = GridPlacement::AllCoarser;
    /// Keep the pairs that share cells, for forEachCounted(). Needs GridPlacement::AllCoarser.
    bool countsPairs = false;
};

/// Finest level at which a valid box is at most `b` cells large and its cell numbers do not saturate: from
/// CellGrid::kFinestLevel to CellGrid::kCoarsestLevel, or CellGrid::kUnbounded.
int levelOfBox(const Aabb& box, double b) noexcept;

/// The level for GridPlacement::OneGrid: cells at least as large as the mean box times 1 / b, whose numbers do not saturate.
/// Of boxes that are all invalid or unbounded: CellGrid::kFinestLevel.
int levelOfMeanBox(const Aabb* boxes, std::uint32_t count, double b) noexcept;

/// Hierarchical uniform grid: one UniformGrid for each resolution in use, cell sizes 2^level.
///
/// "Hierarchical Uniform Grid" of Lecture 4, Broad Phase. Res(A) there is -level here, size is the largest extent. A box
/// is stored bold in the grid of its own level and regular in all coarser grids; two boxes are reported in the coarser
/// of their levels, bold x bold or bold x regular, exactly once. Grids appear with their first bold id and go in
/// dropUnusedLevels().
///
/// The level has bounds: kFinestLevel, and cells so large that cell numbers do not saturate (a point 10^9 away from the
/// origin has a level as if it were about 1 large). Boxes that reach infinity or need more than kCoarsestLevel are
/// *unbounded*: they are kept on a side list and reported with everybody.
///
/// With GridPlacement::OneGrid there is one level for all, setCommonLevel(), and boxes of more than kMostCells cells count as
/// unbounded.
///
/// Cost: a box touches at most 8 cells in each grid (a = 0.5, b = 1). A new level costs O(boxes of finer levels).
class CellGrid
{
public:
    static constexpr int kFinestLevel = -149;
    static constexpr int kCoarsestLevel = 127;
    static constexpr int kUnbounded = kCoarsestLevel + 1;  ///< level of boxes on the side list
    static constexpr int kAbsent = kCoarsestLevel + 2;     ///< level of rows without a box
    static constexpr double kMostCells = 4096;             ///< of a box, with GridPlacement::OneGrid

    struct Counters
    {
        std::uint64_t levels = 0;
        std::uint64_t unbounded = 0;     ///< boxes on the side list
        std::uint64_t cells = 0;         ///< over all levels
        std::uint64_t ids = 0;           ///< over all cells of all levels, bold and regular
        std::uint64_t touchedTotal = 0;  ///< as in UniformGrid; of levels that were dropped too
        std::uint64_t visitedTotal = 0;  ///< likewise
    };

    explicit CellGrid(const CellGridOptions& options = {});

    /// The one level of GridPlacement::OneGrid. @pre there is no box in the grid
    void setCommonLevel(int level) noexcept { m_commonLevel = level; }

    /// Level of a valid box that is not in the grid yet.
    int levelOf(const Aabb& box) const noexcept;

    /// Level of a row's box, kUnbounded or kAbsent.
    int level(std::uint32_t row) const noexcept
    {
        return row < m_boxes.size() ? m_boxes[row].level : kAbsent;
    }

    /// @pre the row has no box in the grid; the box is valid
    void addBox(std::uint32_t row, const Aabb& box);
    /// @pre the row has a box in the grid
    void removeBox(std::uint32_t row);
    /// @pre the row has a box in the grid; the box is valid
    void updateBox(std::uint32_t row, const Aabb& box);

    /// Frees the grids that have no bold id left.
    void dropUnusedLevels();

    /// Removes every box; grids keep their memory until dropUnusedLevels().
    void clear();

    /// Calls visit(other) exactly once for every other row that may overlap the row's box.
    template <class Visit>
    void forEachNeighbour(std::uint32_t row, Visit visit) const;

    /// The same for rows of its own level and of coarser ones, and for unbounded ones: searching from all rows finds all
    /// pairs. Each pair of one level is found from both sides. For placements that store a box at one level only.
    template <class Visit>
    void forEachNeighbourAbove(std::uint32_t row, Visit visit) const;

    /// Calls visit(a, b) exactly once for every two rows that share cells, in any order. Those on the side list are not
    /// among them. Needs CellGridOptions::countsPairs.
    template <class Visit>
    void forEachCounted(Visit visit) const
    {
        m_pairCounts.forEach(visit);
    }

    /// Calls visit(other) for every other row that a row is paired with because one of the two is unbounded.
    template <class Visit>
    void forEachBySideList(std::uint32_t row, Visit visit) const;

    /// The grid of a level, or null.
    const UniformGrid* grid(int level) const;

    /// See CellSource.
    void forEachCell(const CellVisitor& visit) const;

    Counters counters() const;
    std::uint64_t bytes() const;

private:
    struct StoredBox
    {
        Aabb box = kEmptyAabb;
        int level = kAbsent;
        std::uint32_t sidePlace = 0;  ///< index in the side list, if unbounded
    };

    struct Level
    {
        UniformGrid grid;
        std::uint64_t boldCount;
    };

    /// Whether a grid stores the boxes of a level.
    bool stores(const UniformGrid& grid, int level) const noexcept
    {
        return m_options.placement == GridPlacement::AllCoarser ? grid.sizeExponent() >= level
                                                                : grid.sizeExponent() == level;
    }

    /// Whether boxes that overlap have a cell in common.
    bool sharesCells() const noexcept
    {
        return m_options.placement == GridPlacement::AllCoarser ||
               m_options.placement == GridPlacement::OneGrid;
    }

    template <class Visit>
    void searchGrid(const UniformGrid& grid, std::uint32_t row, Visit visit) const;
    CellRange searchRange(const Aabb& box, int level) const noexcept;
    bool isAtHome(const Aabb& box, int level) const noexcept;
    Level& levelWithGrid(int level);
    void addAtLevel(std::uint32_t row, const Aabb& box, int level);
    void addToSideList(std::uint32_t row);
    void removeFromSideList(std::uint32_t row);

    CellGridOptions m_options;
    int m_commonLevel = kFinestLevel;
    std::vector<StoredBox> m_boxes;                ///< by row
    std::vector<std::unique_ptr<Level>> m_levels;  ///< in use, fine to coarse
    std::vector<std::uint32_t> m_unbounded;        ///< rows
    PairCounts m_pairCounts;
    std::uint64_t m_touchedInDropped = 0;
    std::uint64_t m_visitedInDropped = 0;
};

template <class Visit>
void CellGrid::forEachBySideList(std::uint32_t row, Visit visit) const
{
    if (m_boxes[row].level != kUnbounded)
    {
        for (const std::uint32_t other : m_unbounded)
            visit(other);
        return;
    }
    for (std::uint32_t other = 0; other < m_boxes.size(); ++other)
    {
        if (other != row && m_boxes[other].level != kAbsent)
            visit(other);
    }
}

template <class Visit>
void CellGrid::forEachNeighbour(std::uint32_t row, Visit visit) const
{
    forEachBySideList(row, visit);
    const int own = m_boxes[row].level;
    if (own == kUnbounded)
        return;
    for (const auto& level : m_levels)
    {
        const UniformGrid& grid = level->grid;
        if (sharesCells())
        {
            // In its own grid the box is bold and meets all ids; in coarser ones it is regular and meets the bold ones.
            if (stores(grid, own))
                grid.forEachSharing(row, grid.sizeExponent() > own, visit);
            continue;
        }
        searchGrid(grid, row, visit);
    }
}

template <class Visit>
void CellGrid::forEachNeighbourAbove(std::uint32_t row, Visit visit) const
{
    forEachBySideList(row, visit);
    for (const auto& level : m_levels)
    {
        if (level->grid.sizeExponent() >= m_boxes[row].level)
            searchGrid(level->grid, row, visit);
    }
}

/// Calls visit(other) for the rows of a level that may overlap a row, for placements that store a box at one level.
template <class Visit>
void CellGrid::searchGrid(const UniformGrid& grid, std::uint32_t row, Visit visit) const
{
    grid.forEachInRange(searchRange(m_boxes[row].box, grid.sizeExponent()),
                        [&](std::uint32_t other)
                        {
                            if (other != row)
                                visit(other);
                        });
}
}  // namespace cullet
