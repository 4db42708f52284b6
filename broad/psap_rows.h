// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/psap_pairs.h"
#include "broad/psap_row_plan.h"

#include <cmath>
#include <cstdint>

/// The fast search: the same subdivision of the two other axes, but each box is written once, into the cell of its
/// minimum corner on the level of its size, and each cell is cut along the sweep axis into bins, so that a counting sort
/// replaces the radix sort. A box looks for partners in the cells around it on its own level and on all coarser ones.
///
/// Any plan gives the same pairs: cells wrap around, bins are clamped, and both are monotone before that. A plan made
/// for another frame, or from a sample, costs time only.
namespace cullet::psap
{
inline constexpr std::uint32_t kNoBin = 0xffffffffu;

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

/// Where box i goes.
struct alignas(8) RowPlace
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
        const Aabb box = loadBox(boxes, i);
        const std::uint32_t bin = isValid(box) ? binOf(box) : kNoBin;
        if (bin < kNoLevel)
            places[i] = {bin, fetchAdd(&binCounts[bin], 1u)};
        else
            places[i] = {kNoBin, 0};
        if (bin == kNoLevel)
            side[fetchAdd(sideCount, 1u)] = static_cast<std::uint32_t>(i);
    }

private:
    static constexpr std::uint32_t kNoLevel = kNoBin - 1;

    CULLET_HOST_DEVICE std::uint32_t binOf(const Aabb& box) const
    {
        const float extent = boundedExtent(box);
        std::uint32_t k = 0;
        while (k < plan->levelCount && !(extent <= plan->levels[k].limit))
            ++k;
        if (k == plan->levelCount)
            return kNoLevel;
        const RowLevel& level = plan->levels[k];
        const Axes axes = plan->axes;
        const float u = cellOf(along(box.min, axes.u), plan->originU, level.inverse);
        const float v = cellOf(along(box.min, axes.v), plan->originV, level.inverse);
        const std::uint32_t cell =
            wrapped(v, level.countV, level.inverseV) * static_cast<std::uint32_t>(level.countU) +
            wrapped(u, level.countU, level.inverseU);
        return level.firstBin + cell * level.binCount + binAlong(*plan, level, along(box.min, axes.s));
    }
};

/// A box as the search reads it: 16 bytes that decide most tests, and 16 more.
struct alignas(16) RowRecord
{
    struct alignas(16) Front
    {
        float s0, s1, u0, u1;
    };
    struct alignas(16) Back
    {
        float v0, v1;
        std::uint32_t row;
        std::uint32_t bin;
    };
    Front front;
    Back back;
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
        const Aabb box = loadBox(boxes, i);
        const Axes axes = plan->axes;
        const RowRecord::Front front = {along(box.min, axes.s), along(box.max, axes.s),
                                        along(box.min, axes.u), along(box.max, axes.u)};
        const RowRecord::Back back = {along(box.min, axes.v), along(box.max, axes.v),
                                      static_cast<std::uint32_t>(i), place.bin};
        records[binStarts[place.bin] + place.rank] = {front, back};
    }
};

/// Records that one box has to be tested against, as ranges.
///
/// Collecting the ranges of all rows first and then walking through them in one loop keeps the lanes of a warp together:
/// each has some records in some of its rows, but nearly as many in all as its neighbours.
struct RowRanges
{
    static constexpr std::uint32_t kCapacity = 32;

    struct alignas(8) Range
    {
        std::uint32_t begin, end;
    };

    std::uint32_t count = 0;
    Range ranges[kCapacity];

    CULLET_HOST_DEVICE bool isFull() const { return count == kCapacity; }

    CULLET_HOST_DEVICE void add(std::uint32_t begin, std::uint32_t end)
    {
        if (begin < end)
            ranges[count++] = {begin, end};
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
        RowRanges ranges;
        std::uint32_t k = 0;
        while (k + 1 < plan->levelCount && self.back.bin >= plan->levels[k + 1].firstBin)
            ++k;
        searchLevel(self, plan->levels[k], static_cast<std::uint32_t>(i) + 1, ranges, emit);
        for (++k; k < plan->levelCount; ++k)
        {
            const std::uint32_t first = plan->levels[k].firstBin;
            const std::uint32_t last =
                k + 1 < plan->levelCount ? plan->levels[k + 1].firstBin : plan->binCount;
            if (binStarts[first] != binStarts[last])
                searchLevel(self, plan->levels[k], 0, ranges, emit);
        }
        scan(self, ranges, emit);
        searchSide(self.back.row, 0, emit);
    }

private:
    template <class Emit>
    CULLET_HOST_DEVICE void searchLevel(const RowRecord& self, const RowLevel& level, std::uint32_t behind,
                                        RowRanges& ranges, Emit& emit) const
    {
        // A partner's minimum is at most `reach` before this box: rounding is monotone, so that holds exactly.
        const float u0 = cellOf(self.front.u0 - level.reach, plan->originU, level.inverse);
        const float v0 = cellOf(self.back.v0 - level.reach, plan->originV, level.inverse);
        float countU = cellOf(self.front.u1, plan->originU, level.inverse) - u0 + 1.0f;
        float countV = cellOf(self.back.v1, plan->originV, level.inverse) - v0 + 1.0f;
        countU = countU < level.countU ? countU : level.countU;
        countV = countV < level.countV ? countV : level.countV;
        const std::uint32_t bin0 = binAlong(*plan, level, self.front.s0 - level.reach);
        const std::uint32_t bin1 = binAlong(*plan, level, self.front.s1);
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
                if (behind == 0 || cell + bin1 >= self.back.bin)
                {
                    const std::uint32_t begin = binStarts[cell + bin0];
                    ranges.add(begin > behind ? begin : behind, binStarts[cell + bin1 + 1]);
                    if (ranges.isFull())
                        scan(self, ranges, emit);
                }
                u = u + 1 == sizeU ? 0 : u + 1;
            }
            v = v + 1 == sizeV ? 0 : v + 1;
        }
    }

    /// Tests the records of the ranges and empties the list.
    template <class Emit>
    CULLET_HOST_DEVICE void scan(const RowRecord& self, RowRanges& ranges, Emit& emit) const
    {
        std::uint32_t j = 0;
        std::uint32_t end = 0;
        std::uint32_t next = 0;
        std::uint32_t tests = 0;
        while (true)
        {
            if (j == end)
            {
                if (next == ranges.count)
                    break;
                j = ranges.ranges[next].begin;
                end = ranges.ranges[next].end;
                ++next;
            }
            const RowRecord::Front front = records[j].front;
            if (self.front.s0 <= front.s1 && front.s0 <= self.front.s1 && self.front.u0 <= front.u1 &&
                front.u0 <= self.front.u1)
                testBack(self, records[j].back, emit);
            ++j;
            ++tests;
        }
        ranges.count = 0;
        emit.tested(tests);
    }

    template <class Emit>
    CULLET_HOST_DEVICE void testBack(const RowRecord& self, const RowRecord::Back back, Emit& emit) const
    {
        const IdPair pair = {self.back.row, back.row};
        if (self.back.v0 <= back.v1 && back.v0 <= self.back.v1 && isNew(pair))
            emit.push(pair);
    }

    template <class Emit>
    CULLET_HOST_DEVICE void searchSide(std::uint32_t row, std::uint32_t begin, Emit& emit) const
    {
        const std::uint32_t count = *sideCount;
        for (std::uint32_t k = begin; k < count; ++k)
        {
            const IdPair pair = {row, side[k]};
            if (overlaps(loadBox(boxes, row), loadBox(boxes, pair.b)) && isNew(pair))
                emit.push(pair);
        }
        emit.tested(count > begin ? count - begin : 0);
    }
};
}  // namespace cullet::psap
