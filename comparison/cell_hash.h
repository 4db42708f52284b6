// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/comparison/backends.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

namespace cullet
{
/// Cell of a grid, by its number on each axis.
using CellNumber = std::int32_t[3];

/// Hash of a cell before the modulo: (i p1) xor (j p2) xor (k p3) with the primes of Teschner et al. 2003, "Optimized
/// Spatial Hashing for Collision Detection of Deformable Objects", section 4.
inline std::uint32_t cellHash(const CellNumber& cell) noexcept
{
    return static_cast<std::uint32_t>(cell[0]) * 73856093u ^ static_cast<std::uint32_t>(cell[1]) * 19349663u ^
           static_cast<std::uint32_t>(cell[2]) * 83492791u;
}

/// Maps cells to their places: small integers that the owner assigns.
///
/// Cell numbers are compared, so that any number of slots gives the same answers.
///
/// Cost: O(1) each while the hash values are spread; the number of slots grows with the number of cells.
class CellHash
{
public:
    static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

    /// @param slotCount slots; 0: as many as needed. For open addressing it is the initial number only.
    CellHash(GridStorage storage, std::uint32_t slotCount);

    /// The place of a cell, or kNone.
    std::uint32_t find(const CellNumber& cell) const;

    /// @pre the cell has no place yet, and no other cell has this place
    void insert(const CellNumber& cell, std::uint32_t place);

    /// @pre a cell has the place
    void erase(std::uint32_t place);

    /// The cell that has a place.
    const CellNumber& cellAt(std::uint32_t place) const { return m_keys[place].cell; }

    /// Calls visit(cell) for every cell, in no particular order; visit() must not change the hash.
    template <class Visit>
    void forEach(Visit visit) const
    {
        for (std::uint32_t place : m_slots)
        {
            for (; place != kNone; place = nextInChain(place))
                visit(m_keys[place].cell);
        }
    }

    void clear();
    std::uint64_t bytes() const;

private:
    struct Key
    {
        CellNumber cell;
        std::uint32_t next;  ///< place of the next cell in the chain
    };

    bool isAt(std::uint32_t place, const CellNumber& cell) const
    {
        return std::equal(cell, cell + 3, m_keys[place].cell);
    }

    std::uint32_t nextInChain(std::uint32_t place) const
    {
        return m_storage == GridStorage::OpenAddressing ? kNone : m_keys[place].next;
    }

    std::uint32_t slotOf(const CellNumber& cell) const;
    void link(std::uint32_t place);
    void unlink(std::uint32_t place);
    void shiftBack(std::uint32_t hole);
    void grow();

    GridStorage m_storage;
    bool m_isGrowing;
    std::uint32_t m_side = 1;            ///< array: cells along an axis, a power of two
    std::uint32_t m_count = 0;           ///< cells
    std::vector<std::uint32_t> m_slots;  ///< first place of a chain, or the place of a cell
    std::vector<Key> m_keys;             ///< by place
};
}  // namespace cullet
