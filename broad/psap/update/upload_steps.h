// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/broad/psap/data/pair_lists.h"
#include "cullet/broad/psap/data/skins.h"

#include <cstdint>

/// The steps that store the changed rows of a proxy table in an executor's memory.
namespace cullet::psap
{
/// A bit for each row, in words of 32, so that a GPU finds all of them in its cache.
struct RowBits
{
    std::uint32_t* words;

    CULLET_HOST_DEVICE void set(std::uint64_t row) const { setBits(words + row / 32, 1u << row % 32); }
    /// Clears the whole word.
    CULLET_HOST_DEVICE void clearAround(std::uint64_t row) const { storeSameValue(words + row / 32, 0u); }
};

/// Copies the boxes of rows that changed in the last update to the previous boxes.
struct CopyRowToPrevious
{
    const std::uint32_t* rows;  ///< null: 0, 1, 2, ...
    const Aabb* now;
    Aabb* old;
    std::uint8_t* changes;
    RowBits sent;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const std::uint64_t row = rows != nullptr ? rows[i] : i;
        storeBox(old, row, loadBox(now, row));
        changes[row] = kRowUnchanged;
        // All rows whose bit is set are copied in the same launch.
        if (rows != nullptr)
            sent.clearAround(row);
    }
};

/// Records how far rows have moved.
struct MotionRecorder
{
    std::uint32_t* motion;  ///< as BoxHistory::motion; 0 before the step
    /// Boxes and skins of the neighbour list that is followed; null: none is.
    const AlignedBox* reference;
    /// Recorded in place of the motion where `reference` is given: bits of the largest displacementOf() of a row,
    /// infinite where a row has a new proxy; 0 when the list was made.
    std::uint32_t* displacement;

    CULLET_HOST_DEVICE void record(std::uint64_t row, const Aabb& box, unsigned changes,
                                   const Aabb* old) const
    {
        if (reference == nullptr)
            atomicMaxFloat(motion, keepsPairs(changes) ? distanceMoved(box, loadBox(old, row)) : kInfinity);
        else
            atomicMaxFloat(displacement, (changes & kRowCreated) == 0
                                             ? displacementOf(loadSkinned(reference, row), box)
                                             : kInfinity);
    }

private:
    CULLET_HOST_DEVICE static bool keepsPairs(unsigned changes)
    {
        return (changes & (kRowCreated | kRowRefiltered)) == 0;
    }
};

/// Stores a changed row.
struct ApplyRow
{
    const std::uint32_t* rows;  ///< null: 0, 1, 2, ...
    const Aabb* newBoxes;       ///< [changed rows], or indexed by row
    bool areBoxesByRow;
    const std::uint8_t* newChanges;  ///< null: `sameChanges` for all of them
    std::uint8_t sameChanges;
    Aabb* now;
    Aabb* old;
    std::uint8_t* changes;
    std::uint32_t* appliedRows;  ///< [changed rows, out] unless `rows` is null
    RowBits sent;                ///< [out] bits of those rows
    MotionRecorder motion;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const std::uint64_t row = rows != nullptr ? rows[i] : i;
        if (rows != nullptr)
        {
            appliedRows[i] = static_cast<std::uint32_t>(row);
            sent.set(row);
        }
        const Aabb box = loadBox(newBoxes, areBoxesByRow ? row : i);
        storeBox(now, row, isValid(box) ? box : emptyBox());
        const unsigned bits = newChanges != nullptr ? newChanges[i] : sameChanges;
        changes[row] = static_cast<std::uint8_t>(bits);
        if ((bits & kRowCreated) != 0)
            storeBox(old, row, emptyBox());
        motion.record(row, box, bits, old);
    }
};

/// Stores the filter words of a changed row.
struct ApplyFilter
{
    const std::uint32_t* rows;  ///< null: 0, 1, 2, ...
    const Filter* newFilters;   ///< [changed rows]
    Filter* filters;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        filters[rows != nullptr ? rows[i] : i] = newFilters[i];
    }
};

/// Clears both boxes of a row.
struct ClearRow
{
    Aabb* now;
    Aabb* old;
    std::uint8_t* changes;
    RowBits sent;

    CULLET_HOST_DEVICE void operator()(std::uint64_t row) const
    {
        now[row] = emptyBox();
        old[row] = emptyBox();
        changes[row] = kRowUnchanged;
        // The first word may contain earlier rows, whose bits are not set.
        if (row % 32 == 0)
            sent.clearAround(row);
    }
};
}  // namespace cullet::psap
