// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/scene_statistics.h"

#include <cmath>
#include <cstdint>

namespace cullet::psap
{
inline constexpr std::uint32_t kMostLevels = 12;
inline constexpr std::uint32_t kBinsPerLevel = 64;  ///< at least
inline constexpr std::uint32_t kReservedBins = kBinsPerLevel * kMostLevels;

/// The cells of boxes of similar size. Aligned, so that a GPU loads it in three loads.
struct alignas(16) PlanLevel
{
    float limit;                   ///< longest side of a box on this level
    float reach;                   ///< slightly more: how far before a box the minima of its partners may lie
    float inverseU;                ///< 1 / width of a cell
    float inverseBin;              ///< 1 / length of a bin
    std::uint32_t firstBin;        ///< number of bins of all finer levels
    std::uint32_t endBin;          ///< number of bins up to and including this level
    std::uint32_t countU, countV;  ///< cells until they repeat
    std::uint32_t binCount;        ///< bins per cell
    std::uint32_t isWrapFree;      ///< 1: no two cells around a box wrap to the same one
    // In a plan for warps, the inverse width along v, and 1: cells end with the plan's and lie in serpentine order.
    // Elsewhere cells are square.
    float inverseV;
    std::uint32_t isSerpentine;
};

/// What every box needs of a plan. Aligned, so that a GPU loads it at once.
struct alignas(16) PlanHead
{
    float originS, originU, originV;
    std::uint32_t levelCount;
    Axes axes;
    std::uint32_t binCount;  ///< of all levels
    /// First bin of the overflow level, the last one, which has boxes only where the sample missed some.
    std::uint32_t overflowBin;
    /// The number of the plan in the upper half, a PlanSummary in the lower half. One word, so that the CPU reads all
    /// of it or nothing.
    std::uint64_t summary;
};

/// What the CPU needs of a plan.
struct PlanSummary
{
    std::uint32_t levels;  ///< as many as the sizes call for; a plan for warps has fewer
    bool isCrowded;        ///< boxes of one size, at most three longest sides apart on average

    CULLET_HOST_DEVICE std::uint32_t word() const { return levels | (isCrowded ? kCrowded : 0); }
    static PlanSummary of(std::uint64_t word)
    {
        return {static_cast<std::uint32_t>(word) & ~kCrowded, (word & kCrowded) != 0};
    }

private:
    static constexpr std::uint32_t kCrowded = 1u << 31;
};

struct LevelPlan : PlanHead
{
    PlanLevel levels[kMostLevels];
};

/// Number of bins that a search over so many boxes allocates, whatever the plan.
inline std::uint64_t binCapacityFor(std::uint64_t boxes, float binsPerBox)
{
    return static_cast<std::uint64_t>(static_cast<double>(binsPerBox) * static_cast<double>(boxes)) +
           2 * kReservedBins;
}

/// Chooses axis, levels, cells and bins from the statistics. One index.
///
/// Levels, finest first: a level takes doublings of size as long as its cells stay nearly empty, since another level
/// costs every finer box a search. Cells and bins: the cheapest of some sizes. The cost counts cells visited, boxes
/// tested and bins summed up, each for the box that needs most, since the lanes of a warp wait for the slowest one.
/// The cost model takes the scene as uniform boxes of the same variance; other scenes are searched as exactly, only
/// slower.
struct PlanLevels
{
    static constexpr double kCostOfCell = 4;  // in tests of one box
    static constexpr double kCostOfBin = 4;
    // Boxes per cell above which a doubling of size gets its own level.
    static constexpr double kFullCell = 2.5;
    // The same in a plan for warps, whose records lie one after the other in a cell about as wide as the box around
    // them. Sizes of cells and bins are in mean distances of boxes.
    static constexpr double kFullCellForWarps = 10;
    static constexpr double kWidthForWarps = 2.5;
    static constexpr double kLengthForWarps = 0.5;
    static constexpr double kNarrowestForWarps = 0.5;  // in longest sides
    // Mean distance of boxes, in longest sides, up to which a scene counts as crowded. Above it boxes form clusters
    // with gaps between them, and the cells of a plan for warps are larger than the box around the records of a warp.
    static constexpr double kCrowdedDistance = 3;
    // The window of a box is slightly longer than two longest sides: it touches two bins of that length.
    static constexpr double kTwoSides = 2.02;
    static constexpr double kNarrowest = 0.25;

    const Moments* moments;
    const SizeClasses* sizes;
    double stride;  ///< boxes of the scene for each box in the statistics
    PsapAxis axis;
    float cellScale;  ///< width of a cell in longest sides of its level; 0: the cost model decides
    float binScale;   ///< length of a bin in longest sides of its level; 0: the cost model decides
    double perBin;    ///< 0, or the mean number of boxes in a bin
    bool isForWarps;
    std::uint64_t binCapacity;
    std::uint32_t number;  ///< number of the plan
    LevelPlan* plan;

    CULLET_HOST_DEVICE void operator()(std::uint64_t) const
    {
        const Moments& sums = *moments;
        plan->axes = chooseAxes(sums, axis);
        // Short lines of cells: a warp of the next line reads the cells around a warp again while they are in the
        // cache.
        if (isForWarps && spreadAlong(plan->axes.u) > spreadAlong(plan->axes.v))
            plan->axes = {plan->axes.s, plan->axes.v, plan->axes.u};
        const bool isEmpty = sums.count == 0;
        const double all = stride * static_cast<double>(sums.count + sums.others);
        plan->originS = isEmpty ? 0.0f : sums.low[plan->axes.s];
        plan->originU = isEmpty ? 0.0f : static_cast<float>(begin(plan->axes.u));
        plan->originV = isEmpty ? 0.0f : static_cast<float>(begin(plan->axes.v));
        const Spread spread = {spreadAlong(plan->axes.s), spreadAlong(plan->axes.u),
                               spreadAlong(plan->axes.v)};
        double counts[kMostLevels];
        chooseLevels(spread, kFullCell, counts);
        plan->summary =
            std::uint64_t{number} << 32 | PlanSummary{plan->levelCount, isCrowded(spread, counts[0])}.word();
        if (isForWarps)
            chooseLevels(spread, kFullCellForWarps, counts);
        std::uint32_t firstBin = 0;
        double finer = 0;
        for (std::uint32_t k = 0; k < plan->levelCount; ++k)
        {
            PlanLevel& level = plan->levels[k];
            level.firstBin = firstBin;
            const double share = isEmpty ? 0.0 : counts[k] / all;
            const double room = static_cast<double>(binCapacity - kReservedBins);
            chooseCells(level, spread, counts[k], finer, k == 0 ? 0.0f : plan->levels[k - 1].limit,
                        kBinsPerLevel + room * share);
            firstBin += level.countU * level.countV * level.binCount;
            level.endBin = firstBin;
            finer += counts[k];
        }
        plan->overflowBin = plan->levels[plan->levelCount - 1].firstBin;
        plan->binCount = firstBin;
    }

private:
    /// Sides of the uniform block of boxes with the same variance, limited to the sides of the scene.
    struct Spread
    {
        double s, u, v;

        CULLET_HOST_DEVICE double volume(double limit) const
        {
            return (s + limit) * (u + limit) * (v + limit);
        }
    };

    /// Sizes in cells and bins.
    struct Cells
    {
        double u, v, s;

        CULLET_HOST_DEVICE double count() const { return u * v * s; }
    };

    CULLET_HOST_DEVICE double side(std::uint32_t along) const
    {
        return moments->count == 0 ? 0.0 : static_cast<double>(moments->high[along]) - moments->low[along];
    }

    /// Where the cells that do not repeat begin and end along an axis. Few boxes lie beyond.
    CULLET_HOST_DEVICE double begin(std::uint32_t along) const
    {
        const double low = moments->low[along];
        const double first = mean(along) - spreadAlong(along);
        return isForWarps && first > low ? first : low;
    }
    CULLET_HOST_DEVICE double end(std::uint32_t along) const
    {
        const double high = moments->high[along];
        const double last = mean(along) + spreadAlong(along);
        return last < high ? last : high;
    }
    CULLET_HOST_DEVICE double mean(std::uint32_t along) const
    {
        return moments->sum[along] / static_cast<double>(moments->count);
    }

    CULLET_HOST_DEVICE double spreadAlong(std::uint32_t along) const
    {
        const double variance = moments->variance(along);
        const double uniform = variance > 0 ? sqrt(12 * variance) : 0.0;
        return uniform < side(along) ? uniform : side(along);
    }

    /// @param fullCell boxes per cell above which a doubling of size gets its own level
    /// @param counts   [out] boxes per level
    CULLET_HOST_DEVICE void chooseLevels(const Spread& spread, double fullCell, double* counts) const
    {
        std::uint32_t levels = 0;
        double taken = 0;
        float limit = 0;
        for (std::uint32_t octave = 0; octave < kOctaves; ++octave)
        {
            if (sizes->count[octave] == 0)
                continue;
            const double count = stride * sizes->count[octave];
            const double next = floatOf(sizes->largestBits[octave]);
            const double perCell = (taken + count) * next * next * next / spread.volume(next);
            if (taken > 0 && perCell > fullCell && levels + 2 < kMostLevels)
            {
                closeLevel(levels, limit, taken, counts);
                taken = 0;
            }
            taken += count;
            limit = static_cast<float>(next);
        }
        closeLevel(levels, limit, taken, counts);
        // The overflow level takes boxes that the sample missed.
        closeLevel(levels, 4 * limit, 0, counts);
        plan->levelCount = levels;
    }

    /// @param count boxes on the finest level
    CULLET_HOST_DEVICE bool isCrowded(const Spread& spread, double count) const
    {
        const double limit = plan->levels[0].limit;
        const double near = kCrowdedDistance * limit;
        return plan->levelCount == 2 && near * near * near * count >= spread.volume(limit);
    }

    CULLET_HOST_DEVICE void closeLevel(std::uint32_t& levels, float limit, double count, double* counts) const
    {
        // Sides of equal boxes differ by rounding; the slightly larger limit keeps them on one level.
        plan->levels[levels].limit = 1.001f * limit > 1e-20f ? 1.001f * limit : 1e-20f;
        counts[levels] = count;
        ++levels;
    }

    /// @param count      boxes on the level
    /// @param finer      boxes on all finer levels
    /// @param finerLimit longest side of those boxes
    CULLET_HOST_DEVICE void chooseCells(PlanLevel& level, const Spread& spread, double count, double finer,
                                        double finerLimit, double room) const
    {
        const double limit = level.limit;
        const double density = count / spread.volume(limit);
        level.reach = level.limit * 1.001f;
        level.isSerpentine = isForWarps ? 1 : 0;
        if (isForWarps)
            return chooseCellsForWarps(level, density, room);
        if (perBin > 0)
            return chooseFilledCells(level, spread, density, room);
        double best = -1;
        double width = 2 * limit;
        double length = 4 * limit;
        for (double cell = 2; cell > 0.2; cell *= 0.5 * sqrt(2.0))
        {
            for (double bin = 8; bin > 0.1; bin *= 0.5)
            {
                const double w = limit * (cellScale > 0 ? static_cast<double>(cellScale) : cell);
                const double l = limit * (binScale > 0 ? static_cast<double>(binScale) : bin);
                const double bins = cellsFor(spread, w, l).count();
                const double cost = count * ownCells(limit, w) * cellCost(2 * limit + l, w, density) +
                                    finer * coarserCells(limit + finerLimit, w) *
                                        cellCost(limit + finerLimit + l, w, density) +
                                    kCostOfBin * bins;
                if (bins > room || (best >= 0 && cost >= best))
                    continue;
                best = cost;
                width = w;
                length = l;
            }
        }
        setCells(level, limited(cellsFor(spread, width, length), room), width, length);
    }

    /// Chooses cells and bins so that a bin has `perBin` boxes on average.
    CULLET_HOST_DEVICE void chooseFilledCells(PlanLevel& level, const Spread& spread, double density,
                                              double room) const
    {
        const double limit = level.limit;
        const double volume = perBin / (density > 1e-30 ? density : 1e-30);
        const double edge = cbrt(volume);
        double length = edge > kTwoSides * limit ? edge : kTwoSides * limit;
        double width = sqrt(volume / length);
        width = width > kNarrowest * limit ? width : kNarrowest * limit;
        width = cellScale > 0 ? static_cast<double>(cellScale) * limit : width;
        length = binScale > 0 ? static_cast<double>(binScale) * limit : length;
        setCells(level, limited(cellsFor(spread, width, length), room), width, length);
    }

    /// Cells that a search visits on its own level, where it visits half of those around a box.
    CULLET_HOST_DEVICE static double ownCells(double limit, double width)
    {
        const double ahead = cellsAcross(limit, width);
        return ahead + (ahead - 1) * cellsAcross(2 * limit, width);
    }

    CULLET_HOST_DEVICE static double coarserCells(double window, double width)
    {
        return cellsAcross(window, width) * cellsAcross(window, width);
    }

    /// Cells that a window of that length usually touches; a window in an unlucky position touches one more.
    CULLET_HOST_DEVICE static double cellsAcross(double window, double width)
    {
        return ceil(window / width - 0.05) + 1;
    }

    /// Cost of visiting a cell and testing the boxes in a window of that length there.
    CULLET_HOST_DEVICE static double cellCost(double window, double width, double density)
    {
        return kCostOfCell + width * width * window * density;
    }

    CULLET_HOST_DEVICE Cells cellsFor(const Spread& spread, double width, double length) const
    {
        // Twice the spread: boxes farther out share cells with boxes inside.
        const double u = 2 * spread.u < side(plan->axes.u) ? 2 * spread.u : side(plan->axes.u);
        const double v = 2 * spread.v < side(plan->axes.v) ? 2 * spread.v : side(plan->axes.v);
        return {cells(u, width), cells(v, width), cells(side(plan->axes.s), length)};
    }

    CULLET_HOST_DEVICE static double cells(double side, double width)
    {
        const double count = floor(side / width) + 1;
        return count >= 1 ? (count < 1048576.0 ? count : 1048576.0) : 1.0;
    }

    /// Fewer cells, which then repeat, and longer bins, until there is room for them.
    CULLET_HOST_DEVICE static Cells limited(Cells cells, double room)
    {
        while (cells.count() > room && cells.count() > 1)
        {
            double* most = cells.u > cells.v ? &cells.u : &cells.v;
            most = cells.s > *most ? &cells.s : most;
            *most = floor((*most + 1) / 2);
        }
        return cells;
    }

    CULLET_HOST_DEVICE void setCells(PlanLevel& level, const Cells& cells, double width, double length) const
    {
        level.inverseU = level.inverseV = static_cast<float>(1.0 / width);
        level.countU = static_cast<std::uint32_t>(cells.u);
        level.countV = static_cast<std::uint32_t>(cells.v);
        // Cells on both sides of a box, and three more on either side for rounding and the position of the box.
        const double around = floor(2 * 1.001 * level.limit / width) + 8;
        level.isWrapFree = cells.u >= around && cells.v >= around ? 1 : 0;
        setBins(level, cells.s, length);
    }

    CULLET_HOST_DEVICE void setBins(PlanLevel& level, double count, double length) const
    {
        level.binCount = static_cast<std::uint32_t>(count);
        const double fitting = count / side(plan->axes.s);
        level.inverseBin = static_cast<float>(fitting < 1.0 / length ? fitting : 1.0 / length);
    }

    /// Chooses cells of equal width: records of a warp in a narrow last cell would spread over a long part of it.
    CULLET_HOST_DEVICE void chooseCellsForWarps(PlanLevel& level, double density, double room) const
    {
        const double distance = cbrt(1 / (density > 1e-30 ? density : 1e-30));
        const double least = kNarrowestForWarps * level.limit;
        double width = kWidthForWarps * distance > least ? kWidthForWarps * distance : least;
        double length = kLengthForWarps * distance;
        width = cellScale > 0 ? static_cast<double>(cellScale) * level.limit : width;
        length = binScale > 0 ? static_cast<double>(binScale) * level.limit : length;
        const double sideU = sideOfCells(plan->axes.u);
        const double sideV = sideOfCells(plan->axes.v);
        const Cells cells = limited(
            {PlanLevels::cells(sideU - 0.5 * width, width), PlanLevels::cells(sideV - 0.5 * width, width),
             PlanLevels::cells(side(plan->axes.s), length)},
            room);
        level.countU = static_cast<std::uint32_t>(cells.u);
        level.countV = static_cast<std::uint32_t>(cells.v);
        level.inverseU = static_cast<float>(cells.u / sideU);
        level.inverseV = static_cast<float>(cells.v / sideV);
        level.isWrapFree = 0;
        setBins(level, cells.s, length);
    }

    /// Slightly more than the distance from the first to the last cell, so that rounding adds no cell.
    CULLET_HOST_DEVICE double sideOfCells(std::uint32_t along) const
    {
        const double side = moments->count == 0 ? 0.0 : end(along) - begin(along);
        return side > 1e-30 ? 1.00001 * side : 1e-30;
    }
};
}  // namespace cullet::psap
