// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/records.h"

#include <cstdint>
#include <type_traits>

/// The search with rows where every bin has room for as many records: a box goes straight into its bin, without counting
/// first. Two steps instead of five, for small worlds, where each takes longer to start than to run. Where a bin is full
/// the search finds nothing and says so, and all of it is done by counting.
namespace cullet::psap
{
/// Stands for the number of pairs where a bin was full.
inline constexpr std::uint64_t kSpilled = 1ull << 63;

/// Records in a bin, at most.
inline constexpr std::uint32_t kBinRoom = 12;

/// What the search needs to know of all bins. Aligned, so that a GPU reads it at once.
struct alignas(16) BinTotals
{
    std::uint32_t sides;    ///< boxes on the side list
    std::uint32_t spilled;  ///< boxes that found a bin full
    std::uint32_t spares;   ///< boxes on the last level, which is empty else
    std::uint32_t padding;
};

/// Bins, and what is known of them. There are two: one is filled and searched while the other one is cleared.
struct RowBinSet
{
    std::uint32_t* counts;  ///< [bins] 0 before
    BinTotals* totals;      ///< 0 before
};

/// Step 1: writes the record of box i into its bin.
struct PlaceRows
{
    static constexpr bool kLetsNextStart = true;  ///< the search of the bins, which awaits this

    RowBins bins;
    RowBinSet set;
    std::uint32_t room;
    RowRecord* records;        ///< [bins * room, out]
    std::uint64_t* pairCount;  ///< set to 0; may be null

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        if (i == 0 && pairCount != nullptr)
            *pairCount = 0;
        const RowBins::Known ahead = bins.known();
        const Aabb box = loadBox(bins.boxes, i);
        const std::uint32_t bin = bins.take(ahead, i, box);
        storeRecord(records, placeIn(bin, ahead.plan.spareBin),
                    recordOf(box, ahead.plan.axes, static_cast<std::uint32_t>(i), bin));
    }

private:
    CULLET_HOST_DEVICE std::uint32_t placeIn(std::uint32_t bin, std::uint32_t spareBin) const
    {
        if (bin == kNoBin)
            return kNoPlace;
        if (bin >= spareBin)
            fetchAdd(&set.totals->spares, 1u);
        const std::uint32_t rank = fetchAdd(&set.counts[bin], 1u);
        if (rank < room)
            return bin * room + rank;
        fetchAdd(&set.totals->spilled, 1u);
        return kNoPlace;
    }
};

/// The records of two neighbouring bins, and more bins behind them.
struct BinRange
{
    std::uint32_t bin, last;  ///< the first bin, and behind the last of all
    std::uint32_t slot;       ///< records from here on count
    std::uint32_t firstCount, secondCount;

    CULLET_HOST_DEVICE std::uint32_t size() const
    {
        const std::uint32_t end = firstCount + secondCount;
        return slot < end ? end - slot : 0;
    }
    /// The place of the k-th record.
    CULLET_HOST_DEVICE std::uint32_t at(std::uint32_t k, std::uint32_t room) const
    {
        const std::uint32_t record = slot + k;
        return bin * room + (record < firstCount ? record : record - firstCount + room);
    }
};

/// Step 2: as SearchRows, for the records of a bin.
template <class IsNew, std::uint32_t kSharers>
struct SearchBins
{
    static constexpr std::uint32_t kMostRoom = kBinRoom;

    RowPartners<IsNew, TestAtOnce> partners;
    RowBinSet set;
    RowBinSet other;  ///< set to 0 for the next update
    std::uint32_t room;
    std::uint64_t* pairCount;  ///< kSpilled where a bin was full

    /// Makes a bin of the other set ready for the next update. Asks for nothing that PlaceRows leaves, so that a GPU may do it
    /// before that is over.
    CULLET_HOST_DEVICE void clear(std::uint32_t bin) const
    {
        other.counts[bin] = 0;
        if (bin == 0)
            *other.totals = {};
    }

    /// Does for a bin what is to be done once.
    ///
    /// @pre there are as many bins as boxes, or more
    template <class Emit>
    CULLET_HOST_DEVICE void begin(std::uint32_t bin, Emit& emit) const
    {
        if (bin == 0 && set.totals->spilled != 0)
            *pairCount = kSpilled;
        const std::uint32_t sides = set.totals->spilled != 0 ? 0 : set.totals->sides;
        if (bin < sides)
            partners.searchSide(partners.side[bin], bin + 1, sides, 1, emit);
    }

    /// How many records of the bin are to be searched.
    CULLET_HOST_DEVICE std::uint32_t countOf(std::uint32_t bin) const
    {
        const std::uint32_t count = set.counts[bin];  // on its way while the other is read
        return set.totals->spilled != 0 ? 0 : count;
    }

    /// @param slot     of the record in the bin
    /// @param share    of its cells, below kSharers
    /// @param isRecord false for what only fills up a warp
    template <class Emit>
    CULLET_HOST_DEVICE void operator()(std::uint32_t bin, std::uint32_t slot, std::uint32_t share,
                                       bool isRecord, Emit& emit) const
    {
        const BinTotals totals = *set.totals;
        const auto entryTest = partners.isNew.ready();
        const RowRecord self = partners.records[bin * room + slot];
        const std::uint32_t levels = partners.plan->levelCount - (totals.spares == 0 ? 1 : 0);
        std::uint32_t k = 0;
        do  // there is a level: the first one is read while their number is
        {
            const RowLevel level = partners.plan->levels[k];
            const bool isSeen = isRecord && bin < level.endBin;
            if (!emit.any(isSeen))
                continue;
            const bool isOwn = bin >= level.firstBin;
            RowCells cells = partners.cellsAround(self, level, isOwn);
            cells.count = isSeen ? cells.count : 0;
            search(self, level, cells, share, isOwn ? Place{bin, slot + 1} : Place{0, 0}, entryTest, emit);
        } while (++k < levels);
        report(self, entryTest, emit);
        if (isRecord && totals.sides != 0)
            partners.searchSide(self.back.row, share, totals.sides, kSharers, emit);
    }

private:
    /// Records from here on count.
    struct Place
    {
        std::uint32_t bin, slot;
    };

    /// Tests the record against those of every kSharers-th cell from `share` on.
    ///
    /// @param behind on its own level the place behind this one
    template <class Test, class Emit>
    CULLET_HOST_DEVICE void search(const RowRecord& self, const RowLevel& level, RowCells cells,
                                   std::uint32_t share, Place behind, const Test& entryTest, Emit& emit) const
    {
        const std::uint32_t bin0 =
            level.firstBin + binAlong(*partners.plan, level, self.front.s0 - level.reach);
        const std::uint32_t bin1 = level.firstBin + binAlong(*partners.plan, level, self.front.s1) + 1;
        const auto rangeOf = [&](std::uint32_t k) -> BinRange
        {
            if (k >= cells.count)
                return {0, 0, 0, 0, 0};
            const std::uint32_t cell = cells.index() * level.binCount;
            const Place from = {cell + bin0, 0};
            const bool isCut = (k == 0 || level.isRoomy == 0) && behind.bin >= from.bin;
            return rangeBetween(isCut ? behind : from, cell + bin1);
        };
        cells.skip(share);
        BinRange next = rangeOf(share);
        for (std::uint32_t k = share; emit.any(k < cells.count); k += kSharers)
        {
            BinRange range = next;
            cells.skip(kSharers);
            next = rangeOf(k + kSharers);  // on its way while this one is read
            scan(self, range, entryTest, emit);
            // Rounding, or a plan of another frame, makes a window touch more bins.
            for (; emit.any(range.bin + 2 < range.last);)
            {
                range = rangeBetween({range.bin + 2, 0}, range.last);
                scan(self, range, entryTest, emit);
            }
        }
    }

    /// Tests the record against those of a range, and keeps those that it meets.
    template <class Test, class Emit>
    CULLET_HOST_DEVICE void scan(const RowRecord& self, const BinRange& range, const Test& entryTest,
                                 Emit& emit) const
    {
        const std::uint32_t count = range.size();
        std::uint32_t k = 0;
        for (;;)
        {
            // Two at a time, so that the second is read while the first is tested; behind the last one there is a record too.
#ifdef __CUDA_ARCH__
#pragma unroll 1
#endif
            for (; k < count && emit.hasRoomForTwo(); k += 2)
            {
                const std::uint32_t firstPlace = range.at(k, room);
                const std::uint32_t secondPlace = range.at(k + 1, room);
                const RowRecord first = loadRecord(partners.records, firstPlace);
                const RowRecord second = loadRecord(partners.records, secondPlace);
                const bool isFirst = meets(self, first);
                const bool isSecond = meets(self, second) & (k + 1 < count);
                if (isFirst)
                    emit.keep(kKeepsRows ? first.back.row : firstPlace);
                if (isSecond)
                    emit.keep(kKeepsRows ? second.back.row : secondPlace);
            }
            if (!emit.any(k < count))
                break;
            report(self, entryTest, emit);
        }
        emit.tested(count);
    }

    /// What is kept of a record that is met: its row where every pair is taken, so that nothing more is asked of it, else its
    /// place.
    static constexpr bool kKeepsRows = std::is_same<IsNew, EveryPair>::value;

    /// Appends those of the kept pairs that enter.
    template <class Test, class Emit>
    CULLET_HOST_DEVICE void report(const RowRecord& self, const Test& entryTest, Emit& emit) const
    {
        if constexpr (kKeepsRows)
            emit.appendKept(self.back.row);
        else
            partners.report(self, entryTest, emit);
    }

    /// The records from a place on in two bins.
    ///
    /// @param last behind the last bin
    CULLET_HOST_DEVICE BinRange rangeBetween(Place from, std::uint32_t last) const
    {
        BinRange range = {from.bin, last, from.slot, 0, 0};
        if (from.bin < last)
            range.firstCount = set.counts[from.bin];
        if (from.bin + 1 < last)
            range.secondCount = set.counts[from.bin + 1];
        return range;
    }
};
}  // namespace cullet::psap
