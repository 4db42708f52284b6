// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/scene_statistics.h"
#include "cullet/broad/psap/tiles/tiles.h"

#include <cmath>
#include <cstdint>

/// The steps that make a plan of tiles from a sample of the boxes.
namespace cullet::psap
{
/// Chooses the size limit of boxes, and the number of tiles along each axis. One index.
struct ChooseTileCounts
{
    // So few records that a block sorts them with few rounds and leaves memory for another block, and so many that
    // most of its threads work.
    static constexpr double kMostBoxesInTile = 2100;
    static constexpr double kNearlyWhole = 0.75;  ///< of a tile's edge: a shorter axis is not cut
    static constexpr double kDeviations = 4;      ///< distance from the mean within which most boxes lie
    // Boxes per cube of the longest side. From about one on, a search with denser bins is as fast.
    static constexpr double kMostInCube = 0.75;

    const Moments* moments;
    const SizeClasses* sizes;
    double stride;  ///< boxes of the scene for each box in the statistics
    PsapAxis axis;
    bool isForced;  ///< makes tiles even where they do not pay
    TilePlan* plan;

    CULLET_HOST_DEVICE void operator()(std::uint64_t) const
    {
        const Moments& sums = *moments;
        plan->axes = chooseAxes(sums, axis);
        plan->limit = longestSide();
        plan->fullestBits = plan->entries = 0;
        plan->shape = {};
        const std::uint32_t axes[3] = {plan->axes.s, plan->axes.u, plan->axes.v};
        double sides[3];
        double volume = 1;
        for (int k = 0; k < 3; ++k)
        {
            sides[k] = sums.count == 0 ? 0.0 : setSteps(k, axes[k]);
            volume *= sides[k] + plan->limit;
        }
        const double count = stride * static_cast<double>(sums.count);
        const double inCube = count * plan->limit * plan->limit * plan->limit / volume;
        if (sums.count != 0 && (isForced || inCube <= kMostInCube))
            setCounts(sides, count);
    }

private:
    /// Longest side of all but a few boxes, which may be treated as unbounded ones.
    CULLET_HOST_DEVICE float longestSide() const
    {
        double larger = 0;
        float longest = 0;
        for (std::uint32_t octave = kOctaves; octave-- > 0;)
        {
            if (sizes->count[octave] == 0)
                continue;
            larger += stride * sizes->count[octave];
            longest = floatOf(sizes->largestBits[octave]);
            if (larger > PlaceInTiles::kMostUnbounded / 2)
                break;
        }
        // Sides of equal boxes differ by rounding; the limit is slightly larger.
        return 1.001f * longest > 1e-20f ? 1.001f * longest : 1e-20f;
    }

    /// @return length over which most boxes spread
    CULLET_HOST_DEVICE double setSteps(int k, std::uint32_t along) const
    {
        const Moments& sums = *moments;
        const double deviation = sums.deviation(along);
        const double mean = sums.sum[along] / static_cast<double>(sums.count);
        const double low = larger(sums.low[along], mean - kDeviations * deviation - plan->limit);
        const double high = -larger(-static_cast<double>(sums.high[along]), -mean - kDeviations * deviation);
        const double side = high > low ? high - low : 0.0;
        plan->steps.origin[k] = static_cast<float>(low);
        plan->steps.inverse[k] = static_cast<float>(TileSteps::kPerAxis / larger(side * 1.0001, 1e-20));
        const double uniform = sqrt(12.0) * deviation;
        return uniform < side ? uniform : side;
    }

    CULLET_HOST_DEVICE static double larger(double a, double b) { return a > b ? a : b; }

    CULLET_HOST_DEVICE void setCounts(const double (&sides)[3], double count) const
    {
        const double wanted = larger(sqrt(count), count / kMostBoxesInTile);
        double whole = wanted < TileShape::kMostTiles ? wanted : TileShape::kMostTiles;
        bool isCut[3] = {true, true, true};
        double edge = 0;
        for (int pass = 0; pass < 3; ++pass)
        {
            double volume = 1;
            int axes = 0;
            for (int k = 0; k < 3; ++k)
            {
                volume *= isCut[k] ? sides[k] : 1.0;
                axes += isCut[k] ? 1 : 0;
            }
            edge = axes == 0 ? 0.0 : pow(volume / whole, 1.0 / axes);
            for (int k = 0; k < 3; ++k)
                isCut[k] = isCut[k] && sides[k] > kNearlyWhole * edge;
        }
        std::uint32_t most = 0;
        for (std::uint32_t k = 0; k < 3; ++k)
        {
            const double tiles = isCut[k] && edge > 0 ? floor(sides[k] / edge + 0.5) : 1.0;
            plan->steps.counts[k] = tiles < 1                        ? 1
                                    : tiles < TilePlan::kMostPerAxis ? static_cast<std::uint32_t>(tiles)
                                                                     : TilePlan::kMostPerAxis;
            most = plan->steps.counts[k] > plan->steps.counts[most] ? k : most;
        }
        while (plan->steps.counts[0] * plan->steps.counts[1] * plan->steps.counts[2] > TileShape::kMostTiles)
            --plan->steps.counts[most];
        plan->shape.tiles = plan->steps.counts[0] * plan->steps.counts[1] * plan->steps.counts[2];
    }
};

/// Every `stride`-th box.
struct TileSample
{
    const Aabb* boxes;
    std::uint64_t stride;

    /// @return false for boxes that do not belong into tiles
    CULLET_HOST_DEVICE bool accept(std::uint64_t i, const TilePlan& plan, SortRecord& record) const
    {
        const Aabb box = loadBox(boxes, i * stride);
        record = recordOf(box, plan.axes, 0, 0);
        return plan.shape.tiles != 0 && isValid(box) && boundedExtent(box) <= plan.limit;
    }
};

/// Counts the boxes of a sample by the step on which they begin.
struct CountSteps
{
    TileSample sample;
    const TilePlan* plan;
    std::uint32_t* counts;  ///< [3 * TileSteps::kPerAxis] 0 before

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        SortRecord box;
        if (!sample.accept(i, *plan, box))
            return;
        count(0, box.front.s0);
        count(1, box.front.u0);
        count(2, box.back.v0);
    }

private:
    CULLET_HOST_DEVICE void count(std::uint32_t axis, float x) const
    {
        fetchAdd(&counts[axis * TileSteps::kPerAxis + plan->steps.stepOf(axis, x)], 1u);
    }
};

/// Cuts an axis so that about the same number of boxes begins in each tile, and chooses the cells of a tile. One
/// index for each axis.
struct CutTiles
{
    // So many cells that about one box in a thousand of a tile is alone in a cell. v has fewer bits than the other
    // axes.
    static constexpr std::uint32_t kMostCells = 24, kMostCellsOfV = 16;

    const std::uint32_t* counts;  ///< of CountSteps
    TilePlan* plan;

    CULLET_HOST_DEVICE void operator()(std::uint64_t axis) const
    {
        if (plan->shape.tiles != 0)
            setCells(axis, cut(axis, plan->steps.counts[axis]));
    }

private:
    /// @return length of the longest tile
    CULLET_HOST_DEVICE float cut(std::uint64_t axis, std::uint32_t tiles) const
    {
        const std::uint32_t* ofAxis = counts + axis * TileSteps::kPerAxis;
        const double length = 1.0 / plan->steps.inverse[axis];
        double boxes = 0;
        for (std::uint32_t step = 0; step < TileSteps::kPerAxis; ++step)
            boxes += ofAxis[step];
        double before = 0;
        double end = boxes / tiles;  // of the boxes in this tile and in the previous ones
        std::uint32_t tile = 0, first = 0, longest = 0;
        plan->low[axis][0] = plan->steps.origin[axis];
        for (std::uint32_t step = 0; step < TileSteps::kPerAxis; ++step)
        {
            if (tile + 1 < tiles && before + 0.5 * ofAxis[step] >= end)
            {
                ++tile;
                end = boxes * (tile + 1) / tiles;
                plan->low[axis][tile] = static_cast<float>(plan->steps.origin[axis] + step * length);
                longest = step - first > longest ? step - first : longest;
                first = step;
            }
            plan->ofStep[axis][step] = static_cast<std::uint8_t>(tile);
            before += ofAxis[step];
        }
        longest = TileSteps::kPerAxis - first > longest ? TileSteps::kPerAxis - first : longest;
        return static_cast<float>(longest * length);
    }

    CULLET_HOST_DEVICE void setCells(std::uint64_t axis, float longest) const
    {
        constexpr float kQuanta = 1u << TilePlan::kCellShift;
        const std::uint32_t most = axis == 2 ? kMostCellsOfV : kMostCells;
        const float fine = TilePlan::kMostQuanta / plan->limit;
        const float cells = longest * fine / kQuanta;
        const std::uint32_t count =
            cells < static_cast<float>(most - 1) ? 1 + static_cast<std::uint32_t>(cells) : most;
        const float fitting = (kQuanta * static_cast<float>(count) - 0.5f) / longest;
        plan->cells[axis] = count;
        plan->scale[axis] = fitting < fine ? fitting : fine;
        plan->reach[axis] = 1 + static_cast<std::uint32_t>(plan->limit * plan->scale[axis] + 0.01f);
    }
};

/// Counts the boxes of a sample in their tiles.
struct CountTiles
{
    // Atomics on one cache line are served one after the other, so that each counter has its own line.
    static constexpr std::uint32_t kCounterStride = 32;

    TileSample sample;
    const TilePlan* plan;
    std::uint32_t* counts;  ///< [TileShape::kMostTiles * kCounterStride] 0 before

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        SortRecord box;
        if (sample.accept(i, *plan, box))
            tilesOf(plan->steps, plan->ofStep[0], box)
                .forEach(plan->steps, [&](std::uint32_t tile, std::uint32_t)
                         { fetchAdd(&counts[tile * kCounterStride], 1u); });
    }
};

/// Finds the fullest tile of the sample. One index for each tile.
struct FindFullest
{
    const std::uint32_t* counts;
    TilePlan* plan;

    CULLET_HOST_DEVICE void operator()(std::uint64_t tile) const
    {
        if (tile >= plan->shape.tiles)
            return;
        const std::uint32_t count = counts[tile * CountTiles::kCounterStride];
        fetchAdd(&plan->entries, count);
        atomicMaxFloat(&plan->fullestBits, static_cast<float>(count));
    }
};

/// Chooses the room of a tile, and decides whether tiles pay. The result is one word, so that the CPU reads all of it
/// or nothing. One index.
struct ChooseTileRoom
{
    static constexpr double kMostEntries = 1.6;  ///< of a box, on average
    // Room for the boxes that tiles gain in later frames.
    static constexpr double kHeadroom = 1.2;
    static constexpr double kLeastHeadroom = 1.05;

    std::uint64_t samples;
    double stride;
    double mostRoom;
    bool isForced;
    TilePlan* plan;
    std::uint32_t launches;  ///< number of the plan
    std::uint64_t* word;     ///< [out]

    CULLET_HOST_DEVICE void operator()(std::uint64_t) const
    {
        TileShape& shape = plan->shape;
        const double fullest = stride * floatOf(plan->fullestBits) + 1;
        const double room = kHeadroom * fullest + 32;
        const bool isFit = kLeastHeadroom * fullest <= mostRoom &&
                           plan->entries <= kMostEntries * static_cast<double>(samples);
        shape.cells = plan->cells[0] * plan->cells[1] * plan->cells[2];
        shape.room = static_cast<std::uint32_t>(room < mostRoom ? room : mostRoom);
        if (shape.tiles == 0 || !(isFit || isForced))
            shape = {};
        *word = wordOf(shape, launches);
    }

    CULLET_HOST_DEVICE static std::uint64_t wordOf(const TileShape& shape, std::uint32_t launches)
    {
        return std::uint64_t{launches & 0xffffu} << 48 | std::uint64_t{shape.cells} << 32 |
               std::uint64_t{shape.room} << 16 | shape.tiles;
    }
    static TileShape shapeOf(std::uint64_t word)
    {
        const auto part = [word](int shift) { return static_cast<std::uint32_t>(word >> shift & 0xffffu); };
        return {part(0), part(16), part(32)};
    }
    static bool isOf(std::uint64_t word, std::uint32_t launches)
    {
        return word >> 48 == (launches & 0xffffu);
    }
};
}  // namespace cullet::psap
