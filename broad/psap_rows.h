// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/psap_pairs.h"
#include "broad/psap_statistics.h"

#include <cstdint>

/// The fast search: the same subdivision of the two other axes, but each box is written once, into the cell of its
/// minimum corner on the level of its size, and each cell is cut along the sweep axis into bins, so that a counting sort
/// replaces the radix sort. A box looks for partners in the cells around it on its own level and on all coarser ones.
///
/// Any plan gives the same pairs: cells wrap around, bins are clamped, and both are monotone before that. A plan made
/// for another frame, or from a sample, costs time only.
namespace cullet::psap
{
inline constexpr std::uint32_t kMostLevels = 12;
inline constexpr std::uint32_t kNoBin = 0xffffffffu;

/// The cells of boxes of similar size.
struct RowLevel
{
    float limit;               ///< longest side of a box on this level
    float reach;               ///< a little more: how far before a box its partners' minima may lie
    float inverse;             ///< 1 / width of a cell
    float inverseBin;          ///< 1 / length of a bin
    std::uint32_t firstBin;    ///< bins of all finer levels
    float countU, countV;      ///< cells, before they repeat
    float inverseU, inverseV;  ///< 1 / those
    std::uint32_t binCount;    ///< bins per cell
};

struct RowPlan
{
    Axes axes;
    float originS, originU, originV;
    std::uint32_t levelCount;
    std::uint32_t binCount;  ///< of all levels
    RowLevel levels[kMostLevels];
};

/// Cell coordinate wrapped into [0, count).
CULLET_HOST_DEVICE inline std::uint32_t wrapped(float cell, float count, float inverseCount)
{
    float rest = cell - count * floorf(cell * inverseCount);
    // The product may have been rounded across a whole number.
    rest = rest < 0.0f ? rest + count : rest;
    rest = rest >= count ? rest - count : rest;
    return static_cast<std::uint32_t>(rest);
}

CULLET_HOST_DEVICE inline std::uint32_t binAlong(const RowPlan& plan, const RowLevel& level, float s)
{
    const float bin = cellOf(s, plan.originS, level.inverseBin);
    const float last = static_cast<float>(level.binCount - 1);
    return static_cast<std::uint32_t>(bin < 0.0f ? 0.0f : bin > last ? last : bin);
}

/// How many bins a search over so many boxes has room for, whatever the plan.
inline std::uint64_t binCapacityFor(std::uint64_t boxes, float binsPerBox)
{
    return static_cast<std::uint64_t>(binsPerBox * static_cast<float>(boxes)) + 64 * kMostLevels + 256;
}

/// Chooses axis, levels, cells and bins from the statistics. One index.
struct PlanRows
{
    const Moments* moments;
    const SizeClasses* sizes;
    PsapAxis axis;
    std::uint32_t octavesPerLevel;
    float cellScale;  ///< width of a cell in longest sides of its level
    float binScale;   ///< length of a bin, likewise
    std::uint64_t binCapacity;
    RowPlan* plan;

    CULLET_HOST_DEVICE void operator()(std::uint64_t) const
    {
        const Moments& sums = *moments;
        plan->axes = chooseAxes(sums, axis);
        const bool isEmpty = sums.count == 0;
        plan->originS = isEmpty ? 0.0f : sums.low[plan->axes.s];
        plan->originU = isEmpty ? 0.0f : sums.low[plan->axes.u];
        plan->originV = isEmpty ? 0.0f : sums.low[plan->axes.v];
        std::uint32_t counts[kMostLevels];
        chooseLevels(counts);
        std::uint32_t firstBin = 0;
        for (std::uint32_t k = 0; k < plan->levelCount; ++k)
        {
            RowLevel& level = plan->levels[k];
            level.firstBin = firstBin;
            const double share =
                isEmpty ? 0.0 : static_cast<double>(counts[k]) / static_cast<double>(sums.count);
            const double room = static_cast<double>(binCapacity - 64 * kMostLevels);
            chooseCells(level, 64 + room * share);
            firstBin += static_cast<std::uint32_t>(level.countU) * static_cast<std::uint32_t>(level.countV) *
                        level.binCount;
        }
        plan->binCount = firstBin;
    }

private:
    /// Groups size classes into levels, coarsest first, then turns them around. One more level, four times as coarse as
    /// the coarsest, takes boxes that a sample missed.
    CULLET_HOST_DEVICE void chooseLevels(std::uint32_t* counts) const
    {
        std::uint64_t remaining = 0;
        for (std::uint32_t octave = 0; octave < kOctaves; ++octave)
            remaining += sizes->count[octave];
        const std::uint64_t total = remaining;
        float limits[kMostLevels];
        std::uint32_t levels = 1;
        limits[0] = 0;
        counts[0] = 0;
        std::uint32_t top = kOctaves;
        while (remaining != 0 && levels < kMostLevels)
        {
            while (sizes->count[top - 1] == 0)
                --top;
            limits[levels] = floatOf(sizes->largestBits[top - 1]);
            std::uint64_t taken = 0;
            // The last few, wherever they are, are not worth a level of their own.
            for (std::uint32_t taker = 0; top > 0 && remaining != 0; ++taker)
            {
                const bool isSpread = taker >= octavesPerLevel;
                if (isSpread && levels + 1 < kMostLevels && remaining > total / 64)
                    break;
                --top;
                taken += sizes->count[top];
                remaining -= sizes->count[top];
            }
            counts[levels] = static_cast<std::uint32_t>(taken);
            ++levels;
        }
        limits[0] = 4 * (levels > 1 ? limits[1] : 1.0f);
        plan->levelCount = levels;
        for (std::uint32_t k = 0; k < levels; ++k)
        {
            // Sides of equal boxes differ by rounding; a little room keeps them on one level.
            const float limit = limits[levels - 1 - k] * 1.001f;
            plan->levels[k].limit = limit > 1e-20f ? limit : 1e-20f;
        }
        for (std::uint32_t k = 0; k < levels / 2; ++k)
        {
            const std::uint32_t swapped = counts[k];
            counts[k] = counts[levels - 1 - k];
            counts[levels - 1 - k] = swapped;
        }
    }

    CULLET_HOST_DEVICE void chooseCells(RowLevel& level, double room) const
    {
        const Moments& sums = *moments;
        const Axes axes = plan->axes;
        double width = static_cast<double>(cellScale) * level.limit;
        double length = static_cast<double>(binScale) * level.limit;
        double countU = cells(side(sums, axes.u), width);
        double countV = cells(side(sums, axes.v), width);
        double countS = cells(side(sums, axes.s), length);
        // Larger cells up to a point, then repeating ones: far corners of the scene share cells.
        const double excess = cbrt(countU * countV * countS / room);
        if (excess > 1)
        {
            const double growth = excess < 2 ? excess : 2;
            width *= growth;
            length *= growth;
            countU = cells(side(sums, axes.u), width);
            countV = cells(side(sums, axes.v), width);
            countS = cells(side(sums, axes.s), length);
        }
        while (countU * countV * countS > room && countU * countV * countS > 1)
        {
            double* most = countU > countV ? &countU : &countV;
            most = countS > *most ? &countS : most;
            *most = floor((*most + 1) / 2);
        }
        level.reach = level.limit * 1.001f;
        level.inverse = static_cast<float>(1.0 / width);
        level.countU = static_cast<float>(countU);
        level.countV = static_cast<float>(countV);
        level.inverseU = 1.0f / level.countU;
        level.inverseV = 1.0f / level.countV;
        level.binCount = static_cast<std::uint32_t>(countS);
        const double inverseBin = countS / side(sums, axes.s);
        level.inverseBin =
            inverseBin < 1.0 / length ? static_cast<float>(inverseBin) : static_cast<float>(1.0 / length);
    }

    CULLET_HOST_DEVICE static double side(const Moments& sums, std::uint32_t axis)
    {
        return sums.count == 0 ? 0.0 : static_cast<double>(sums.high[axis]) - sums.low[axis];
    }

    CULLET_HOST_DEVICE static double cells(double side, double width)
    {
        const double count = floor(side / width) + 1;
        return count >= 1 ? (count < 1048576.0 ? count : 1048576.0) : 1.0;
    }
};

/// Where box i goes.
struct RowPlace
{
    std::uint32_t bin;   ///< kNoBin: nowhere
    std::uint32_t rank;  ///< in the bin, in the order of arrival
};

/// Step 1: finds the bin of box i and its rank there. Boxes without a level go to the side list.
struct CountRows
{
    const Aabb* boxes;
    const RowPlan* plan;
    RowPlace* places;          ///< [boxes, out]
    std::uint32_t* binCounts;  ///< [bins] 0 before
    std::uint32_t* side;       ///< [boxes, out]
    std::uint32_t* sideCount;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const Aabb box = boxes[i];
        places[i].bin = kNoBin;
        if (!isValid(box))
            return;
        const float extent = boundedExtent(box);
        std::uint32_t k = 0;
        while (k < plan->levelCount && !(extent <= plan->levels[k].limit))
            ++k;
        if (k == plan->levelCount)
        {
            side[fetchAdd(sideCount, 1u)] = static_cast<std::uint32_t>(i);
            return;
        }
        const RowLevel& level = plan->levels[k];
        const Axes axes = plan->axes;
        const float u = cellOf(box.min[axes.u], plan->originU, level.inverse);
        const float v = cellOf(box.min[axes.v], plan->originV, level.inverse);
        const std::uint32_t cell =
            wrapped(v, level.countV, level.inverseV) * static_cast<std::uint32_t>(level.countU) +
            wrapped(u, level.countU, level.inverseU);
        const std::uint32_t bin =
            level.firstBin + cell * level.binCount + binAlong(*plan, level, box.min[axes.s]);
        places[i] = {bin, fetchAdd(&binCounts[bin], 1u)};
    }
};

/// A box as the search reads it: 32 bytes, sweep axis and first other axis in one half.
struct alignas(16) RowRecord
{
    float s0, s1, u0, u1;
    float v0, v1;
    std::uint32_t row;
    std::uint32_t bin;
};

/// Step 3: writes the record of box i to its place.
struct ScatterRows
{
    const Aabb* boxes;
    const RowPlan* plan;
    const RowPlace* places;
    const std::uint32_t* binStarts;  ///< exclusive scan of the counts
    RowRecord* records;              ///< [boxes, out]

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const RowPlace place = places[i];
        if (place.bin == kNoBin)
            return;
        const Aabb box = boxes[i];
        const Axes axes = plan->axes;
        records[binStarts[place.bin] + place.rank] = {box.min[axes.s],
                                                      box.max[axes.s],
                                                      box.min[axes.u],
                                                      box.max[axes.u],
                                                      box.min[axes.v],
                                                      box.max[axes.v],
                                                      static_cast<std::uint32_t>(i),
                                                      place.bin};
    }
};

/// Step 4: finds the partners of record i: those behind it, in the cells around it, on its level and coarser ones; and
/// those on the side list. The records behind the last one stand for the boxes on the side list.
///
/// Both boxes of a pair on one level see each other, so "behind it" makes one of them report it; of two levels the
/// finer one reports.
struct SearchRows
{
    const RowRecord* records;
    const std::uint32_t* binStarts;  ///< [binCapacity + 1]
    std::uint64_t binCapacity;
    const RowPlan* plan;
    const Aabb* boxes;
    const std::uint32_t* side;
    const std::uint32_t* sideCount;
    EntryTest isNew;

    template <class Emit>
    CULLET_HOST_DEVICE void operator()(std::uint64_t i, Emit& emit) const
    {
        const std::uint32_t recordCount = binStarts[binCapacity];
        if (i >= recordCount)
        {
            const std::uint64_t k = i - recordCount;
            if (k < *sideCount)
                searchSide(side[k], static_cast<std::uint32_t>(k) + 1, emit);
            return;
        }
        const RowRecord self = records[i];
        std::uint32_t k = 0;
        while (k + 1 < plan->levelCount && self.bin >= plan->levels[k + 1].firstBin)
            ++k;
        searchLevel(self, plan->levels[k], static_cast<std::uint32_t>(i) + 1, emit);
        for (++k; k < plan->levelCount; ++k)
        {
            const std::uint32_t first = plan->levels[k].firstBin;
            const std::uint32_t last =
                k + 1 < plan->levelCount ? plan->levels[k + 1].firstBin : plan->binCount;
            if (binStarts[first] != binStarts[last])
                searchLevel(self, plan->levels[k], 0, emit);
        }
        searchSide(self.row, 0, emit);
    }

private:
    template <class Emit>
    CULLET_HOST_DEVICE void searchLevel(const RowRecord& self, const RowLevel& level, std::uint32_t behind,
                                        Emit& emit) const
    {
        // A partner's minimum is at most `reach` before this box: rounding is monotone, so that holds exactly.
        const float u0 = cellOf(self.u0 - level.reach, plan->originU, level.inverse);
        const float v0 = cellOf(self.v0 - level.reach, plan->originV, level.inverse);
        float countU = cellOf(self.u1, plan->originU, level.inverse) - u0 + 1.0f;
        float countV = cellOf(self.v1, plan->originV, level.inverse) - v0 + 1.0f;
        countU = countU < level.countU ? countU : level.countU;
        countV = countV < level.countV ? countV : level.countV;
        const std::uint32_t bin0 = binAlong(*plan, level, self.s0 - level.reach);
        const std::uint32_t bin1 = binAlong(*plan, level, self.s1);
        const std::uint32_t sizeU = static_cast<std::uint32_t>(level.countU);
        const std::uint32_t sizeV = static_cast<std::uint32_t>(level.countV);
        const std::uint32_t firstU = wrapped(u0, level.countU, level.inverseU);
        std::uint32_t v = wrapped(v0, level.countV, level.inverseV);
        for (float kv = 0; kv < countV; kv += 1.0f)
        {
            std::uint32_t u = firstU;
            for (float ku = 0; ku < countU; ku += 1.0f)
            {
                const std::uint32_t cell = level.firstBin + (v * sizeU + u) * level.binCount;
                // Cells before its own hold nothing that is behind it.
                if (behind == 0 || cell + bin1 >= self.bin)
                {
                    const std::uint32_t begin = binStarts[cell + bin0];
                    const std::uint32_t end = binStarts[cell + bin1 + 1];
                    scan(self, begin > behind ? begin : behind, end, emit);
                }
                u = u + 1 == sizeU ? 0 : u + 1;
            }
            v = v + 1 == sizeV ? 0 : v + 1;
        }
    }

    template <class Emit>
    CULLET_HOST_DEVICE void scan(const RowRecord& self, std::uint32_t begin, std::uint32_t end,
                                 Emit& emit) const
    {
        for (std::uint32_t j = begin; j < end; ++j)
        {
            const RowRecord other = records[j];
            if (self.s0 <= other.s1 && other.s0 <= self.s1 && self.u0 <= other.u1 && other.u0 <= self.u1 &&
                self.v0 <= other.v1 && other.v0 <= self.v1)
            {
                const IdPair pair = {self.row, other.row};
                if (isNew(pair))
                    emit.push(pair);
            }
        }
        emit.tested(end > begin ? end - begin : 0);
    }

    template <class Emit>
    CULLET_HOST_DEVICE void searchSide(std::uint32_t row, std::uint32_t begin, Emit& emit) const
    {
        const std::uint32_t count = *sideCount;
        for (std::uint32_t k = begin; k < count; ++k)
        {
            const IdPair pair = {row, side[k]};
            if (overlaps(boxes[row], boxes[pair.b]) && isNew(pair))
                emit.push(pair);
        }
        emit.tested(count > begin ? count - begin : 0);
    }
};
}  // namespace cullet::psap
