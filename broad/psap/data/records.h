// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/counting_sort.h"

#include <cstdint>

/// The counting-sort search. It divides the two other axes as the thesis's search does, but writes each box once,
/// into the cell of its minimum corner on the level of its size. Each cell is cut along the sweep axis into bins, so
/// that a counting sort replaces the radix sort. The search for the partners of a box visits the cells around it on
/// its own level and on all coarser ones.
///
/// Any plan gives the same pairs: cells wrap around, bins are clamped, and both are monotone before that. A plan made
/// for other boxes, or from a sample, costs time only.
namespace cullet::psap
{
/// overlapOf() the boxes of two records.
CULLET_HOST_DEVICE inline float overlapOf(const SortRecord& a, const SortRecord& b)
{
    const float s = sharedLength(a.front.s0, a.front.s1, b.front.s0, b.front.s1);
    const float u = sharedLength(a.front.u0, a.front.u1, b.front.u0, b.front.u1);
    const float v = sharedLength(a.back.v0, a.back.v1, b.back.v0, b.back.v1);
    const float su = s < u ? s : u;
    return su < v ? su : v;
}

/// A range of consecutive records.
struct RecordRange
{
    std::uint32_t begin, end;

    CULLET_HOST_DEVICE std::uint32_t size() const { return begin < end ? end - begin : 0; }
};

/// Cells of one level around a box, wrapped, line by line: `leftInLine` cells of line v from u on, then `perLine`
/// cells of each later line.
struct CellsAround
{
    std::uint32_t u, v;
    std::uint32_t leftInLine;
    std::uint32_t firstU;  ///< first cell of the later lines
    std::uint32_t perLine;
    std::uint32_t count;  ///< total number of cells
    std::uint32_t sizeU, sizeV;

    CULLET_HOST_DEVICE std::uint32_t index() const { return v * sizeU + u; }

    /// Advances by so many cells.
    CULLET_HOST_DEVICE void skip(std::uint32_t cells)
    {
        for (std::uint32_t k = 0; k < cells; ++k)
        {
            const bool isLineDone = --leftInLine == 0;
            const std::uint32_t nextU = u + 1 == sizeU ? 0 : u + 1;
            const std::uint32_t nextV = v + 1 == sizeV ? 0 : v + 1;
            u = isLineDone ? firstU : nextU;
            v = isLineDone ? nextV : v;
            leftInLine = isLineDone ? perLine : leftInLine;
        }
    }
};

// Not &&: some comparisons are cheaper than a divergent branch.
CULLET_HOST_DEVICE inline bool meets(const SortRecord::Front& a, const SortRecord::Front& b)
{
    return (int{a.s0 <= b.s1} & int{b.s0 <= a.s1} & int{a.u0 <= b.u1} & int{b.u0 <= a.u1}) != 0;
}
CULLET_HOST_DEVICE inline bool meets(const SortRecord::Back& a, const SortRecord::Back& b)
{
    return (int{a.v0 <= b.v1} & int{b.v0 <= a.v1}) != 0;
}
CULLET_HOST_DEVICE inline bool meets(const SortRecord& a, const SortRecord& b)
{
    return (int{meets(a.front, b.front)} & int{meets(a.back, b.back)}) != 0;
}

/// The search for the partners of a box, shared by all searches with records.
template <class IsNew>
struct PartnerSearch
{
    const SortRecord* records;  ///< the array has one more record, which is loaded but not used
    const LevelPlan* plan;
    const Aabb* boxes;
    const std::uint32_t* unbounded;
    IsNew isNew;

    /// The cells of a level that are searched.
    CULLET_HOST_DEVICE CellsAround cellsAround(const SortRecord& self, const PlanLevel& level,
                                               bool isOwn) const
    {
        // The minimum of a partner is at most `reach` before this box. Rounding is monotone, so that this holds
        // exactly.
        const bool searchesHalf = isOwn && level.isWrapFree != 0;
        const std::int32_t u0 = cellU(self.front.u0 - level.reach, level);
        const std::int32_t u1 = cellU(self.front.u1, level);
        const std::int32_t v1 = cellV(self.back.v1, level);
        const std::int32_t firstU = searchesHalf ? cellU(self.front.u0, level) : u0;
        const std::int32_t firstV = cellV(searchesHalf ? self.back.v0 : self.back.v0 - level.reach, level);
        CellsAround cells;
        cells.sizeU = level.countU;
        cells.sizeV = level.countV;
        cells.u = wrapped(firstU, level.countU);
        cells.v = wrapped(firstV, level.countV);
        cells.firstU = wrapped(u0, level.countU);
        cells.leftInLine = cellsBetween(firstU, u1, level.countU);
        cells.perLine = cellsBetween(u0, u1, level.countU);
        cells.count = cells.leftInLine + (cellsBetween(firstV, v1, level.countV) - 1) * cells.perLine;
        return cells;
    }

    /// Finds the partners of an unbounded box among every `step`-th of that list from `begin` on.
    template <class Emit>
    CULLET_HOST_DEVICE void searchUnbounded(std::uint32_t row, std::uint32_t begin, std::uint32_t count,
                                            std::uint32_t step, Emit& emit) const
    {
        for (std::uint32_t k = begin; k < count; k += step)
        {
            const RowPair pair = {row, unbounded[k]};
            if (overlaps(loadBox(boxes, row), loadBox(boxes, pair.b)) && isNew(pair))
                emit.push(pair);
            emit.tested(1);
        }
    }

    /// searchUnbounded() for record i. Indices past the last record stand for the unbounded boxes.
    template <class Emit>
    CULLET_HOST_DEVICE void searchUnboundedFor(std::uint64_t i, const SortTotals& totals, std::uint32_t share,
                                               std::uint32_t sharers, Emit& emit) const
    {
        if (i < totals.records)
            searchUnbounded(records[i].back.row, share, totals.unboundedCount, sharers, emit);
        else if (i - totals.records < totals.unboundedCount)
            searchUnbounded(unbounded[i - totals.records],
                            static_cast<std::uint32_t>(i - totals.records) + 1 + share, totals.unboundedCount,
                            sharers, emit);
    }

    /// Tests the record against the records of a range in two phases: first all tests of a batch, then the reports of
    /// what they found. Most lanes find nothing in a cell, and would wait for those that do.
    template <class Test, class Emit>
    CULLET_HOST_DEVICE void scan(const SortRecord& self, RecordRange range, const Test& entryTest,
                                 Emit& emit) const
    {
        for (; emit.any(range.begin < range.end); range.begin += kTestsPerBatch)
        {
            const std::uint32_t count = range.size() < kTestsPerBatch ? range.size() : kTestsPerBatch;
            keep(self, hitsAmong(self, records + range.begin, count), range.begin, entryTest, emit);
            emit.tested(count);
        }
    }

    /// Keeps record first + k for each bit k of `hits`; reports the kept records where the buffer of a lane is full.
    template <class Test, class Emit>
    CULLET_HOST_DEVICE void keep(const SortRecord& self, std::uint32_t hits, std::uint32_t first,
                                 const Test& entryTest, Emit& emit) const
    {
        for (;;)
        {
            for (; hits != 0 && !emit.isFull(); hits &= hits - 1)
                emit.keep(first + lowestBit(hits));
            if (!emit.any(hits != 0))
                return;
            report<true>(self, entryTest, emit);
        }
    }

    /// Appends the kept candidates that are pairs and enter.
    ///
    /// @tparam kTestsThirdAxis scan() has kept them; otherwise they overlap along all axes
    template <bool kTestsThirdAxis, class Test, class Emit>
    CULLET_HOST_DEVICE void report(const SortRecord& self, const Test& entryTest, Emit& emit) const
    {
        for (std::uint32_t k = 0; emit.any(k < emit.keptCount()); ++k)
        {
            RowPair pair = {self.back.row, 0};
            bool isEntering = k < emit.keptCount();
            if (isEntering)
            {
                const SortRecord& other = records[emit.kept(k)];
                pair.b = other.back.row;
                isEntering = (!kTestsThirdAxis || meets(self.back, other.back)) &&
                             entryTest(pair, [&] { return overlapOf(self, other); });
            }
            emit.append(isEntering, pair);
        }
        emit.dropKept();
    }

private:
    static constexpr std::uint32_t kTestsPerBatch = 32;

    // Cells that wrap around are square, which saves a register.
    CULLET_HOST_DEVICE std::int32_t cellU(float u, const PlanLevel& level) const
    {
        return cellOf(u, plan->originU, level.inverseU);
    }
    CULLET_HOST_DEVICE std::int32_t cellV(float v, const PlanLevel& level) const
    {
        return cellOf(v, plan->originV, level.inverseU);
    }

    CULLET_HOST_DEVICE static std::uint32_t cellsBetween(std::int32_t first, std::int32_t last,
                                                         std::uint32_t most)
    {
        const std::uint32_t count = static_cast<std::uint32_t>(last - first) + 1;
        return count < most ? count : most;
    }

    /// Bit k: record k of the others overlaps along two axes. The third one is tested later, which halves what is
    /// loaded of the others.
    CULLET_HOST_DEVICE static std::uint32_t hitsAmong(const SortRecord& self, const SortRecord* others,
                                                      std::uint32_t count)
    {
        std::uint32_t hits = 0;
        // Two at a time, so that the second is loaded while the first is tested. There is a record after the last one
        // too.
#ifdef __CUDA_ARCH__
#pragma unroll 1
#endif
        for (std::uint32_t k = 0; k < count; k += 2)
            hits |= (meets(self.front, others[k].front) ? 1u : 0u) << k |
                    (meets(self.front, others[k + 1].front) ? 2u : 0u) << k;
        return count < 32 ? hits & ((1u << count) - 1u) : hits;
    }
};

/// The sorted records of a search, and the counts that the search clears for the next update.
struct SortedBins
{
    const std::uint32_t* binStarts;  ///< [binCapacity + 1]
    std::uint64_t binCapacity;
    const SortTotals* totals;
    std::uint64_t boxCount;
    std::uint32_t* binCounts;  ///< [binCapacity + 1]

    /// @param index one of `sharers` indices for each box
    CULLET_HOST_DEVICE void clearBins(std::uint64_t index, std::uint32_t sharers) const
    {
        for (std::uint64_t bin = index; bin <= binCapacity; bin += boxCount * sharers)
            binCounts[bin] = 0;
    }
};

/// Step 4: finds the partners of record i, in the cells around it, on its level and on coarser ones, and among the
/// unbounded boxes. Indices past the last record stand for the unbounded boxes.
///
/// Of two levels the finer one reports a pair. Within a level, the box whose cell is first in the unwrapped order of
/// cells reports it, and within a cell the first record, so that only half of the cells around a box are searched.
/// Where a level has so few cells that two cells around a box may wrap to the same one, all are searched, and the
/// first record reports.
///
/// The lanes of a warp advance from cell to cell together, and append together. Several consecutive indices may share
/// a record, each searching some of the cells: this is more work in total, but faster where a GPU has idle lanes.
template <class IsNew, std::uint32_t kSharers>
struct SearchSorted
{
    PartnerSearch<IsNew> partners;
    SortedBins order;

    /// @param index   one of kSharers indices for each box
    /// @param isIndex false for a lane that only fills up a warp
    template <class Emit>
    CULLET_HOST_DEVICE void operator()(std::uint64_t index, bool isIndex, Emit& emit) const
    {
        if (isIndex)
            order.clearBins(index, kSharers);
        const std::uint64_t i = index / kSharers;
        const std::uint32_t share = static_cast<std::uint32_t>(index % kSharers);
        const SortTotals totals = *order.totals;
        const bool isRecord = isIndex && i < totals.records;
        const auto entryTest = partners.isNew.preloaded();
        if (emit.any(isRecord))
            searchRecord(isRecord ? static_cast<std::uint32_t>(i) : totals.records - 1, share, isRecord,
                         totals.levels, entryTest, emit);
        if (totals.unboundedCount != 0 && isIndex)
            partners.searchUnboundedFor(i, totals, share, kSharers, emit);
    }

private:
    template <class Test, class Emit>
    CULLET_HOST_DEVICE void searchRecord(std::uint32_t i, std::uint32_t share, bool isRecord,
                                         std::uint32_t levels, const Test& entryTest, Emit& emit) const
    {
        const SortRecord self = partners.records[i];
        for (std::uint32_t k = 0; k < levels; ++k)
        {
            const PlanLevel level = partners.plan->levels[k];
            const bool isSearched = isRecord && self.back.bin < level.endBin;
            if (!emit.any(isSearched))
                continue;
            const bool isOwn = self.back.bin >= level.firstBin;
            CellsAround cells = partners.cellsAround(self, level, isOwn);
            cells.count = isSearched ? cells.count : 0;
            search(self, level, cells, share, isOwn ? i + 1 : 0, entryTest, emit);
        }
        partners.template report<true>(self, entryTest, emit);
    }

    /// Tests the record against the records of every kSharers-th cell, starting with cell `share`.
    ///
    /// @param successor on the record's own level, the index of the next record; else 0
    template <class Test, class Emit>
    CULLET_HOST_DEVICE void search(const SortRecord& self, const PlanLevel& level, CellsAround cells,
                                   std::uint32_t share, std::uint32_t successor, const Test& entryTest,
                                   Emit& emit) const
    {
        const std::uint32_t bin0 =
            level.firstBin + binAlong(*partners.plan, level, self.front.s0 - level.reach);
        const std::uint32_t bin1 = level.firstBin + binAlong(*partners.plan, level, self.front.s1) + 1;
        const auto rangeOf = [&](std::uint32_t k) -> RecordRange
        {
            if (k >= cells.count)
                return {0, 0};
            const std::uint32_t cell = cells.index() * level.binCount;
            return {order.binStarts[cell + bin0], order.binStarts[cell + bin1]};
        };
        cells.skip(share);
        RecordRange next = rangeOf(share);
        for (std::uint32_t k = share; emit.any(k < cells.count); k += kSharers)
        {
            RecordRange range = next;
            cells.skip(kSharers);
            next = rangeOf(k + kSharers);  // loaded while this range is tested; not used before
            if (k == 0 || level.isWrapFree == 0)
                range.begin = range.begin > successor ? range.begin : successor;
            partners.scan(self, range, entryTest, emit);
        }
    }
};
}  // namespace cullet::psap
