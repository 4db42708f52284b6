// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/boxes/aabb_simd.h"
#include "cullet/broad/grid/columns/column_soa.h"

namespace cullet
{
/// How boxes fall into cells: tiled faces are moved outward by `grow` and by a few units in their last place,
/// multiplied and rounded down.
struct CellBounds
{
    float grow;
    float inverseWidth;
};

// Everything here is in an anonymous namespace, so that each instruction set has its own copy.
namespace
{
// Cell coordinates saturate here: far away, cells become one, which costs time but loses no pair.
constexpr float kFarthestCell = 268435456.0f;

/// CellBounds in lanes {min, max, min, max}: factors of faces above and below zero, and an offset.
struct CellFactors
{
    Float4 above, below, offset;

    explicit CellFactors(const CellBounds& cellBounds)
    {
        constexpr float kUlps = 0x1p-22f;
        const Float4 outward = {-1.0f, 1.0f, -1.0f, 1.0f};
        above = (1.0f + outward * kUlps) * cellBounds.inverseWidth;
        below = (1.0f - outward * kUlps) * cellBounds.inverseWidth;
        offset = outward * (cellBounds.grow * cellBounds.inverseWidth);
    }
};

/// Cells of two intervals {min, max, min, max}, whose faces CellBounds moves outward.
///
/// Boxes whose gap is not above twice `grow` share a cell. The units in the last place ensure this where `grow` is
/// lost in the rounding of large coordinates. Every step is monotone in the face, so that a cell is an interval of
/// floats: see CellEdges.
inline Int4 cellsOfFaces(Float4 faces, const CellBounds& cellBounds) noexcept
{
    const CellFactors factors(cellBounds);
    Float4 cell = faces * (faces < 0.0f ? factors.below : factors.above) + factors.offset;
    // A NaN, of a box that is none, ends at the lowest cell: its conversion would be undefined.
    cell = cell >= -kFarthestCell ? cell : Float4{} - kFarthestCell;
    cell = cell > kFarthestCell ? Float4{} + kFarthestCell : cell;
    // The conversion truncates; the comparison yields -1 where that was upwards. std::floor would be a library call.
    const Int4 truncated = __builtin_convertvector(cell, Int4);
    return truncated + (__builtin_convertvector(truncated, Float4) > cell);
}

/// Tiled faces {min, max, min, max} and the two of the sweep axis, of a box in two overlapping registers.
template <int kSweepAxis>
struct BoxFaces
{
    Float4 tile;
    Float4 sweep;  ///< lanes 0 and 1

    explicit BoxFaces(const Aabb& box)
    {
        const Float4 low = loadFloat4(box.min);       // x y z X
        const Float4 high = loadFloat4(box.min + 2);  // z X Y Z
        if (kSweepAxis == 0)
        {
            tile = CULLET_SHUFFLE(low, high, 1, 6, 2, 7);
            sweep = CULLET_SHUFFLE(low, high, 0, 3, 0, 3);
        }
        else if (kSweepAxis == 1)
        {
            tile = CULLET_SHUFFLE(low, high, 2, 7, 0, 3);
            sweep = CULLET_SHUFFLE(low, high, 1, 6, 1, 6);
        }
        else
        {
            tile = CULLET_SHUFFLE(low, high, 0, 3, 1, 6);
            sweep = CULLET_SHUFFLE(low, high, 2, 7, 2, 7);
        }
    }
};
}  // namespace
}  // namespace cullet
