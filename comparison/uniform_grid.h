// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/comparison/cell_hash.h"
#include "cullet/comparison/pair_counts.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

namespace cullet
{
/// Largest absolute cell number on an axis; coordinates farther out belong to the last cell.
inline constexpr std::int32_t kLastCell = 1 << 30;

/// Tiling function T on one axis: floor(x / 2^sizeExponent), saturated to +-kLastCell.
///
/// Monotonic for all x, infinities included; that alone makes boxes that overlap share a cell. NaN gives -kLastCell.
/// @param sizeExponent binary logarithm of the cell size, -1000 to 1000: dividing by a power of two rounds nothing
std::int32_t cellOf(float x, int sizeExponent) noexcept;

/// Cells that a box touches, bounds included.
struct CellRange
{
    std::int32_t low[3];
    std::int32_t high[3];

    bool contains(const CellNumber& cell) const noexcept
    {
        return low[0] <= cell[0] && cell[0] <= high[0] && low[1] <= cell[1] && cell[1] <= high[1] &&
               low[2] <= cell[2] && cell[2] <= high[2];
    }

    double count() const noexcept
    {
        double cells = 1;
        for (int axis = 0; axis < 3; ++axis)
            cells *= static_cast<double>(high[axis]) - low[axis] + 1;
        return cells;
    }

    /// Calls visit(cell) for every cell, the first axis fastest.
    template <class Visit>
    void forEach(Visit visit) const
    {
        CellNumber cell;
        for (cell[2] = low[2]; cell[2] <= high[2]; ++cell[2])
        {
            for (cell[1] = low[1]; cell[1] <= high[1]; ++cell[1])
            {
                for (cell[0] = low[0]; cell[0] <= high[0]; ++cell[0])
                    visit(cell);
            }
        }
    }
};

bool operator==(const CellRange& a, const CellRange& b) noexcept;

/// Cells of a valid box.
CellRange cellsOf(const Aabb& box, int sizeExponent) noexcept;

/// Pool of objects addressed by number; freed numbers are reused.
template <class T>
struct NumberedPool
{
    std::vector<T> items;
    std::vector<std::uint32_t> unused;

    std::uint32_t take()
    {
        if (unused.empty())
        {
            items.emplace_back();
            return static_cast<std::uint32_t>(items.size() - 1);
        }
        const std::uint32_t number = unused.back();
        unused.pop_back();
        return number;
    }

    void giveBack(std::uint32_t number) { unused.push_back(number); }
    std::uint64_t usedCount() const { return items.size() - unused.size(); }
    std::uint64_t bytes() const
    {
        return items.capacity() * sizeof(T) + unused.capacity() * sizeof(std::uint32_t);
    }

    void clear()
    {
        items.clear();
        unused.clear();
    }
};

/// Unbounded uniform grid of cubic cells that keeps in each cell the ids of the boxes that touch it.
///
/// "Uniform Grid" and "Spatial Hashing" of Lesson 04 (docs/references.md). Only cells with ids exist; they are found by
/// cellHash() mod n in buckets (chains), and the cell numbers are compared, so that n = 1 works too. An id is either
/// *bold* (the grid has the resolution of its box) or *regular* (its box is smaller and also stored in a finer grid); a
/// grid used on its own has bold ids only.
///
/// Two boxes may share many cells. They are reported only in the *owner cell*, the one with the larger of the two
/// lowest cell numbers on each axis: it is a shared cell, so each pair is reported exactly once without a pair set.
///
/// Cost: addBox, removeBox and updateBox are O(cells of the box). A box much larger than a cell touches
/// (extent / size)^3 cells: use CellGrid for mixed sizes, and never add an infinite box.
class UniformGrid
{
public:
    enum class Mark : std::uint8_t
    {
        Regular,
        Bold
    };

    struct Counters
    {
        std::uint64_t cells = 0;  ///< cells that exist now
        std::uint64_t ids = 0;    ///< ids stored now, over all cells
        std::uint64_t touchedTotal =
            0;  ///< cells to which an id was added or from which one was removed, ever
        std::uint64_t visitedTotal = 0;  ///< cells that were searched, ever
    };

    struct Options
    {
        std::uint32_t bucketCount = 0;  ///< n of the hash; 0: grows with the number of cells
        GridStorage storage = GridStorage::Chained;
        bool storesOneCell = false;  ///< only the cell of the lowest corner
        PairCounts* pairCounts =
            nullptr;  ///< not owned; counts the cells that pairs share, except two regular ids
    };

    /// @param sizeExponent binary logarithm of the cell size
    explicit UniformGrid(int sizeExponent, std::uint32_t bucketCount = 0)
        : UniformGrid(sizeExponent, Options{bucketCount, GridStorage::Chained, false, nullptr})
    {
    }
    UniformGrid(int sizeExponent, const Options& options);

    int sizeExponent() const { return m_sizeExponent; }

    /// Calls visit(cell number) for every cell that has an id.
    template <class Visit>
    void forEachCell(Visit visit) const
    {
        m_directory.forEach(visit);
    }
    bool contains(std::uint32_t row) const
    {
        return row < m_boxes.size() && m_boxes[row].firstEntry != kNone;
    }
    Counters counters() const;
    std::uint64_t bytes() const;

    /// Stores the id of a box in all cells that the box touches.
    /// @pre the row is not in the grid, row < 2^31, the box is valid and finite
    void addBox(std::uint32_t row, const Aabb& box, Mark mark = Mark::Bold);

    /// Removes the id from all cells. @pre the row is in the grid
    void removeBox(std::uint32_t row);

    /// Moves the id: changes only the cells that the box enters or leaves. @pre the row is in the grid
    void updateBox(std::uint32_t row, const Aabb& box);

    void clear();

    /// Calls visit(other) exactly once for every other id that shares a cell with the row's.
    /// @param onlyBold leave regular ids out
    template <class Visit>
    void forEachSharing(std::uint32_t row, bool onlyBold, Visit visit) const;

    /// Calls visit(row, mark) for each id in a cell.
    template <class Visit>
    void forEachInCell(const CellNumber& cell, Visit visit) const;

    /// Calls visit(row) exactly once for each id in some of the cells.
    template <class Visit>
    void forEachInRange(const CellRange& cells, Visit visit) const;

private:
    static constexpr std::uint32_t kNone = CellHash::kNone;

    struct Cell
    {
        std::uint32_t firstEntry[2];  ///< list of regular and list of bold ids, by Mark
    };

    /// One id in one cell, linked into the list of its cell (doubly) and the list of its box.
    struct Entry
    {
        std::uint32_t rowAndMark;  ///< row << 1 | mark
        std::uint32_t cell;
        std::uint32_t previousInCell;
        std::uint32_t nextInCell;
        std::uint32_t nextOfBox;
    };

    struct StoredBox
    {
        CellRange cells = {};
        std::uint32_t firstEntry = kNone;
    };

    static bool isOwner(const CellNumber& cell, const CellRange& a, const CellRange& b) noexcept
    {
        return cell[0] == std::max(a.low[0], b.low[0]) && cell[1] == std::max(a.low[1], b.low[1]) &&
               cell[2] == std::max(a.low[2], b.low[2]);
    }

    CellRange rangeOf(const Aabb& box) const noexcept;
    std::uint32_t addCell(const CellNumber& cell);
    void removeCell(std::uint32_t number);
    template <class Visit>
    void forEachCounted(const Cell& cell, Mark mark, Visit visit) const;
    void addEntry(std::uint32_t row, Mark mark, const CellNumber& cell);
    void removeEntry(std::uint32_t number);
    void addEntries(std::uint32_t row, Mark mark, const CellRange& cells, const CellRange* except);

    int m_sizeExponent;
    bool m_storesOneCell;
    PairCounts* m_pairCounts;
    CellHash m_directory;
    NumberedPool<Cell> m_cells;
    NumberedPool<Entry> m_entries;
    std::vector<StoredBox> m_boxes;  ///< by row
    std::uint64_t m_touchedTotal = 0;
    mutable std::uint64_t m_visitedTotal = 0;
};

template <class Visit>
void UniformGrid::forEachSharing(std::uint32_t row, bool onlyBold, Visit visit) const
{
    const StoredBox& box = m_boxes[row];
    for (std::uint32_t own = box.firstEntry; own != kNone; own = m_entries.items[own].nextOfBox)
    {
        const Cell& cell = m_cells.items[m_entries.items[own].cell];
        const CellNumber& cellNumber = m_directory.cellAt(m_entries.items[own].cell);
        ++m_visitedTotal;
        for (const Mark mark : {Mark::Bold, Mark::Regular})
        {
            if (onlyBold && mark == Mark::Regular)
                break;
            std::uint32_t number = cell.firstEntry[static_cast<int>(mark)];
            for (; number != kNone; number = m_entries.items[number].nextInCell)
            {
                const std::uint32_t other = m_entries.items[number].rowAndMark >> 1;
                if (other != row && isOwner(cellNumber, box.cells, m_boxes[other].cells))
                    visit(other);
            }
        }
    }
}

template <class Visit>
void UniformGrid::forEachInCell(const CellNumber& cell, Visit visit) const
{
    const std::uint32_t found = m_directory.find(cell);
    ++m_visitedTotal;
    if (found == kNone)
        return;
    for (const Mark mark : {Mark::Bold, Mark::Regular})
    {
        std::uint32_t number = m_cells.items[found].firstEntry[static_cast<int>(mark)];
        for (; number != kNone; number = m_entries.items[number].nextInCell)
            visit(m_entries.items[number].rowAndMark >> 1, mark);
    }
}

template <class Visit>
void UniformGrid::forEachInRange(const CellRange& cells, Visit visit) const
{
    const auto visitCell = [&](const CellNumber& cell)
    {
        forEachInCell(cell,
                      [&](std::uint32_t row, Mark)
                      {
                          if (isOwner(cell, cells, m_boxes[row].cells))
                              visit(row);
                      });
    };
    // A large box may cover more cells than exist.
    if (cells.count() > static_cast<double>(m_cells.usedCount()))
        m_directory.forEach([&](const CellNumber& cell) { cells.contains(cell) ? visitCell(cell) : void(); });
    else
        cells.forEach(visitCell);
}
}  // namespace cullet
