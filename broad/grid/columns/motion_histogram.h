// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/grid/columns/column_grid.h"

#include <cstdint>
#include <cstring>

// Functions of the histogram of motions that ColumnGrid::compare() makes.
namespace cullet
{
// One box in so many may move farther than the motion bound of the grid; the pairs of these boxes are found by a
// list.
inline constexpr std::uint32_t kFewTeleportedShare = 64;

/// Largest float below 2^(octave - 127): all motions of lower octaves are within it.
inline float motionBoundOf(std::uint32_t octave)
{
    const std::uint32_t bits = (octave << 23) - 1;
    float bound;
    std::memcpy(&bound, &bits, sizeof bound);
    return bound;
}

/// Number of boxes in an octave or a higher one.
inline std::uint32_t countFrom(const GridMotion& motion, std::uint32_t octave)
{
    std::uint32_t count = 0;
    for (; octave < motion.octaves.size(); ++octave)
        count += motion.octaves[octave];
    return count;
}

/// Mean motion of all rows as a share of the largest, by octaves, when no box teleported.
inline double evenness(const GridMotion& motion, std::uint32_t rows)
{
    double sum = 0;
    double largest = 0;
    double size = 0x1p-125;  // of octave 1
    for (std::size_t octave = 1; octave < motion.octaves.size() - 1; ++octave, size *= 2)
    {
        sum += size * motion.octaves[octave];
        largest = motion.octaves[octave] != 0 ? size : largest;
    }
    return largest == 0 ? 1.0 : sum / (largest * rows);
}

/// Lowest octave for which at most `few` boxes are in it or in a higher one.
inline std::uint32_t octaveAbove(const GridMotion& motion, std::uint32_t few)
{
    auto octave = static_cast<std::uint32_t>(motion.octaves.size());
    for (std::uint32_t count = 0; octave > 1; --octave)
    {
        count += motion.octaves[octave - 1];
        if (count > few)
            break;
    }
    return octave;
}
}  // namespace cullet
