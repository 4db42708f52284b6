// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/comparison/thesis/cell_steps.h"

#include <cstdint>

/// The thesis's workspace shifting (chapter 6.1), as published: the boxes of a cell are moved along the sweep axis by
/// cell x length of the scene, in float, and all cells are swept as one list.
///
/// The sum is rounded, so that some boxes overlap along the sweep axis only by rounding, more with more cells. The
/// thesis tests the two other axes only, and would report these pairs. Here they are counted and dropped; no pair is
/// lost, because rounding is monotone.
namespace cullet::psap
{
/// Bits of a box's coordinate in the shifted list.
CULLET_HOST_DEVICE inline std::uint32_t shiftedBits(const CellPlan& plan, float coordinate,
                                                    std::uint32_t cell)
{
    return orderedBits(coordinate + plan.sceneLength * static_cast<float>(cell));
}

/// Converts key i from (cell, start) to (shifted start, cell).
struct ShiftKey
{
    const CellPlan* plan;
    const Aabb* boxes;
    const std::uint32_t* rows;
    std::uint64_t* keys;  ///< [entries, in, out]

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const std::uint32_t cell = static_cast<std::uint32_t>(keys[i] >> 32);
        const float start = along(loadBox(boxes, rows[i]).min, plan->axes.s);
        keys[i] = static_cast<std::uint64_t>(shiftedBits(*plan, start, cell)) << 32 | cell;
    }
};

/// Finds the pairs that entry i of the shifted list begins.
template <class IsNew>
struct SweepShifted
{
    const std::uint64_t* keys;  ///< [count] sorted: shifted start, cell
    const std::uint32_t* rows;
    std::uint64_t count;
    const Aabb* boxes;
    const CellPlan* plan;
    IsNew isNew;
    std::uint64_t* falsePairs;  ///< pairs that the thesis would report although they do not overlap

    template <class Emit>
    CULLET_HOST_DEVICE void operator()(std::uint64_t i, Emit& emit) const
    {
        const Aabb box = loadBox(boxes, rows[i]);
        const std::uint32_t cell = static_cast<std::uint32_t>(keys[i]);
        const std::uint32_t end = shiftedBits(*plan, along(box.max, plan->axes.s), cell);
        std::uint64_t j = i + 1;
        for (; j < count && keys[j] >> 32 <= end; ++j)
        {
            const Aabb other = loadBox(boxes, rows[j]);
            if (!overlapsAlong(box, other, plan->axes.u) || !overlapsAlong(box, other, plan->axes.v))
                continue;
            if (!overlapsAlong(box, other, plan->axes.s))
            {
                fetchAdd(falsePairs, std::uint64_t{1});
                continue;
            }
            const RowPair pair = {rows[i], rows[j]};
            if (static_cast<std::uint32_t>(keys[j]) == cell && ownerCell(*plan, box, other) == cell &&
                isNew(pair))
                emit.push(pair);
        }
        emit.tested(j - i - 1);
    }

private:
    CULLET_HOST_DEVICE static bool overlapsAlong(const Aabb& a, const Aabb& b, std::uint32_t axis)
    {
        return along(a.min, axis) <= along(b.max, axis) && along(b.min, axis) <= along(a.max, axis);
    }
};
}  // namespace cullet::psap
