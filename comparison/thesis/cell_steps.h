// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/pair_lists.h"
#include "cullet/broad/psap/data/scene_statistics.h"
#include "cullet/comparison/backends.h"

#include <cstdint>

/// The thesis's broad phase (chapter 6.1) as functors of one index: boxes are counted into the cells of the two other
/// axes, written as (cell, start) keys, sorted, and swept along the sweep axis inside each cell.
///
/// Two differences, both for exactness. Instead of shifting each cell's boxes by cell x scene size in float, whose
/// rounding adds false pairs (workspace_shift.h counts them), the cell is the upper half of an integer key. And a
/// pair that shares several cells is reported by one of them only, so that no duplicates have to be removed.
namespace cullet::psap
{
/// Float as an unsigned integer of the same order. -0 counts as +0; no NaN.
CULLET_HOST_DEVICE inline std::uint32_t orderedBits(float value)
{
    const std::uint32_t bits = bitsOf(value + 0.0f);
    return (bits & 0x80000000u) != 0 ? ~bits : bits | 0x80000000u;
}

/// The cells of the thesis's search.
struct CellPlan
{
    Axes axes;
    float originU, originV;
    float inverseU, inverseV;
    std::uint32_t countU, countV;
    float sceneLength;  ///< length along the sweep axis, or slightly more
};

/// The block of cells that a box touches, bounds included.
struct CellBlock
{
    std::uint32_t u0, u1, v0, v1;

    CULLET_HOST_DEVICE std::uint64_t size() const
    {
        return static_cast<std::uint64_t>(u1 - u0 + 1) * (v1 - v0 + 1);
    }
};

CULLET_HOST_DEVICE inline CellBlock cellsOf(const CellPlan& plan, const Aabb& box)
{
    return {clampedCell(along(box.min, plan.axes.u), plan.originU, plan.inverseU, plan.countU),
            clampedCell(along(box.max, plan.axes.u), plan.originU, plan.inverseU, plan.countU),
            clampedCell(along(box.min, plan.axes.v), plan.originV, plan.inverseV, plan.countV),
            clampedCell(along(box.max, plan.axes.v), plan.originV, plan.inverseV, plan.countV)};
}

/// The cell that reports a pair: the one that contains the lower corner (max of minima) of the intersection.
CULLET_HOST_DEVICE inline std::uint64_t ownerCell(const CellPlan& plan, const Aabb& a, const Aabb& b)
{
    const Axes axes = plan.axes;
    const float u = along(a.min, axes.u) > along(b.min, axes.u) ? along(a.min, axes.u) : along(b.min, axes.u);
    const float v = along(a.min, axes.v) > along(b.min, axes.v) ? along(a.min, axes.v) : along(b.min, axes.v);
    return static_cast<std::uint64_t>(clampedCell(v, plan.originV, plan.inverseV, plan.countV)) *
               plan.countU +
           clampedCell(u, plan.originU, plan.inverseU, plan.countU);
}

/// Chooses the sweep axis and the cells from the statistics. One index.
struct PlanCells
{
    static constexpr float kMeanExtents = 3.0f;  // width of an automatic cell
    static constexpr std::uint32_t kThesisBoxesPerCell = 64000;
    static constexpr double kLargestCount = 1 << 20;  // of cells in total and per axis

    const Moments* moments;
    const SizeClasses* sizes;
    PsapAxis axis;
    ThesisCells rule;
    std::uint32_t fixedCount;
    CellPlan* plan;

    CULLET_HOST_DEVICE void operator()(std::uint64_t) const
    {
        const Moments& sums = *moments;
        const Axes axes = chooseAxes(sums, axis);
        const double n = sums.count == 0 ? 1.0 : static_cast<double>(sums.count);
        const double sideU =
            sums.count == 0 ? 0.0 : static_cast<double>(sums.high[axes.u]) - sums.low[axes.u];
        const double sideV =
            sums.count == 0 ? 0.0 : static_cast<double>(sums.high[axes.v]) - sums.low[axes.v];
        double countU = 1;
        double countV = 1;
        if (rule == ThesisCells::Automatic)
        {
            countU = sideU / (kMeanExtents * sums.extent[axes.u] / n);
            countV = sideV / (kMeanExtents * sums.extent[axes.v] / n);
            // At most about one cell per box.
            const double excess = limited(countU) * limited(countV) / n;
            countU = excess > 1 ? countU / sqrt(excess) : countU;
            countV = excess > 1 ? countV / sqrt(excess) : countV;
        }
        else
        {
            // Nearly square cells: at least the requested number, and more only to fill the last column.
            const double count = rule == ThesisCells::Thesis ? ceil(n / kThesisBoxesPerCell) : fixedCount;
            countU = sideV > 0 ? floor(sqrt(count * sideU / sideV) + 0.5) : count;
            countU = limited(countU < count ? countU : count);
            countV = ceil(count / countU);
        }
        plan->axes = axes;
        plan->countU = limited(countU);
        plan->countV = limited(countV);
        if (static_cast<double>(plan->countU) * plan->countV > kLargestCount)
            plan->countV = limited(kLargestCount / plan->countU);
        plan->originU = sums.count == 0 ? 0.0f : sums.low[axes.u];
        plan->originV = sums.count == 0 ? 0.0f : sums.low[axes.v];
        plan->inverseU = inverse(plan->countU, sideU);
        plan->inverseV = inverse(plan->countV, sideV);
        plan->sceneLength = sums.count == 0 ? 0.0f : lengthAlong(axes.s);
    }

private:
    CULLET_HOST_DEVICE static std::uint32_t limited(double count)
    {
        // Written so that NaN, from a scene without extent, gives 1.
        return count >= 1 ? static_cast<std::uint32_t>(count < kLargestCount ? count : kLargestCount) : 1u;
    }

    CULLET_HOST_DEVICE float lengthAlong(std::uint32_t which) const
    {
        double longest = 0;
        for (std::uint32_t octave = 0; octave < kOctaves; ++octave)
        {
            const double unbounded = floatOf(sizes->largestBits[octave]);
            longest = unbounded > longest ? unbounded : longest;
        }
        const double length =
            static_cast<double>(along(moments->high, which)) - along(moments->low, which) + longest;
        return static_cast<float>(length < 1e30 ? length : 1e30);
    }

    CULLET_HOST_DEVICE static float inverse(std::uint32_t count, double unbounded)
    {
        const float result = static_cast<float>(count / unbounded);
        return result <= 1e30f ? result : 0.0f;  // 0: all boxes in the first cell
    }
};

/// Step 1: counts the cells of box i (Kalojanov and Slusallek's pre-pass). Unbounded boxes, and boxes with more cells
/// than pay, are appended to the list of unbounded boxes.
struct CountCells
{
    static constexpr std::uint64_t kMostCells = 4096;

    const Aabb* boxes;
    const Aabb* placed;  ///< the boxes or their projections, for cells and sweep
    const CellPlan* plan;
    std::uint64_t* counts;     ///< [boxes, out]
    std::uint32_t* unbounded;  ///< [boxes, out]
    std::uint32_t* unboundedCount;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const Aabb box = loadBox(boxes, i);
        counts[i] = 0;
        if (!isValid(box))
            return;
        const std::uint64_t cells = cellsOf(*plan, loadBox(placed, i)).size();
        if (boundedExtent(box) <= kUnboundedExtent && cells <= kMostCells)
            counts[i] = cells;
        else
            unbounded[fetchAdd(unboundedCount, 1u)] = static_cast<std::uint32_t>(i);
    }
};

/// Step 3: writes the (cell, start) keys of box i, starting at its offset.
struct FillEntries
{
    const Aabb* placed;
    const CellPlan* plan;
    const std::uint64_t* counts;
    const std::uint64_t* offsets;  ///< exclusive scan of the counts
    std::uint64_t* keys;           ///< [entries, out] cell in the upper, ordered start in the lower half
    std::uint32_t* rows;           ///< [entries, out]

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        if (counts[i] == 0)
            return;
        const CellBlock cells = cellsOf(*plan, placed[i]);
        const std::uint64_t start = orderedBits(along(placed[i].min, plan->axes.s));
        std::uint64_t entry = offsets[i];
        for (std::uint32_t v = cells.v0; v <= cells.v1; ++v)
        {
            for (std::uint32_t u = cells.u0; u <= cells.u1; ++u, ++entry)
            {
                keys[entry] = (static_cast<std::uint64_t>(v) * plan->countU + u) << 32 | start;
                rows[entry] = static_cast<std::uint32_t>(i);
            }
        }
    }
};

/// Step 5: marks entries that are alone in their cell, which the sweep skips.
struct MarkSingle
{
    const std::uint64_t* keys;  ///< [count] sorted
    std::uint64_t count;
    std::uint8_t* isSingle;  ///< [count, out]

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const std::uint64_t cell = keys[i] >> 32;
        const bool hasBefore = i > 0 && keys[i - 1] >> 32 == cell;
        const bool hasAfter = i + 1 < count && keys[i + 1] >> 32 == cell;
        isSingle[i] = !hasBefore && !hasAfter ? 1 : 0;
    }
};

/// Step 6: finds the pairs that entry i begins. Parallel sweep and prune, algorithm 1 of the thesis (Liu et al.
/// 2010).
///
/// @post a pair is reported by the cell that contains the lower corner (max of minima) of the intersection only
/// Cost: O(k) for k entries of the cell that start inside the box
template <class IsNew>
struct SweepCell
{
    const std::uint64_t* keys;  ///< [count] sorted
    const std::uint32_t* rows;
    const std::uint8_t* isSingle;
    const std::uint64_t* bits;  ///< second-level bit strings, or null
    std::uint64_t count;
    const Aabb* boxes;
    const Aabb* placed;
    const CellPlan* plan;
    IsNew isNew;

    template <class Emit>
    CULLET_HOST_DEVICE void operator()(std::uint64_t i, Emit& emit) const
    {
        if (isSingle[i] == 0)
            test(i, i + 1, count, emit);
    }

    /// Tests entry i against those of [begin, end) that start inside its box.
    template <class Emit>
    CULLET_HOST_DEVICE void test(std::uint64_t i, std::uint64_t begin, std::uint64_t end, Emit& emit) const
    {
        const std::uint32_t row = rows[i];
        const Aabb box = loadBox(boxes, row);
        const std::uint64_t last = lastKey(i);
        std::uint64_t tests = 0;
        for (std::uint64_t j = begin; j < end && keys[j] <= last; ++j)
        {
            if (bits != nullptr && (bits[i] & bits[j]) == 0)
                continue;
            ++tests;
            const RowPair pair = {row, rows[j]};
            if (overlaps(box, loadBox(boxes, pair.b)) && isOwned(pair, keys[i] >> 32) && isNew(pair))
                emit.push(pair);
        }
        emit.tested(tests);
    }

    /// First entry after i that starts after its box ends or lies in another cell; i + 1 where i is alone in its
    /// cell.
    CULLET_HOST_DEVICE std::uint64_t firstAfter(std::uint64_t i) const
    {
        if (isSingle[i] != 0)
            return i + 1;
        const std::uint64_t last = lastKey(i);
        std::uint64_t low = i + 1;
        std::uint64_t high = count;
        while (low < high)
        {
            const std::uint64_t middle = low + (high - low) / 2;
            if (keys[middle] <= last)
                low = middle + 1;
            else
                high = middle;
        }
        return low;
    }

private:
    CULLET_HOST_DEVICE std::uint64_t lastKey(std::uint64_t i) const
    {
        return keys[i] >> 32 << 32 | orderedBits(along(loadBox(placed, rows[i]).max, plan->axes.s));
    }

    CULLET_HOST_DEVICE bool isOwned(RowPair pair, std::uint64_t cell) const
    {
        return ownerCell(*plan, loadBox(placed, pair.a), loadBox(placed, pair.b)) == cell;
    }
};

/// Finds the pairs of box i with the unbounded boxes.
template <class IsNew>
struct TestUnbounded
{
    const Aabb* boxes;
    const std::uint64_t* cellCounts;  ///< 0 for unbounded and for empty boxes
    const std::uint32_t* unbounded;
    const std::uint32_t* unboundedCount;
    IsNew isNew;

    template <class Emit>
    CULLET_HOST_DEVICE void operator()(std::uint64_t i, Emit& emit) const
    {
        const std::uint32_t row = static_cast<std::uint32_t>(i);
        const std::uint32_t count = *unboundedCount;
        if (count == 0)
            return;
        const Aabb box = loadBox(boxes, row);
        for (std::uint32_t k = 0; k < count; ++k)
        {
            const RowPair pair = {row, unbounded[k]};
            // Of two unbounded boxes, the lower row reports the pair.
            if ((cellCounts[row] != 0 || row < pair.b) && overlaps(box, loadBox(boxes, pair.b)) &&
                isNew(pair))
                emit.push(pair);
        }
        emit.tested(count);
    }
};
}  // namespace cullet::psap
