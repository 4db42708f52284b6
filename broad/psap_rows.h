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
CULLET_HOST_DEVICE inline std::uint32_t wrapped(std::int32_t cell, std::uint32_t count)
{
    // Most cells are where the plan expects them.
    if (static_cast<std::uint32_t>(cell) < count)
        return static_cast<std::uint32_t>(cell);
    const std::int32_t rest = cell % static_cast<std::int32_t>(count);
    return static_cast<std::uint32_t>(rest < 0 ? rest + static_cast<std::int32_t>(count) : rest);
}

CULLET_HOST_DEVICE inline std::uint32_t binAlong(const RowPlan& plan, const RowLevel& level, float s)
{
    const std::int32_t bin = cellOf(s, plan.originS, level.inverseBin);
    const std::int32_t last = static_cast<std::int32_t>(level.binCount) - 1;
    return static_cast<std::uint32_t>(bin < 0 ? 0 : bin > last ? last : bin);
}

/// Where box i goes.
struct alignas(8) RowPlace
{
    std::uint32_t bin;   ///< kNoBin: nowhere
    std::uint32_t rank;  ///< in the bin, in the order of arrival
};

/// What the search needs to know of all records. Aligned, so that a GPU reads it at once.
struct alignas(16) RowTotals
{
    std::uint32_t sidesFound;  ///< boxes on the side list so far; 0 when an update begins
    std::uint32_t sides;       ///< boxes on the side list
    std::uint32_t records;
    std::uint32_t levels;  ///< the coarser ones are empty
};

/// What is made ready on the way, since a launch of its own would take longer. One index does it, between the steps that
/// find the bins and the search.
struct RowTidying
{
    RowTotals* totals;
    std::uint64_t* pairCount;  ///< set to 0; may be null

    CULLET_HOST_DEVICE void operator()() const
    {
        totals->sides = totals->sidesFound;
        totals->sidesFound = 0;
        if (pairCount != nullptr)
            *pairCount = 0;
    }
};

/// Finds the bin of a box.
struct RowBins
{
    const Aabb* boxes;
    const RowPlan* plan;
    std::uint32_t* side;  ///< [boxes, out]
    RowTotals* totals;

    /// @return kNoBin for boxes without a level, which go to the side list, and for invalid ones
    CULLET_HOST_DEVICE std::uint32_t take(std::uint64_t i) const
    {
        const Aabb box = loadBox(boxes, i);
        const std::uint32_t bin = isValid(box) ? binOf(box) : kNoBin;
        if (bin != kNoLevel)
            return bin;
        side[fetchAdd(&totals->sidesFound, 1u)] = static_cast<std::uint32_t>(i);
        return kNoBin;
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
        const std::int32_t u = cellOf(along(box.min, axes.u), plan->originU, level.inverse);
        const std::int32_t v = cellOf(along(box.min, axes.v), plan->originV, level.inverse);
        const std::uint32_t cell = wrapped(v, level.countV) * level.countU + wrapped(u, level.countU);
        return level.firstBin + cell * level.binCount + binAlong(*plan, level, along(box.min, axes.s));
    }
};

/// Step 1: finds the bin of box i and its rank there.
struct CountRows
{
    RowBins bins;
    RowPlace* places;          ///< [boxes, out]
    std::uint32_t* binCounts;  ///< [bins] 0 before

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const std::uint32_t bin = bins.take(i);
        places[i] = {bin, bin == kNoBin ? 0 : fetchAdd(&binCounts[bin], 1u)};
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

CULLET_HOST_DEVICE inline RowRecord recordOf(const Aabb& box, const Axes& axes, std::uint32_t row,
                                             std::uint32_t bin)
{
    return {{along(box.min, axes.s), along(box.max, axes.s), along(box.min, axes.u), along(box.max, axes.u)},
            {along(box.min, axes.v), along(box.max, axes.v), row, bin}};
}

/// records[place] = record, or nothing for kNoPlace. On a GPU two lanes write their two records together, each half of
/// either: whole sectors of 32 bytes, where half of one would cost as much.
inline constexpr std::uint32_t kNoPlace = 0xffffffffu;
CULLET_HOST_DEVICE inline void storeRecord(RowRecord* records, std::uint32_t place, const RowRecord& record)
{
#ifdef __CUDA_ARCH__
    constexpr unsigned kAll = 0xffffffffu;
    if (__activemask() == kAll)
    {
        const bool isSecond = threadIdx.x % 2 != 0;
        const auto front = reinterpret_cast<const float4&>(record.front);
        const auto back = reinterpret_cast<const float4&>(record.back);
        const float4 mine = isSecond ? back : front;
        const float4 given = isSecond ? front : back;
        const float4 taken = {__shfl_xor_sync(kAll, given.x, 1), __shfl_xor_sync(kAll, given.y, 1),
                              __shfl_xor_sync(kAll, given.z, 1), __shfl_xor_sync(kAll, given.w, 1)};
        const std::uint32_t other = __shfl_xor_sync(kAll, place, 1);
        const std::uint32_t first = isSecond ? other : place;
        const std::uint32_t second = isSecond ? place : other;
        float4* halves = reinterpret_cast<float4*>(records) + (isSecond ? 1 : 0);
        if (first != kNoPlace)
            halves[2 * std::uint64_t{first}] = isSecond ? taken : mine;
        if (second != kNoPlace)
            halves[2 * std::uint64_t{second}] = isSecond ? mine : taken;
        return;
    }
#endif
    if (place != kNoPlace)
        records[place] = record;
}

/// Step 3: writes the record of box i to its place.
struct ScatterRows
{
    const Aabb* boxes;
    const RowPlan* plan;
    const RowPlace* places;
    const std::uint32_t* binStarts;  ///< [binCapacity + 1] exclusive scan of the counts
    std::uint64_t binCapacity;
    RowRecord* records;  ///< [boxes, out]
    RowTidying tidy;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        if (i == 0)
            total();
        const RowPlace place = places[i];
        storeRecord(records, place.bin == kNoBin ? kNoPlace : binStarts[place.bin] + place.rank,
                    recordOf(loadBox(boxes, i), plan->axes, static_cast<std::uint32_t>(i), place.bin));
    }

private:
    CULLET_HOST_DEVICE void total() const
    {
        tidy();
        const std::uint32_t count = binStarts[binCapacity];
        std::uint32_t levels = 0;
        while (levels < plan->levelCount && binStarts[plan->levels[levels].firstBin] < count)
            ++levels;
        tidy.totals->records = count;
        tidy.totals->levels = levels;
    }
};

/// Step 1 with a radix sort: writes the bin of box i as its key.
struct FillRowKeys
{
    RowBins bins;
    std::uint32_t none;   ///< larger than any bin
    std::uint32_t* keys;  ///< [boxes, out]
    std::uint32_t* rows;  ///< [boxes, out]

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const std::uint32_t bin = bins.take(i);
        keys[i] = bin == kNoBin ? none : bin;
        rows[i] = static_cast<std::uint32_t>(i);
    }
};

/// Step 3 with a radix sort: writes record i, and where its bin ends if it is the last one there.
struct GatherRows
{
    const Aabb* boxes;
    const RowPlan* plan;
    const std::uint32_t* keys;  ///< [count] sorted
    const std::uint32_t* rows;
    std::uint64_t count;
    std::uint32_t none;
    RowRecord* records;   ///< [count, out]
    std::uint32_t* ends;  ///< [bins + 1] 0 before; that of a bin lies one behind it
    RowTidying tidy;

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const std::uint32_t bin = keys[i];
        storeRecord(records, bin == none ? kNoPlace : static_cast<std::uint32_t>(i),
                    recordOf(loadBox(boxes, rows[i]), plan->axes, rows[i], bin));
        if (i == 0)
        {
            tidy();
            if (bin == none)
                setTotals(0, 0);
        }
        if (bin == none)
            return;
        const std::uint32_t next = i + 1 == count ? none : keys[i + 1];
        if (next == bin)
            return;
        ends[bin + 1] = static_cast<std::uint32_t>(i) + 1;
        if (next == none)
            setTotals(static_cast<std::uint32_t>(i) + 1, levelsUpTo(bin));
    }

private:
    CULLET_HOST_DEVICE void setTotals(std::uint32_t recordCount, std::uint32_t levelCount) const
    {
        tidy.totals->records = recordCount;
        tidy.totals->levels = levelCount;
    }

    CULLET_HOST_DEVICE std::uint32_t levelsUpTo(std::uint32_t bin) const
    {
        std::uint32_t levels = 0;
        while (levels < plan->levelCount && plan->levels[levels].firstBin <= bin)
            ++levels;
        return levels;
    }
};

CULLET_HOST_DEVICE inline bool meets(const RowRecord& a, const RowRecord& b)
{
    // Not &&: six comparisons are cheaper than a branch that lanes take apart.
    return (a.front.s0 <= b.front.s1) & (b.front.s0 <= a.front.s1) & (a.front.u0 <= b.front.u1) &
           (b.front.u0 <= a.front.u1) & (a.back.v0 <= b.back.v1) & (b.back.v0 <= a.back.v1);
}

/// What two intervals share; negative when they are apart.
CULLET_HOST_DEVICE inline float sharedLength(float a0, float a1, float b0, float b1)
{
    return (a1 < b1 ? a1 : b1) - (a0 > b0 ? a0 : b0);
}

/// overlapOf() two boxes.
CULLET_HOST_DEVICE inline float overlapOf(const RowRecord& a, const RowRecord& b)
{
    const float s = sharedLength(a.front.s0, a.front.s1, b.front.s0, b.front.s1);
    const float u = sharedLength(a.front.u0, a.front.u1, b.front.u0, b.front.u1);
    const float v = sharedLength(a.back.v0, a.back.v1, b.back.v0, b.back.v1);
    const float su = s < u ? s : u;
    return su < v ? su : v;
}

/// Some records in a row.
struct RowRange
{
    std::uint32_t begin, end;

    CULLET_HOST_DEVICE std::uint32_t size() const { return begin < end ? end - begin : 0; }
};

/// Cells of one level around a box, wrapped: `left` cells of row v from u on, then `perRow` of each later row.
struct RowCells
{
    std::uint32_t u, v;
    std::uint32_t left;
    std::uint32_t firstU;  ///< of the later rows
    std::uint32_t perRow;
    std::uint32_t count;  ///< cells in all
    std::uint32_t sizeU, sizeV;

    /// Index of the k-th cell.
    CULLET_HOST_DEVICE std::uint32_t at(std::uint32_t k) const
    {
        std::uint32_t cellU = u, cellV = v;
        if (k >= left)
        {
            k -= left;
            cellU = firstU;
            for (++cellV; k >= perRow; k -= perRow)
                ++cellV;
        }
        cellU += k;
        return (cellV < sizeV ? cellV : cellV - sizeV) * sizeU + (cellU < sizeU ? cellU : cellU - sizeU);
    }
};

/// Step 4: finds the partners of record i, in the cells around it, on its level and coarser ones; and those on the side
/// list. The records behind the last one stand for the boxes on the side list.
///
/// Of two levels the finer one reports a pair. On one level both boxes would: it is the one whose cell comes first, by
/// rows of cells that are not wrapped, and of one cell the first record. So only half of the cells around are looked at.
/// Where the cells of a level are so few that one may be wrapped onto another around the same box, all are looked at,
/// and the first record reports.
///
/// The lanes of a warp go from cell to cell together, and write out together what they found. Several indices in a row
/// may share a record, each taking some of the cells: more to do in all, and sooner done where a GPU has lanes to spare.
template <class IsNew, std::uint32_t kSharers>
struct SearchRows
{
    const RowRecord* records;        ///< one more than there are
    const std::uint32_t* binStarts;  ///< [binCapacity + 1]
    std::uint64_t binCapacity;
    const RowPlan* plan;
    const Aabb* boxes;
    const std::uint32_t* side;
    const RowTotals* allTotals;
    IsNew isNew;
    std::uint64_t boxCount;
    std::uint32_t* binCounts;  ///< [binCapacity + 1] set to 0 for the next update

    /// @param index of kSharers for each box
    /// @param isIndex false for what only fills up a warp
    template <class Emit>
    CULLET_HOST_DEVICE void operator()(std::uint64_t index, bool isIndex, Emit& emit) const
    {
        if (isIndex)
            clearBins(index);
        const std::uint64_t i = index / kSharers;
        const std::uint32_t share = static_cast<std::uint32_t>(index % kSharers);
        const RowTotals totals = *allTotals;
        const bool isRecord = isIndex && i < totals.records;
        const auto entryTest = isNew.ready();
        if (emit.any(isRecord))
            searchRecord(isRecord ? static_cast<std::uint32_t>(i) : totals.records - 1, share, isRecord,
                         totals.levels, entryTest, emit);
        if (totals.sides == 0 || !isIndex)
            return;
        if (isRecord)
            searchSide(records[i].back.row, share, totals.sides, emit);
        else if (i - totals.records < totals.sides)
            searchSide(side[i - totals.records], static_cast<std::uint32_t>(i - totals.records) + 1 + share,
                       totals.sides, emit);
    }

private:
    CULLET_HOST_DEVICE void clearBins(std::uint64_t index) const
    {
        for (std::uint64_t bin = index; bin <= binCapacity; bin += boxCount * kSharers)
            binCounts[bin] = 0;
    }

    template <class Test, class Emit>
    CULLET_HOST_DEVICE void searchRecord(std::uint32_t i, std::uint32_t share, bool isRecord,
                                         std::uint32_t levels, const Test& entryTest, Emit& emit) const
    {
        const RowRecord self = records[i];
        for (std::uint32_t k = 0; k < levels; ++k)
        {
            const RowLevel level = plan->levels[k];
            const bool isSeen = isRecord && self.back.bin < level.endBin;
            if (!emit.any(isSeen))
                continue;
            const bool isOwn = self.back.bin >= level.firstBin;
            RowCells cells = cellsAround(self, level, isOwn);
            cells.count = isSeen ? cells.count : 0;
            search(self, level, cells, share, isOwn ? i + 1 : 0, entryTest, emit);
        }
    }

    /// The cells of a level to be searched.
    CULLET_HOST_DEVICE RowCells cellsAround(const RowRecord& self, const RowLevel& level, bool isOwn) const
    {
        // A partner's minimum is at most `reach` before this box: rounding is monotone, so that holds exactly.
        const bool isAhead = isOwn && level.isRoomy != 0;
        const std::int32_t u0 = cellU(self.front.u0 - level.reach, level);
        const std::int32_t u1 = cellU(self.front.u1, level);
        const std::int32_t v1 = cellV(self.back.v1, level);
        const std::int32_t firstU = isAhead ? cellU(self.front.u0, level) : u0;
        const std::int32_t firstV = cellV(isAhead ? self.back.v0 : self.back.v0 - level.reach, level);
        RowCells cells;
        cells.sizeU = level.countU;
        cells.sizeV = level.countV;
        cells.u = wrapped(firstU, level.countU);
        cells.v = wrapped(firstV, level.countV);
        cells.firstU = wrapped(u0, level.countU);
        cells.left = cellsBetween(firstU, u1, level.countU);
        cells.perRow = cellsBetween(u0, u1, level.countU);
        cells.count = cells.left + (cellsBetween(firstV, v1, level.countV) - 1) * cells.perRow;
        return cells;
    }

    CULLET_HOST_DEVICE std::int32_t cellU(float u, const RowLevel& level) const
    {
        return cellOf(u, plan->originU, level.inverse);
    }
    CULLET_HOST_DEVICE std::int32_t cellV(float v, const RowLevel& level) const
    {
        return cellOf(v, plan->originV, level.inverse);
    }

    CULLET_HOST_DEVICE static std::uint32_t cellsBetween(std::int32_t first, std::int32_t last,
                                                         std::uint32_t most)
    {
        const std::uint32_t count = static_cast<std::uint32_t>(last - first) + 1;
        return count < most ? count : most;
    }

    /// Tests the record against those of every kSharers-th cell from `share` on.
    ///
    /// @param behind 0, or on its own level the index of the record behind this one
    template <class Test, class Emit>
    CULLET_HOST_DEVICE void search(const RowRecord& self, const RowLevel& level, const RowCells& cells,
                                   std::uint32_t share, std::uint32_t behind, const Test& entryTest,
                                   Emit& emit) const
    {
        const std::uint32_t bin0 = level.firstBin + binAlong(*plan, level, self.front.s0 - level.reach);
        const std::uint32_t bin1 = level.firstBin + binAlong(*plan, level, self.front.s1) + 1;
        const auto rangeOf = [&](std::uint32_t k) -> RowRange
        {
            if (k >= cells.count)
                return {0, 0};
            const std::uint32_t cell = cells.at(k) * level.binCount;
            const std::uint32_t begin = binStarts[cell + bin0];
            const std::uint32_t end = binStarts[cell + bin1];
            return {k == 0 || level.isRoomy == 0 ? (begin > behind ? begin : behind) : begin, end};
        };
        RowRange next = rangeOf(share);
        for (std::uint32_t k = share; emit.any(k < cells.count); k += kSharers)
        {
            const RowRange range = next;
            next = rangeOf(k + kSharers);  // on its way while this one is read
            scan(self, range, entryTest, emit);
        }
    }

    /// Finds the partners of a box on the side list among its records from `begin` on.
    template <class Emit>
    CULLET_HOST_DEVICE void searchSide(std::uint32_t row, std::uint32_t begin, std::uint32_t count,
                                       Emit& emit) const
    {
        for (std::uint32_t k = begin; k < count; k += kSharers)
        {
            const IdPair pair = {row, side[k]};
            if (overlaps(loadBox(boxes, row), loadBox(boxes, pair.b)) && isNew(pair))
                emit.push(pair);
            emit.tested(1);
        }
    }

    /// Tests the record against those of a range. First all tests of some records, then what they found: most lanes
    /// find nothing, and would wait for those that do.
    template <class Test, class Emit>
    CULLET_HOST_DEVICE void scan(const RowRecord& self, RowRange range, const Test& entryTest,
                                 Emit& emit) const
    {
        for (; emit.any(range.begin < range.end); range.begin += kTestsTogether)
        {
            const std::uint32_t count = range.size() < kTestsTogether ? range.size() : kTestsTogether;
            report(self, range.begin, hitsAmong(self, records + range.begin, count), entryTest, emit);
            emit.tested(count);
        }
    }

    /// Bit k: the record meets others[k].
    CULLET_HOST_DEVICE static std::uint32_t hitsAmong(const RowRecord& self, const RowRecord* others,
                                                      std::uint32_t count)
    {
        std::uint32_t hits = 0;
        // Two at a time, so that the second is read while the first is tested; behind the last one there is a record too.
#ifdef __CUDA_ARCH__
#pragma unroll 1
#endif
        for (std::uint32_t k = 0; k < count; k += 2)
            hits |= (meets(self, others[k]) ? 1u : 0u) << k | (meets(self, others[k + 1]) ? 2u : 0u) << k;
        return count < 32 ? hits & ((1u << count) - 1u) : hits;
    }

    template <class Test, class Emit>
    CULLET_HOST_DEVICE void report(const RowRecord& self, std::uint32_t begin, std::uint32_t hits,
                                   const Test& entryTest, Emit& emit) const
    {
        for (; emit.any(hits != 0); hits &= hits - 1)
        {
            IdPair pair = {self.back.row, 0};
            bool isEntering = hits != 0;
            if (isEntering)
            {
                const RowRecord& other = records[begin + lowestBit(hits)];
                pair.b = other.back.row;
                isEntering = entryTest(pair, [&] { return overlapOf(self, other); });
            }
            emit.append(isEntering, pair);
        }
    }

    static constexpr std::uint32_t kTestsTogether = 32;
};
}  // namespace cullet::psap
