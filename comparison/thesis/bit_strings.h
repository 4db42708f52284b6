// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/comparison/thesis/cell_steps.h"

#include <cstdint>

/// Two refinements of the sweep by Liu et al. 2010, "Real-time Collision Culling of a Million Bodies on Graphics
/// Processing Units": second-level cells as bit strings, and work split by length instead of by box.
namespace cullet::psap
{
/// Writes the bit string of entry i: which of the 8 x 8 second-level cells of its cell its box touches. Boxes that
/// overlap have a bit in common in each cell that they share.
struct MarkSecondLevel
{
    const std::uint64_t* keys;
    const std::uint32_t* rows;
    const Aabb* boxes;
    const CellPlan* plan;
    std::uint64_t* bits;  ///< [entries, out]

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const Aabb box = loadBox(boxes, rows[i]);
        const std::uint32_t cell = static_cast<std::uint32_t>(keys[i] >> 32);
        const Axes axes = plan->axes;
        const std::uint64_t columns = maskAlong(along(box.min, axes.u), along(box.max, axes.u), plan->originU,
                                                plan->inverseU, cell % plan->countU);
        std::uint64_t rowsOfBits = maskAlong(along(box.min, axes.v), along(box.max, axes.v), plan->originV,
                                             plan->inverseV, cell / plan->countU);
        std::uint64_t marks = 0;
        for (int shift = 0; rowsOfBits != 0; shift += 8, rowsOfBits >>= 1)
            marks |= (rowsOfBits & 1) != 0 ? columns << shift : 0;
        bits[i] = marks;
    }

private:
    /// Eighth of a cell along one axis, clamped: monotone, so that intervals that overlap have one in common.
    CULLET_HOST_DEVICE static std::uint32_t eighthOf(float value, float origin, float inverse,
                                                     std::uint32_t cell)
    {
        const float eighth = floorf(8.0f * ((value - origin) * inverse - static_cast<float>(cell)));
        return static_cast<std::uint32_t>(eighth > 0.0f ? (eighth < 7.0f ? eighth : 7.0f) : 0.0f);
    }

    CULLET_HOST_DEVICE static std::uint64_t maskAlong(float low, float high, float origin, float inverse,
                                                      std::uint32_t cell)
    {
        const std::uint32_t first = eighthOf(low, origin, inverse, cell);
        const std::uint32_t last = eighthOf(high, origin, inverse, cell);
        return (2ull << last) - (1ull << first);
    }
};

/// Length of a part of a sweep, in entries.
inline constexpr std::uint64_t kSweepPart = 128;

/// Counts the parts into which the sweep of entry i is split. 0 past the last entry.
template <class IsNew>
struct CountParts
{
    SweepCell<IsNew> sweep;
    std::uint64_t* parts;  ///< [entries + 1, out]

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        parts[i] = i < sweep.count ? (sweep.firstAfter(i) - i - 1 + kSweepPart - 1) / kSweepPart : 0;
    }
};

/// Sweeps part `item` of all parts, so that no index makes more than kSweepPart tests.
template <class IsNew>
struct SweepPart
{
    SweepCell<IsNew> sweep;
    const std::uint64_t* firstParts;  ///< [entries + 1] exclusive scan of the parts

    template <class Emit>
    CULLET_HOST_DEVICE void operator()(std::uint64_t item, Emit& emit) const
    {
        // Binary search for the last entry whose first part is at or before this one.
        std::uint64_t entry = 0;
        std::uint64_t end = sweep.count;
        while (entry + 1 < end)
        {
            const std::uint64_t middle = entry + (end - entry) / 2;
            if (firstParts[middle] <= item)
                entry = middle;
            else
                end = middle;
        }
        const std::uint64_t begin = entry + 1 + (item - firstParts[entry]) * kSweepPart;
        const std::uint64_t last = begin + kSweepPart;
        sweep.test(entry, begin, last < sweep.count ? last : sweep.count, emit);
    }
};
}  // namespace cullet::psap
