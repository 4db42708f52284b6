// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/psap_rows.h"

#include <cstdint>
#include <type_traits>

/// The search with rows where the records of a warp search together: what the box around all of them may meet is read once,
/// a record by each lane, and only what that box meets is tested by each lane. For many levels, where a box alone looks at
/// many cells for few partners, and for many pairs, where the boxes of a warp have most of their partners in common.
///
/// The plan lays the cells in a serpentine (RowLevel::isSerpentine), so that records one behind the other lie side by side.
/// As with a box alone, any plan gives the same pairs.
namespace cullet::psap
{
/// The box around some records, or one of them.
struct Region
{
    float s0, s1, u0, u1, v0, v1;

    CULLET_HOST_DEVICE bool meets(const RowRecord& record) const
    {
        return psap::meets({s0, s1, u0, u1}, record.front) & psap::meets({v0, v1, 0, 0}, record.back);
    }

    CULLET_HOST_DEVICE bool isLongerThan(float length) const
    {
        return s1 - s0 > length || u1 - u0 > length || v1 - v0 > length;
    }
};

/// What the lanes of a group share: records to be tested, in a ring. In three parts, so that lanes one behind the other write
/// side by side, and a record that all lanes test is read in as few steps as it has words.
struct GroupRoom
{
    static constexpr std::uint32_t kTestsTogether = 32;
    static constexpr std::uint32_t kRecords = 2 * kTestsTogether;

    struct alignas(8) Height
    {
        float v0, v1;
    };

    RowRecord::Front fronts[kRecords];
    Height heights[kRecords];
    std::uint32_t rows[kRecords];

    CULLET_HOST_DEVICE void put(std::uint32_t k, const RowRecord& record)
    {
        fronts[k] = record.front;
        heights[k] = {record.back.v0, record.back.v1};
        rows[k] = record.back.row;
    }
    /// But for the bin.
    CULLET_HOST_DEVICE RowRecord at(std::uint32_t k) const
    {
        return {fronts[k], {heights[k].v0, heights[k].v1, rows[k], kNoBin}};
    }

    /// Bit j: record first + j meets this one.
    template <std::uint32_t kCount>
    CULLET_HOST_DEVICE std::uint32_t hitsAmong(const RowRecord& record, std::uint32_t first) const
    {
        std::uint32_t hits = 0;
#ifdef __CUDA_ARCH__
#pragma unroll
#endif
        for (std::uint32_t j = 0; j < kCount; ++j)
            hits |= (meets(record, at(first + j)) ? 1u : 0u) << j;
        return hits;
    }
};

/// Step 4, as SearchRows, for records that search together: those of the lanes of a group. Of two records the first one
/// reports a pair: finer levels come first, and of one level all cells around a group are looked at.
template <class IsNew>
struct SearchGroups
{
    using Room = GroupRoom;

    RowPartners<IsNew, TestAtOnce> partners;
    RowOrder order;

    /// @param isIndex false for what only fills up a group
    template <class Emit>
    CULLET_HOST_DEVICE void operator()(std::uint64_t index, bool isIndex, Emit& emit) const
    {
        if (isIndex)
            order.clearBins(index, 1);
        const RowTotals totals = *order.totals;
        const bool isRecord = isIndex && index < totals.records;
        const auto entryTest = partners.isNew.ready();
        if (emit.any(isRecord))
            searchRecords(static_cast<std::uint32_t>(index), isRecord, totals, entryTest, emit);
        if (totals.sides != 0 && isIndex)
            partners.searchSideOf(index, totals, 0, 1, emit);
    }

private:
    // A group that would have to look at more records than this, and is longer than that along an axis, searches in two
    // halves: some of its boxes lie far apart, and what is between them would be tested in vain.
    static constexpr std::uint32_t kMostTogether = 512;
    static constexpr float kMostReaches = 3;

    /// Some lanes of a group, and what they are about.
    struct Members
    {
        std::uint32_t lanes;
        bool isMine;  ///< this lane is one
        Region region;
    };

    template <class Emit>
    CULLET_HOST_DEVICE static Members membersOf(const RowRecord& self, bool isMine, std::uint32_t lanes,
                                                Emit& emit)
    {
        const auto least = [&](float value) { return emit.least(value, isMine); };
        const auto most = [&](float value) { return -emit.least(-value, isMine); };
        const Region region = {least(self.front.s0), most(self.front.s1), least(self.front.u0),
                               most(self.front.u1),  least(self.back.v0), most(self.back.v1)};
        return {lanes, isMine, region};
    }

    template <class Test, class Emit>
    CULLET_HOST_DEVICE void searchRecords(std::uint32_t index, bool isRecord, const RowTotals& totals,
                                          const Test& entryTest, Emit& emit) const
    {
        const RowRecord self = partners.records[isRecord ? index : totals.records - 1];
        const std::uint32_t all = emit.ballot(isRecord);
        Members members = membersOf(self, isRecord, all, emit);
        searchGroup(self, members, entryTest, emit);
        std::uint32_t finest = 0;
        // Those of one level, and then those of the next one, where the group has some of each.
        for (std::uint32_t rest = all; rest != 0;)
        {
            const std::uint32_t first = emit.from(self.back.bin, lowestBit(rest));
            while (first >= partners.plan->levels[finest].endBin)
                ++finest;
            const bool isHere =
                (rest >> emit.lane() & 1u) != 0 && self.back.bin < partners.plan->levels[finest].endBin;
            const std::uint32_t here = emit.ballot(isHere);
            rest &= ~here;
            for (std::uint32_t k = finest; k < totals.levels; ++k)
                searchLevel(self, index, partners.plan->levels[k], isHere, here, members, entryTest, emit);
        }
    }

    /// Tests the records of the group against each other: each lane those of the lanes behind it, up to half way around.
    template <class Test, class Emit>
    CULLET_HOST_DEVICE void searchGroup(const RowRecord& self, const Members& members, const Test& entryTest,
                                        Emit& emit) const
    {
        constexpr std::uint32_t kHalf = Emit::kLanes / 2;
        const std::uint32_t lane = emit.lane();
        RowRecord own = self;
        if (!members.isMine)
            own.front = {kInfinity, -kInfinity, kInfinity, -kInfinity};
        // The first half once more, behind all, so that no lane has to count around.
        emit.room().put(lane, own);
        if (lane + kHalf < Emit::kLanes)
            emit.room().put(Emit::kLanes + lane, own);
        emit.sync();
        std::uint32_t hits = emit.room().template hitsAmong<kHalf>(own, lane + 1);
        // Of two lanes opposite each other the first.
        if (lane >= kHalf)
            hits &= ~(1u << kHalf >> 1);
        report(self, hits, lane + 1, entryTest, emit);
        emit.tested(kHalf);
        emit.sync();
    }

    /// Appends the record's pairs with those of the room that are told by bits, `first` being the lowest, if they enter.
    template <class Test, class Emit>
    CULLET_HOST_DEVICE void report(const RowRecord& self, std::uint32_t hits, std::uint32_t first,
                                   const Test& entryTest, Emit& emit) const
    {
        const auto pairWith = [&](std::uint32_t k) -> IdPair {
            return {self.back.row, emit.room().rows[first + k]};
        };
        if constexpr (!std::is_same_v<Test, EveryPair>)
        {
            for (std::uint32_t rest = hits; rest != 0; rest &= rest - 1)
            {
                const std::uint32_t k = lowestBit(rest);
                const auto depth = [&] { return overlapOf(self, emit.room().at(first + k)); };
                hits &= entryTest(pairWith(k), depth) ? ~0u : ~(1u << k);
            }
        }
        emit.appendEach(hits, pairWith);
    }

    /// Searches a level for the lanes that are here, in as large parts as it can be done.
    template <class Test, class Emit>
    CULLET_HOST_DEVICE void searchLevel(const RowRecord& self, std::uint32_t index, const RowLevel& level,
                                        bool isHere, std::uint32_t here, Members& members,
                                        const Test& entryTest, Emit& emit) const
    {
        std::uint32_t size = Emit::kLanes;
        for (std::uint32_t begin = 0; begin < Emit::kLanes;)
        {
            const bool isMine = isHere && emit.lane() - begin < size;
            const std::uint32_t lanes = size == Emit::kLanes ? here : emit.ballot(isMine);
            if (lanes != 0 && lanes != members.lanes)
                members = membersOf(self, isMine, lanes, emit);
            if (lanes == 0 || searchCells(self, index, level, members, size > 1, entryTest, emit))
                begin += size;
            else
                size /= 2;
        }
    }

    /// The cells of a level around a region.
    struct Window
    {
        std::uint32_t u, v;
        std::uint32_t acrossU, count;
        std::uint32_t bin0, bin1;  ///< along each cell, the second behind the last one
    };

    CULLET_HOST_DEVICE Window windowOf(const RowLevel& level, const Region& region) const
    {
        const RowPlan& plan = *partners.plan;
        const std::uint32_t u0 =
            clampedCell(region.u0 - level.reach, plan.originU, level.inverseU, level.countU);
        const std::uint32_t u1 = clampedCell(region.u1, plan.originU, level.inverseU, level.countU);
        const std::uint32_t v0 =
            clampedCell(region.v0 - level.reach, plan.originV, level.inverseV, level.countV);
        const std::uint32_t v1 = clampedCell(region.v1, plan.originV, level.inverseV, level.countV);
        return {u0,
                v0,
                u1 - u0 + 1,
                (u1 - u0 + 1) * (v1 - v0 + 1),
                binAlong(plan, level, region.s0 - level.reach),
                binAlong(plan, level, region.s1) + 1};
    }

    /// The records of cell k of a window that lie behind the group.
    CULLET_HOST_DEVICE RowRange rangeOf(const RowLevel& level, const Window& window, std::uint32_t k,
                                        std::uint32_t behind) const
    {
        if (k >= window.count)
            return {0, 0};
        const std::uint32_t row = k / window.acrossU;
        const std::uint32_t cell = serpentineCell(level, window.u + k - row * window.acrossU, window.v + row);
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
    /// @return false, with nothing done, where it is better done in two halves
    template <class Test, class Emit>
    CULLET_HOST_DEVICE bool searchCells(const RowRecord& self, std::uint32_t index, const RowLevel& level,
                                        const Members& members, bool mayRefuse, const Test& entryTest,
                                        Emit& emit) const
    {
        const Window window = windowOf(level, members.region);
        const std::uint32_t behind = index - emit.lane() + Emit::kLanes;
        const bool isLarge = mayRefuse && members.region.isLongerThan(kMostReaches * level.reach);
        std::uint32_t waiting = 0;
        std::uint32_t head = 0;
        for (std::uint32_t first = 0; first < window.count; first += Emit::kLanes)
        {
            const RowRange range = rangeOf(level, window, first + emit.lane(), behind);
            if (isLarge && first == 0 && emit.sum(range.size()) + window.count > kMostTogether)
                return false;
            for (std::uint32_t some = emit.ballot(range.size() != 0); some != 0; some &= some - 1)
            {
                const std::uint32_t end = emit.from(range.end, lowestBit(some));
                for (std::uint32_t i = emit.from(range.begin, lowestBit(some)); i < end; i += Emit::kLanes)
                {
                    const bool isRecord = i + emit.lane() < end;
                    const RowRecord other = partners.records[isRecord ? i + emit.lane() : end - 1];
                    const bool isNear = isRecord && members.region.meets(other);
                    const std::uint32_t near = emit.ballot(isNear);
                    if (isNear)
                        emit.room().put((head + waiting + emit.rankIn(near)) % GroupRoom::kRecords, other);
                    waiting += emit.countOf(near);
                    if (waiting < GroupRoom::kTestsTogether)
                        continue;
                    testWaiting(self, members, head, GroupRoom::kTestsTogether, entryTest, emit);
                    head = (head + GroupRoom::kTestsTogether) % GroupRoom::kRecords;
                    waiting -= GroupRoom::kTestsTogether;
                }
            }
        }
        if (waiting != 0)
            testWaiting(self, members, head, waiting, entryTest, emit);
        return true;
    }

    /// Each lane tests its record against those that wait.
    template <class Test, class Emit>
    CULLET_HOST_DEVICE void testWaiting(const RowRecord& self, const Members& members, std::uint32_t head,
                                        std::uint32_t count, const Test& entryTest, Emit& emit) const
    {
        emit.sync();
        std::uint32_t hits = 0;
        for (std::uint32_t k = 0; k < count; k += kUnrolled)
            hits |= emit.room().template hitsAmong<kUnrolled>(self, head + k) << k;
        hits = count < 32 ? hits & ((1u << count) - 1u) : hits;
        report(self, members.isMine ? hits : 0, head, entryTest, emit);
        emit.tested(count);
        emit.sync();
    }
    static constexpr std::uint32_t kUnrolled = 8;
    static_assert(GroupRoom::kTestsTogether % kUnrolled == 0, "records beyond the last one are looked at");
};
}  // namespace cullet::psap
