// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/records.h"
#include "cullet/broad/psap/sorted/warp_scratch.h"

#include <cstdint>
#include <type_traits>

/// The warp-cooperative search. What the box around the records of a warp may overlap is loaded once, a record by
/// each lane, and only records that overlap that box are tested against the records of the warp. For many levels,
/// where a box alone visits many cells for few partners, and for many pairs, where the boxes of a warp have most of
/// their partners in common.
///
/// The plan has its cells in serpentine order (PlanLevel::isSerpentine), so that consecutive records are close to
/// each other. As in SearchSorted, any plan gives the same pairs.
namespace cullet::psap
{
/// Step 4, as SearchSorted, for the records of a warp together. Of two records the first one reports a pair: finer
/// levels are first, and on the same level all cells around the warp's records are searched.
template <class IsNew>
struct SearchByWarp
{
    using Scratch = WarpScratch;

    PartnerSearch<IsNew> partners;
    SortedBins order;

    /// @param isIndex false for a lane that only fills up the warp
    template <class Emit>
    CULLET_HOST_DEVICE void operator()(std::uint64_t index, bool isIndex, Emit& emit) const
    {
        if (isIndex)
            order.clearBins(index, 1);
        const SortTotals totals = *order.totals;
        const bool isRecord = isIndex && index < totals.records;
        const auto entryTest = partners.isNew.preloaded();
        if (emit.any(isRecord))
            searchRecords(static_cast<std::uint32_t>(index), isRecord, totals, entryTest, emit);
        if (totals.unboundedCount != 0 && isIndex)
            partners.searchUnboundedFor(index, totals, 0, 1, emit);
    }

private:
    // Where a warp would load more records than this, and its records spread over more than this length along an
    // axis, it searches in two halves: some of its boxes are far from the others, and boxes between them would be
    // tested in vain.
    static constexpr std::uint32_t kMostRecordsTogether = 512;
    static constexpr float kMostReaches = 3;

    template <class Emit>
    using HalfWarpsOf = HalfWarps<Emit::kLanes>;

    /// The records that a lane tests.
    template <class Emit>
    struct OwnRecords
    {
        HalfWarpsOf<Emit> halfWarps;
        SortRecord records[HalfWarpsOf<Emit>::kCount];
    };

    /// A subset of the records of a warp, by lanes, and the box around them.
    struct Members
    {
        std::uint32_t lanes;
        Region region;
    };

    template <class Emit>
    CULLET_HOST_DEVICE static Members membersOf(const OwnRecords<Emit>& own, std::uint32_t lanes, Emit& emit)
    {
        Region region = Region::emptyBox();
        if ((lanes >> emit.lane() & 1u) != 0)
            region.include(own.records[0]);
        const auto most = [&](float value) { return -emit.least(-value); };
        return {lanes,
                {emit.least(region.s0), most(region.s1), emit.least(region.u0), most(region.u1),
                 emit.least(region.v0), most(region.v1)}};
    }

    template <class Test, class Emit>
    CULLET_HOST_DEVICE void searchRecords(std::uint32_t index, bool isRecord, const SortTotals& totals,
                                          const Test& entryTest, Emit& emit) const
    {
        const std::uint32_t all = emit.ballot(isRecord);
        const std::uint32_t begin = index - emit.lane();
        OwnRecords<Emit> own;
        own.halfWarps = {emit.lane()};
        own.records[0] = partners.records[isRecord ? index : begin];
        if (!isRecord)
            own.records[0].front = {kInfinity, -kInfinity, kInfinity, -kInfinity};
        const std::uint32_t bin = own.records[0].back.bin;
        searchWithinWarp(own, entryTest, emit);
        Members members = membersOf(own, all, emit);
        std::uint32_t finest = 0;
        // The records of one level, and after that those of the next one, where a warp has records of several levels.
        for (std::uint32_t rest = all; rest != 0;)
        {
            const std::uint32_t first = emit.from(bin, lowestBit(rest));
            while (first >= partners.plan->levels[finest].endBin)
                ++finest;
            const std::uint32_t lanesOnLevel = rest & emit.ballot(bin < partners.plan->levels[finest].endBin);
            rest &= ~lanesOnLevel;
            for (std::uint32_t k = finest; k < totals.levels; ++k)
                searchLevel(own, begin, partners.plan->levels[k], lanesOnLevel, members, entryTest, emit);
        }
    }

    /// Tests the records of the warp against each other: each lane tests against the next half of the lanes,
    /// cyclically. After that it gives each lane its other records (HalfWarps).
    template <class Test, class Emit>
    CULLET_HOST_DEVICE void searchWithinWarp(OwnRecords<Emit>& own, const Test& entryTest, Emit& emit) const
    {
        constexpr std::uint32_t kHalf = Emit::kLanes / 2;
        const std::uint32_t lane = emit.lane();
        // The first half is stored again after the last one, so that no lane index has to wrap around.
        emit.scratch().put(lane, own.records[0]);
        if (lane + kHalf < Emit::kLanes)
            emit.scratch().put(Emit::kLanes + lane, own.records[0]);
        emit.sync();
        std::uint32_t hits = 0;
        CULLET_UNROLL
        for (std::uint32_t j = 0; j < kHalf; ++j)
            addIfMeets(hits, 1u << j, own.records[0], emit.scratch().at(lane + 1 + j));
        // Of two opposite lanes only the first one tests.
        if (lane >= kHalf)
            hits &= ~(1u << kHalf >> 1);
        report<32>(own, hits, lane + 1, entryTest, emit);
        CULLET_UNROLL
        for (std::uint32_t k = 1; k < HalfWarpsOf<Emit>::kCount; ++k)
            own.records[k] = emit.scratch().at(own.halfWarps.laneOf(k));
        emit.tested(kHalf);
        emit.sync();
    }

    /// Appends the pairs of a lane's bits, if they enter. Bit `turn + kTurns * k` is the pair of the lane's k-th
    /// record and the record in the scratch memory at `first + kStep * turn`, where kStep records share the bits.
    template <std::uint32_t kTurns, class Test, class Emit>
    CULLET_HOST_DEVICE void report(const OwnRecords<Emit>& own, std::uint32_t hits, std::uint32_t first,
                                   const Test& entryTest, Emit& emit) const
    {
        constexpr std::uint32_t kStep = 32 / kTurns;
        // Selected one by one: an indexed array would not stay in registers.
        const auto ofRecord = [&](std::uint32_t bit, const auto& what)
        {
            auto chosen = what(own.records[0]);
            CULLET_UNROLL
            for (std::uint32_t k = 1; k < kStep; ++k)
                chosen = bit >= kTurns * k ? what(own.records[k]) : chosen;
            return chosen;
        };
        const ScratchRows others(emit.scratch().rows + first);
        const auto pairOf = [&](std::uint32_t bit) -> RowPair
        {
            return {ofRecord(bit, [](const SortRecord& record) { return record.back.row; }),
                    others.at(bit % kTurns * kStep)};
        };
        if constexpr (!std::is_same_v<Test, EveryPair>)
        {
            for (std::uint32_t rest = hits; rest != 0; rest &= rest - 1)
            {
                const std::uint32_t bit = lowestBit(rest);
                const auto depth = [&]
                {
                    const SortRecord other = emit.scratch().at(first + bit % kTurns * kStep);
                    return ofRecord(bit, [&](const SortRecord& record) { return overlapOf(record, other); });
                };
                hits &= entryTest(pairOf(bit), depth) ? ~0u : ~(1u << bit);
            }
        }
        emit.appendEach(hits, pairOf);
    }

    /// Searches a level for the lanes on it, in parts as large as possible.
    template <class Test, class Emit>
    CULLET_HOST_DEVICE void searchLevel(const OwnRecords<Emit>& own, std::uint32_t begin,
                                        const PlanLevel& level, std::uint32_t lanesOnLevel, Members& members,
                                        const Test& entryTest, Emit& emit) const
    {
        std::uint32_t size = Emit::kLanes;
        for (std::uint32_t first = 0; first < Emit::kLanes;)
        {
            const std::uint32_t lanes =
                size == Emit::kLanes ? lanesOnLevel : lanesOnLevel & ((1u << size) - 1) << first;
            if (lanes != 0 && lanes != members.lanes)
                members = membersOf(own, lanes, emit);
            if (lanes == 0 || searchCells(own, begin, level, members, size > 1, entryTest, emit))
                first += size;
            else
                size /= 2;
        }
    }

    /// The cells of a level around a region.
    struct Window
    {
        std::uint32_t u, v;
        std::uint32_t acrossU;
        std::uint32_t lineBits;    ///< low bits of a cell's number that give its u
        std::uint32_t count;       ///< of cell numbers; some stand for no cell
        std::uint32_t bin0, bin1;  ///< along each cell: first bin, and one past the last
    };

    CULLET_HOST_DEVICE Window windowOf(const PlanLevel& level, const Region& region) const
    {
        const LevelPlan& plan = *partners.plan;
        const std::uint32_t u0 =
            clampedCell(region.u0 - level.reach, plan.originU, level.inverseU, level.countU);
        const std::uint32_t u1 = clampedCell(region.u1, plan.originU, level.inverseU, level.countU);
        const std::uint32_t v0 =
            clampedCell(region.v0 - level.reach, plan.originV, level.inverseV, level.countV);
        const std::uint32_t v1 = clampedCell(region.v1, plan.originV, level.inverseV, level.countV);
        const std::uint32_t lineBits = bitWidthOf(u1 - u0);
        return {u0,
                v0,
                u1 - u0 + 1,
                lineBits,
                (v1 - v0 + 1) << lineBits,
                binAlong(plan, level, region.s0 - level.reach),
                binAlong(plan, level, region.s1) + 1};
    }

    /// The records of cell k of a window that come after the warp's own.
    CULLET_HOST_DEVICE RecordRange rangeOf(const PlanLevel& level, const Window& window, std::uint32_t k,
                                           std::uint32_t behind) const
    {
        const std::uint32_t column = k & ((1u << window.lineBits) - 1);
        if (k >= window.count || column >= window.acrossU)
            return {0, 0};
        const std::uint32_t cell =
            serpentineCell(level, window.u + column, window.v + (k >> window.lineBits));
        const std::uint32_t base = level.firstBin + cell * level.binCount;
        const bool isForward = cell % 2 == 0;
        const std::uint32_t begin =
            order.binStarts[base + (isForward ? window.bin0 : level.binCount - window.bin1)];
        const std::uint32_t end =
            order.binStarts[base + (isForward ? window.bin1 : level.binCount - window.bin0)];
        return {begin > behind ? begin : behind, end};
    }

    /// Tests the members against the records of the cells around them.
    ///
    /// @param begin first record of the warp
    /// @return false, with nothing done, where two halves are faster
    template <class Test, class Emit>
    CULLET_HOST_DEVICE bool searchCells(const OwnRecords<Emit>& own, std::uint32_t begin,
                                        const PlanLevel& level, const Members& members, bool mayRefuse,
                                        const Test& entryTest, Emit& emit) const
    {
        const Window window = windowOf(level, members.region);
        const bool isLarge = mayRefuse && members.region.isLongerThan(kMostReaches * level.reach);
        const std::uint32_t wanted = own.halfWarps.bitsOf(members.lanes);
        std::uint32_t queued = 0;
        std::uint32_t head = 0;
        for (std::uint32_t first = 0; first < window.count; first += Emit::kLanes)
        {
            const RecordRange range = rangeOf(level, window, first + emit.lane(), begin + Emit::kLanes);
            if (isLarge && first == 0 && emit.sum(range.size()) + window.count > kMostRecordsTogether)
                return false;
            for (std::uint32_t some = emit.ballot(range.size() != 0); some != 0; some &= some - 1)
            {
                const std::uint32_t end = emit.from(range.end, lowestBit(some));
                for (std::uint32_t i = emit.from(range.begin, lowestBit(some)); i < end; i += Emit::kLanes)
                {
                    const std::uint32_t mine = i + emit.lane();
                    const SortRecord other = partners.records[mine < end - 1 ? mine : end - 1];
                    const bool isNear = (mine < end) & members.region.meets(other);
                    const std::uint32_t near = emit.ballot(isNear);
                    if (isNear)
                        emit.scratch().put((head + queued + emit.rankIn(near)) % WarpScratch::kRecords,
                                           other);
                    queued += emit.countOf(near);
                    if (queued < WarpScratch::kTestsPerBatch)
                        continue;
                    testQueued(own, head, WarpScratch::kTestsPerBatch, wanted, entryTest, emit);
                    head = (head + WarpScratch::kTestsPerBatch) % WarpScratch::kRecords;
                    queued -= WarpScratch::kTestsPerBatch;
                }
            }
        }
        if (queued != 0)
            testQueued(own, head, queued, wanted & own.halfWarps.bitsWithin(queued), entryTest, emit);
        return true;
    }

    /// Tests the records of the warp against the queued ones, and appends the pairs of the bits in `wanted`.
    template <class Test, class Emit>
    CULLET_HOST_DEVICE void testQueued(const OwnRecords<Emit>& own, std::uint32_t head, std::uint32_t count,
                                       std::uint32_t wanted, const Test& entryTest, Emit& emit) const
    {
        using T = HalfWarpsOf<Emit>;
        emit.sync();
        const std::uint32_t first = head + own.halfWarps.number();
        std::uint32_t hits = 0;
        for (std::uint32_t turn = 0; turn * T::kCount < count; turn += kUnrolled)
        {
            std::uint32_t some = 0;
            CULLET_UNROLL
            for (std::uint32_t j = 0; j < kUnrolled; ++j)
            {
                const SortRecord other = emit.scratch().at(first + T::kCount * (turn + j));
                CULLET_UNROLL
                for (std::uint32_t k = 0; k < T::kCount; ++k)
                    addIfMeets(some, 1u << j << T::kTurns * k, own.records[k], other);
            }
            hits |= some << turn;
        }
        report<T::kTurns>(own, hits & wanted, first, entryTest, emit);
        emit.tested(count);
        emit.sync();
    }
    static constexpr std::uint32_t kUnrolled = 4;
    static_assert(WarpScratch::kTestsPerBatch % (2 * kUnrolled) == 0,
                  "records behind the room are looked at");
};
}  // namespace cullet::psap
