// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/broad/cell_visitor.h"
#include "cullet/comparison/backends.h"
#include "cullet/comparison/uniform_grid.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace cullet
{
struct CellGridOptions
{
    /// a and b of Lesson 04 (docs/references.md): a box belongs to the grid of cell size s with a < size / s <= b. For
    /// b = 2 a exactly one grid fits; for b > 2 a a box is stored in the finest and stays there while the rule holds.
    /// Needs 0 < 2 a <= b <= 8 (at b = 8 a box touches up to 9^3 cells).
    double a = 0.5;
    double b = 1.0;
    std::uint32_t bucketCount = 0;       ///< n of each grid's hash, see UniformGrid
    bool updatesByRemoveAndAdd = false;  ///< the simple update of Lesson 04, not that of changed cells
    GridStorage storage = GridStorage::Chained;
    GridPlacement placement = GridPlacement::AllCoarser;
    /// Keep the pairs that share cells, for forEachCounted(). Needs GridPlacement::AllCoarser.
    bool countsPairs = false;
};

/// Finest level at which a valid box is at most `b` cells large and its cell numbers do not saturate: from
/// CellGrid::kFinestLevel to CellGrid::kCoarsestLevel, or CellGrid::kUnbounded.
int levelOfBox(const Aabb& box, double b) noexcept;

/// The level for GridPlacement::OneGrid: cells at least as large as the mean box times 1 / b, whose numbers do not
/// saturate. If all boxes are invalid or unbounded: CellGrid::kFinestLevel.
int levelOfMeanBox(const Aabb* boxes, std::uint32_t count, double b) noexcept;

/// Hierarchical uniform grid: one UniformGrid for each resolution in use, cell sizes 2^level.
///
/// "Hierarchical Uniform Grid" of Lesson 04. Res(A) there is -level here, size is the largest extent. A box is stored
/// bold in the grid of its own level and regular in all coarser grids; two boxes are reported in the coarser of their
/// levels, bold x bold or bold x regular, exactly once. A grid is created with its first bold id and destroyed in
/// dropUnusedLevels().
///
/// The level has bounds: kFinestLevel, and cells so large that cell numbers do not saturate (a point 10^9 away from the
/// origin gets the level of a box of size 1, about). Boxes that extend to infinity or need more than kCoarsestLevel are
/// *unbounded*: they are stored in a list and paired with all other boxes.
///
/// With GridPlacement::OneGrid all boxes have one level, setCommonLevel(), and boxes of more than kMostCells cells
/// count as unbounded.
///
/// Cost: a box touches at most 8 cells in each grid (a = 0.5, b = 1). A new level costs O(boxes of finer levels).
class CellGrid
{
public:
    static constexpr int kFinestLevel = -149;
    static constexpr int kCoarsestLevel = 127;
    static constexpr int kUnbounded = kCoarsestLevel + 1;  ///< level of unbounded boxes
    static constexpr int kAbsent = kCoarsestLevel + 2;     ///< level of rows without a box
    static constexpr double kMostCells = 4096;             ///< of a box, with GridPlacement::OneGrid

    struct Counters
    {
        std::uint64_t levels = 0;
        std::uint64_t unbounded = 0;     ///< unbounded boxes
        std::uint64_t cells = 0;         ///< over all levels
        std::uint64_t ids = 0;           ///< over all cells of all levels, bold and regular
        std::uint64_t touchedTotal = 0;  ///< as in UniformGrid; dropped levels included
        std::uint64_t visitedTotal = 0;  ///< as in UniformGrid; dropped levels included
    };

    explicit CellGrid(const CellGridOptions& options = {});

    /// Sets the one level of GridPlacement::OneGrid. @pre there is no box in the grid
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

    /// Calls visit(other) for the other rows that may overlap the row's box and are unbounded, of its level or of a
    /// coarser one: searching from all rows finds all pairs, those of one level from both of their rows. For placements
    /// that store a box at one level only.
    template <class Visit>
    void forEachNeighbourAbove(std::uint32_t row, Visit visit) const;

    /// Calls visit(a, b) exactly once for every two rows that share cells, in any order. Unbounded rows share none.
    /// Needs CellGridOptions::countsPairs.
    template <class Visit>
    void forEachCounted(Visit visit) const
    {
        m_pairCounts.forEach(visit);
    }

    /// Calls visit(other) for every other row that a row is paired with because one of the two is unbounded.
    template <class Visit>
    void forEachUnboundedPartner(std::uint32_t row, Visit visit) const;

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
        std::uint32_t unboundedIndex = 0;  ///< index in m_unbounded, if unbounded
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
    bool mayStayAtLevel(const Aabb& box, int level) const noexcept;
    Level& levelWithGrid(int level);
    void addAtLevel(std::uint32_t row, const Aabb& box, int level);
    void addToUnbounded(std::uint32_t row);
    void removeFromUnbounded(std::uint32_t row);

    CellGridOptions m_options;
    int m_commonLevel = kFinestLevel;
    std::vector<StoredBox> m_boxes;                ///< by row
    std::vector<std::unique_ptr<Level>> m_levels;  ///< in use, fine to coarse
    std::vector<std::uint32_t> m_unbounded;        ///< rows of unbounded boxes
    PairCounts m_pairCounts;
    std::uint64_t m_touchedInDropped = 0;
    std::uint64_t m_visitedInDropped = 0;
};

template <class Visit>
void CellGrid::forEachUnboundedPartner(std::uint32_t row, Visit visit) const
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
    forEachUnboundedPartner(row, visit);
    const int own = m_boxes[row].level;
    if (own == kUnbounded)
        return;
    for (const auto& level : m_levels)
    {
        const UniformGrid& grid = level->grid;
        if (sharesCells())
        {
            // The box is bold in its own grid and pairs with all ids there; in coarser grids it is regular and pairs
            // with bold ids.
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
    forEachUnboundedPartner(row, visit);
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
