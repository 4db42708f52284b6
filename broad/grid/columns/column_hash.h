// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory>

namespace cullet
{
/// A cell of one grid level, packed into one word; the key of a column. Never zero.
///
/// @param level below 32
/// @param j,k   within +-2^28, along the first and second tiled axis
inline std::uint64_t packCell(std::int32_t level, std::int32_t j, std::int32_t k) noexcept
{
    constexpr std::int32_t kBias = 1 << 29;
    return static_cast<std::uint64_t>(level + 1) << 60 | static_cast<std::uint64_t>(j + kBias) << 30 |
           static_cast<std::uint64_t>(k + kBias);
}

inline std::int32_t levelOfCell(std::uint64_t cell) noexcept
{
    return static_cast<std::int32_t>(cell >> 60) - 1;
}

inline std::int32_t cellCoordinateJ(std::uint64_t cell) noexcept
{
    return static_cast<std::int32_t>(cell >> 30 & 0x3fffffff) - (1 << 29);
}

inline std::int32_t cellCoordinateK(std::uint64_t cell) noexcept
{
    return static_cast<std::int32_t>(cell & 0x3fffffff) - (1 << 29);
}

/// Cells of the finest level that are found by their position in a rectangle instead of by hash.
struct CellWindow
{
    std::int32_t j0 = 0;
    std::int32_t k0 = 0;
    std::uint32_t countJ = 0;
    std::uint32_t countK = 0;

    std::uint32_t count() const { return countJ * countK; }
    bool contains(std::int32_t j, std::int32_t k) const
    {
        return static_cast<std::uint32_t>(j - j0) < countJ && static_cast<std::uint32_t>(k - k0) < countK;
    }
    /// Whether the square of four cells that begins with this one is inside.
    bool containsSquare(std::int32_t j, std::int32_t k) const
    {
        return static_cast<std::uint32_t>(j - j0) < std::max(countJ, 1u) - 1 &&
               static_cast<std::uint32_t>(k - k0) < std::max(countK, 1u) - 1;
    }
    std::uint32_t column(std::int32_t j, std::int32_t k) const
    {
        return static_cast<std::uint32_t>(j - j0) * countK + static_cast<std::uint32_t>(k - k0);
    }
    std::uint64_t cell(std::uint32_t column) const
    {
        return packCell(0, j0 + static_cast<std::int32_t>(column / countK),
                        k0 + static_cast<std::int32_t>(column % countK));
    }
};

/// Spatial hash from cells to column numbers: hash(i, j, k) = (i p1 xor j p2 xor k p3) mod n.
///
/// "Spatial Hashing" of Lesson 04 (docs/references.md), with Teschner's primes in unsigned arithmetic and the level
/// as third coordinate. A bucket overflows into the next ones (linear probing). Cells are compared on every lookup,
/// so that any number of buckets, even one, is exact. The number of a column is its position in the table: below
/// capacity(), with gaps.
///
/// The cells of the window have the first numbers. They need neither hash nor comparison, and neighbours are close in
/// memory.
///
/// Threads: findOrInsert() may run concurrently with itself; the other members may not run beside it.
class ColumnHash
{
public:
    static constexpr std::uint32_t kNone = 0xffffffffu;

    /// Empties the table.
    ///
    /// @param capacity    a power of two; three quarters of it can be used
    /// @param bucketCount 0: as many as the capacity
    /// @param window      its cells are not counted in the capacity
    void reset(std::uint32_t capacity, std::uint32_t bucketCount, const CellWindow& window);

    /// Number of the column of a cell, a new one if the cell has none yet; kNone when the table is full.
    std::uint32_t findOrInsert(std::uint64_t cell)
    {
        if (isInWindow(cell))
            return columnInWindow(cell);
        const std::uint32_t home = homeOf(cell);
        const bool isThere = m_cells[home].load(std::memory_order_relaxed) == cell;
        return isThere ? m_windowCount + home : findOrInsertFrom(home, cell);
    }

    /// Number of the column of a cell, or kNone. Cells of the window always have a column, perhaps an empty one.
    std::uint32_t find(std::uint64_t cell) const;

    const CellWindow& window() const { return m_window; }
    std::uint32_t capacity() const { return m_windowCount + m_capacity; }
    std::uint32_t count() const { return m_windowCount + m_count.load(std::memory_order_relaxed); }

    /// The cell of a column, 0 for a gap.
    std::uint64_t cell(std::uint32_t column) const
    {
        return column < m_windowCount ? m_window.cell(column)
                                      : m_cells[column - m_windowCount].load(std::memory_order_relaxed);
    }
    std::uint64_t bytes() const { return static_cast<std::uint64_t>(m_room) * sizeof(std::uint64_t); }

private:
    bool isInWindow(std::uint64_t cell) const
    {
        return levelOfCell(cell) == 0 && m_window.contains(cellCoordinateJ(cell), cellCoordinateK(cell));
    }
    std::uint32_t columnInWindow(std::uint64_t cell) const
    {
        return m_window.column(cellCoordinateJ(cell), cellCoordinateK(cell));
    }

    std::uint32_t homeOf(std::uint64_t cell) const
    {
        const std::uint32_t hash = static_cast<std::uint32_t>(cell >> 30 & 0x3fffffff) * 73856093u ^
                                   static_cast<std::uint32_t>(cell & 0x3fffffff) * 19349663u ^
                                   static_cast<std::uint32_t>(cell >> 60) * 83492791u;
        // Neighbouring cells differ in few bits of this hash; a multiplication spreads them before the shift.
        const std::uint32_t mixed = hash * 2654435769u >> m_shift;
        return m_bucketCount == 0 ? mixed : hash % m_bucketCount & m_mask;
    }

    std::uint32_t findOrInsertFrom(std::uint32_t slot, std::uint64_t cell);

    std::unique_ptr<std::atomic<std::uint64_t>[]> m_cells;
    CellWindow m_window;
    std::uint32_t m_windowCount = 0;
    std::atomic<std::uint32_t> m_count{0};  ///< columns outside the window
    std::uint32_t m_room = 0;
    std::uint32_t m_capacity = 0;
    std::uint32_t m_mask = 0;
    std::uint32_t m_shift = 0;  ///< 32 - log2(capacity)
    std::uint32_t m_bucketCount = 0;
};
}  // namespace cullet
