// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/records.h"

#include <cstdint>
#include <type_traits>

/// The counting-sort search with bins of fixed room: a box is written into its bin at once, without a count first.
/// Two steps instead of five, for small worlds, where a step takes longer to start than to run. Where a bin is full,
/// the search finds no pairs and reports kOverflowed, and the update is repeated with a counting sort.
namespace cullet::psap
{
/// Reported in place of the number of pairs where a bin was full.
inline constexpr std::uint64_t kOverflowed = 1ull << 63;

/// Most records in a bin.
inline constexpr std::uint32_t kBinRoom = 12;

/// Totals over all bins. Aligned, so that a GPU loads them at once.
struct alignas(16) BinTotals
{
    std::uint32_t unboundedCount;      ///< boxes on the list of unbounded boxes
    std::uint32_t overflowed;          ///< boxes whose bin was full
    std::uint32_t overflowLevelCount;  ///< boxes on the overflow level, which is usually empty
    std::uint32_t padding;
};

/// Bins and their totals. There are two sets: one is filled and searched while the other one is cleared.
struct BinSet
{
    std::uint32_t* counts;  ///< [bins] 0 before the update
    BinTotals* totals;      ///< 0 before the update
};

/// Step 1: writes the record of box i into its bin.
struct PlaceInBins
{
    static constexpr bool kTriggersDependentLaunch = true;  ///< of SearchFixedBins, which waits for this step

    BinFinder bins;
    BinSet set;
    std::uint32_t room;
    SortRecord* records;       ///< [bins * room, out]
    std::uint64_t* pairCount;  ///< set to 0, or null

    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        if (i == 0 && pairCount != nullptr)
            *pairCount = 0;
        const BinFinder::Preloaded preloaded = bins.preload();
        const Aabb box = loadBox(bins.boxes, i);
        const std::uint32_t bin = bins.findBin(preloaded, i, box);
        storeRecord(records, placeIn(bin, preloaded.plan.overflowBin),
                    recordOf(box, preloaded.plan.axes, static_cast<std::uint32_t>(i), bin));
    }

private:
    CULLET_HOST_DEVICE std::uint32_t placeIn(std::uint32_t bin, std::uint32_t overflowBin) const
    {
        if (bin == kNoBin)
            return kNoPlace;
        if (bin >= overflowBin)
            fetchAdd(&set.totals->overflowLevelCount, 1u);
        const std::uint32_t rank = fetchAdd(&set.counts[bin], 1u);
        if (rank < room)
            return bin * room + rank;
        fetchAdd(&set.totals->overflowed, 1u);
        return kNoPlace;
    }
};

/// The records of two neighbouring bins, and the bins after them.
struct BinRange
{
    std::uint32_t bin, last;  ///< the first bin, and one past the last bin of all
    std::uint32_t slot;       ///< first record of the range
    std::uint32_t firstCount, secondCount;

    CULLET_HOST_DEVICE std::uint32_t size() const
    {
        const std::uint32_t end = firstCount + secondCount;
        return slot < end ? end - slot : 0;
    }
    /// Place of the k-th record.
    CULLET_HOST_DEVICE std::uint32_t at(std::uint32_t k, std::uint32_t room) const
    {
        const std::uint32_t record = slot + k;
        return bin * room + (record < firstCount ? record : record - firstCount + room);
    }
};

/// Step 2: as SearchSorted, for the records of a bin.
template <class IsNew, std::uint32_t kSharers>
struct SearchFixedBins
{
    static constexpr std::uint32_t kMostRoom = kBinRoom;

    PartnerSearch<IsNew> partners;
    BinSet set;
    BinSet other;  ///< cleared for the next update
    std::uint32_t room;
    std::uint64_t* pairCount;  ///< set to kOverflowed where a bin was full

    /// Clears a bin of the other set for the next update. Reads nothing that PlaceInBins writes, so that a GPU may do
    /// this while that step still runs.
    CULLET_HOST_DEVICE void clear(std::uint32_t bin) const
    {
        other.counts[bin] = 0;
        if (bin == 0)
            *other.totals = {};
    }

    /// Does the work that a bin needs once.
    ///
    /// @pre there are at least as many bins as boxes
    template <class Emit>
    CULLET_HOST_DEVICE void begin(std::uint32_t bin, Emit& emit) const
    {
        if (bin == 0 && set.totals->overflowed != 0)
            *pairCount = kOverflowed;
        const std::uint32_t unboundedCount = set.totals->overflowed != 0 ? 0 : set.totals->unboundedCount;
        if (bin < unboundedCount)
            partners.searchUnbounded(partners.unbounded[bin], bin + 1, unboundedCount, 1, emit);
    }

    /// Number of records of the bin that are searched.
    CULLET_HOST_DEVICE std::uint32_t countOf(std::uint32_t bin) const
    {
        const std::uint32_t count = set.counts[bin];  // loaded together with the totals
        return set.totals->overflowed != 0 ? 0 : count;
    }

    /// @param slot     slot of the record in the bin
    /// @param share    which of the kSharers shares of its cells
    /// @param isRecord false for a lane that only fills up a warp
    template <class Emit>
    CULLET_HOST_DEVICE void operator()(std::uint32_t bin, std::uint32_t slot, std::uint32_t share,
                                       bool isRecord, Emit& emit) const
    {
        const BinTotals totals = *set.totals;
        const auto entryTest = partners.isNew.preloaded();
        const SortRecord self = partners.records[bin * room + slot];
        const std::uint32_t levels = partners.plan->levelCount - (totals.overflowLevelCount == 0 ? 1 : 0);
        std::uint32_t k = 0;
        do  // there is at least one level, so the first one is loaded while `levels` is computed
        {
            const PlanLevel level = partners.plan->levels[k];
            const bool isSearched = isRecord && bin < level.endBin;
            if (!emit.any(isSearched))
                continue;
            const bool isOwn = bin >= level.firstBin;
            CellsAround cells = partners.cellsAround(self, level, isOwn);
            cells.count = isSearched ? cells.count : 0;
            search(self, level, cells, share, isOwn ? Place{bin, slot + 1} : Place{0, 0}, entryTest, emit);
        } while (++k < levels);
        report(self, entryTest, emit);
        if (isRecord && totals.unboundedCount != 0)
            partners.searchUnbounded(self.back.row, share, totals.unboundedCount, kSharers, emit);
    }

private:
    /// First record of a range.
    struct Place
    {
        std::uint32_t bin, slot;
    };

    /// Tests the record against the records of every kSharers-th cell, starting with cell `share`.
    ///
    /// @param successor on the record's own level, the place after the record
    template <class Test, class Emit>
    CULLET_HOST_DEVICE void search(const SortRecord& self, const PlanLevel& level, CellsAround cells,
                                   std::uint32_t share, Place successor, const Test& entryTest,
                                   Emit& emit) const
    {
        const std::uint32_t bin0 =
            level.firstBin + binAlong(*partners.plan, level, self.front.s0 - level.reach);
        const std::uint32_t bin1 = level.firstBin + binAlong(*partners.plan, level, self.front.s1) + 1;
        const auto rangeOf = [&](std::uint32_t k) -> BinRange
        {
            if (k >= cells.count)
                return {};
            const std::uint32_t cell = cells.index() * level.binCount;
            const Place from = {cell + bin0, 0};
            const bool isCut = (k == 0 || level.isWrapFree == 0) && successor.bin >= from.bin;
            return rangeBetween(isCut ? successor : from, cell + bin1);
        };
        cells.skip(share);
        BinRange next = rangeOf(share);
        for (std::uint32_t k = share; emit.any(k < cells.count); k += kSharers)
        {
            BinRange range = next;
            cells.skip(kSharers);
            next = rangeOf(k + kSharers);  // loaded while this range is tested
            scan(self, range, entryTest, emit);
            // Rounding, or a plan made for other boxes, makes a window touch more bins.
            for (; emit.any(range.bin + 2 < range.last);)
            {
                range = rangeBetween({range.bin + 2, 0}, range.last);
                scan(self, range, entryTest, emit);
            }
        }
    }

    /// Tests the record against the records of a range, and keeps those that overlap it.
    template <class Test, class Emit>
    CULLET_HOST_DEVICE void scan(const SortRecord& self, const BinRange& range, const Test& entryTest,
                                 Emit& emit) const
    {
        const std::uint32_t count = range.size();
        std::uint32_t k = 0;
        for (;;)
        {
            // Two at a time, so that the second is loaded while the first is tested. There is a record after the last
            // one too.
#ifdef __CUDA_ARCH__
#pragma unroll 1
#endif
            for (; k < count && emit.hasRoomForTwo(); k += 2)
            {
                const std::uint32_t firstPlace = range.at(k, room);
                const std::uint32_t secondPlace = range.at(k + 1, room);
                const SortRecord first = loadRecord(partners.records, firstPlace);
                const SortRecord second = loadRecord(partners.records, secondPlace);
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

    /// Whether rows are kept instead of places: where every pair is reported, nothing else of a record is needed.
    static constexpr bool kKeepsRows = std::is_same<IsNew, EveryPair>::value;

    /// Appends the kept pairs that enter.
    template <class Test, class Emit>
    CULLET_HOST_DEVICE void report(const SortRecord& self, const Test& entryTest, Emit& emit) const
    {
        if constexpr (kKeepsRows)
            emit.appendKept(self.back.row);
        else
            partners.template report<false>(self, entryTest, emit);
    }

    /// The records of two bins, from a place on.
    ///
    /// @param last one past the last bin
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
