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

/// Finds the bin of a box.
struct RowBins
{
    const Aabb* boxes;
    const RowPlan* plan;
    std::uint32_t* side;  ///< [boxes, out]
    std::uint32_t* sideCount;

    /// @return kNoBin for boxes without a level, which go to the side list, and for invalid ones
    CULLET_HOST_DEVICE std::uint32_t take(std::uint64_t i) const
    {
        const Aabb box = loadBox(boxes, i);
        const std::uint32_t bin = isValid(box) ? binOf(box) : kNoBin;
        if (bin != kNoLevel)
            return bin;
        side[fetchAdd(sideCount, 1u)] = static_cast<std::uint32_t>(i);
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
        const float u = cellOf(along(box.min, axes.u), plan->originU, level.inverse);
        const float v = cellOf(along(box.min, axes.v), plan->originV, level.inverse);
        const std::uint32_t cell =
            wrapped(v, level.countV, level.inverseV) * static_cast<std::uint32_t>(level.countU) +
            wrapped(u, level.countU, level.inverseU);
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
        if (place.bin != kNoBin)
            records[binStarts[place.bin] + place.rank] =
                recordOf(loadBox(boxes, i), plan->axes, static_cast<std::uint32_t>(i), place.bin);
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

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        const std::uint32_t bin = keys[i];
        if (bin == none)
            return;
        records[i] = recordOf(loadBox(boxes, rows[i]), plan->axes, rows[i], bin);
        if (i + 1 == count || keys[i + 1] != bin)
            ends[bin + 1] = static_cast<std::uint32_t>(i) + 1;
    }
};

CULLET_HOST_DEVICE inline bool meets(const RowRecord& a, const RowRecord& b)
{
    return a.front.s0 <= b.front.s1 && b.front.s0 <= a.front.s1 && a.front.u0 <= b.front.u1 &&
           b.front.u0 <= a.front.u1 && a.back.v0 <= b.back.v1 && b.back.v0 <= a.back.v1;
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

/// The cells of one level around a box: countU x countV of them from (u, v) on, wrapped at sizeU x sizeV; and of each
/// the bins from bin0 to bin1.
struct RowWindow
{
    std::uint32_t u, v;
    std::uint32_t countU, countV;
    std::uint32_t sizeU, sizeV;
    std::uint32_t bin0, bin1;
};

/// Walks through the cells of a window.
struct RowCell
{
    std::uint32_t u, v;
    std::uint32_t ku = 0, kv = 0;

    CULLET_HOST_DEVICE explicit RowCell(const RowWindow& window) : u(window.u), v(window.v) {}

    CULLET_HOST_DEVICE bool isEnd(const RowWindow& window) const { return kv >= window.countV; }

    CULLET_HOST_DEVICE void advance(const RowWindow& window)
    {
        u = u + 1 == window.sizeU ? 0 : u + 1;
        if (++ku < window.countU)
            return;
        ku = 0;
        u = window.u;
        ++kv;
        v = v + 1 == window.sizeV ? 0 : v + 1;
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
        std::uint32_t k = levelOf(self);
        searchLevel(self, plan->levels[k], static_cast<std::uint32_t>(i) + 1, emit);
        for (++k; k < plan->levelCount; ++k)
        {
            if (!isEmptyLevel(k))
                searchLevel(self, plan->levels[k], 0, emit);
        }
        searchSide(self.back.row, 0, emit);
    }

private:
    /// The level of a record: its bins come after those of all finer ones.
    CULLET_HOST_DEVICE std::uint32_t levelOf(const RowRecord& self) const
    {
        std::uint32_t k = 0;
        while (k + 1 < plan->levelCount && self.back.bin >= plan->levels[k + 1].firstBin)
            ++k;
        return k;
    }

    CULLET_HOST_DEVICE bool isEmptyLevel(std::uint32_t k) const
    {
        const std::uint32_t first = plan->levels[k].firstBin;
        const std::uint32_t last = k + 1 < plan->levelCount ? plan->levels[k + 1].firstBin : plan->binCount;
        return binStarts[first] == binStarts[last];
    }

    /// The cells of a level that partners of a box may be in, wrapped, and the bins in each of them.
    CULLET_HOST_DEVICE RowWindow windowOf(const RowRecord& self, const RowLevel& level) const
    {
        // A partner's minimum is at most `reach` before this box: rounding is monotone, so that holds exactly.
        const float u0 = cellOf(self.front.u0 - level.reach, plan->originU, level.inverse);
        const float v0 = cellOf(self.back.v0 - level.reach, plan->originV, level.inverse);
        const float countU = cellOf(self.front.u1, plan->originU, level.inverse) - u0 + 1.0f;
        const float countV = cellOf(self.back.v1, plan->originV, level.inverse) - v0 + 1.0f;
        RowWindow window;
        window.sizeU = static_cast<std::uint32_t>(level.countU);
        window.sizeV = static_cast<std::uint32_t>(level.countV);
        window.countU = static_cast<std::uint32_t>(countU < level.countU ? countU : level.countU);
        window.countV = static_cast<std::uint32_t>(countV < level.countV ? countV : level.countV);
        window.u = wrapped(u0, level.countU, level.inverseU);
        window.v = wrapped(v0, level.countV, level.inverseV);
        window.bin0 = binAlong(*plan, level, self.front.s0 - level.reach);
        window.bin1 = binAlong(*plan, level, self.front.s1);
        return window;
    }

    /// The records in cell (u, v) of a level that are to be tested against this one.
    ///
    /// @param behind 0, or on its own level the index of the record behind this one
    CULLET_HOST_DEVICE RowRange rangeOf(const RowRecord& self, const RowLevel& level, const RowWindow& window,
                                        std::uint32_t u, std::uint32_t v, std::uint32_t behind) const
    {
        const std::uint32_t cell = level.firstBin + (v * window.sizeU + u) * level.binCount;
        // Cells before its own hold nothing that is behind it.
        if (behind != 0 && cell + window.bin1 < self.back.bin)
            return {0, 0};
        const std::uint32_t begin = binStarts[cell + window.bin0];
        return {begin > behind ? begin : behind, binStarts[cell + window.bin1 + 1]};
    }

    /// Finds the partners of a box on the side list among its records from `begin` on.
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

    /// Tests the record against those of a range, one after the other.
    template <class Emit>
    CULLET_HOST_DEVICE void scan(const RowRecord& self, RowRange range, Emit& emit) const
    {
        for (std::uint32_t j = range.begin; j < range.end; ++j)
            test(self, records[j], emit);
        emit.tested(range.size());
    }

    template <class Emit>
    CULLET_HOST_DEVICE void searchLevel(const RowRecord& self, const RowLevel& level, std::uint32_t behind,
                                        Emit& emit) const
    {
        const RowWindow window = windowOf(self, level);
        if (level.isDense)
            return searchDense(self, level, window, behind, emit);
        for (RowCell cell(window); !cell.isEnd(window); cell.advance(window))
            scan(self, rangeOf(self, level, window, cell.u, cell.v, behind), emit);
    }

    /// Collects the records of all cells and then walks through them in one loop. That keeps the lanes of a warp
    /// together: each has some records in some of its cells, but nearly as many in all as its neighbours.
    template <class Emit>
    CULLET_HOST_DEVICE void searchDense(const RowRecord& self, const RowLevel& level, const RowWindow& window,
                                        std::uint32_t behind, Emit& emit) const
    {
        RowRange ranges[kRanges];
        std::uint32_t count = 0;
        for (RowCell cell(window); !cell.isEnd(window); cell.advance(window))
        {
            const RowRange range = rangeOf(self, level, window, cell.u, cell.v, behind);
            if (range.begin >= range.end)
                continue;
            ranges[count++] = range;
            if (count == kRanges)
            {
                scanAll(self, ranges, count, emit);
                count = 0;
            }
        }
        scanAll(self, ranges, count, emit);
    }

    /// Tests the record against those of some ranges, none of them empty.
    template <class Emit>
    CULLET_HOST_DEVICE void scanAll(const RowRecord& self, const RowRange* ranges, std::uint32_t count,
                                    Emit& emit) const
    {
        RowRange range = {0, 0};
        std::uint32_t tests = 0;
        for (std::uint32_t next = 0; range.begin < range.end || next < count; ++range.begin, ++tests)
        {
            if (range.begin == range.end)
                range = ranges[next++];
            test(self, records[range.begin], emit);
        }
        emit.tested(tests);
    }

    template <class Emit>
    CULLET_HOST_DEVICE void test(const RowRecord& self, const RowRecord other, Emit& emit) const
    {
        const IdPair pair = {self.back.row, other.back.row};
        if (meets(self, other) && isNew(pair, overlapOf(self, other)))
            emit.push(pair);
    }

    static constexpr std::uint32_t kRanges = 16;
};
}  // namespace cullet::psap
