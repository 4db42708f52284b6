// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/psap_rows.h"

#include <cstdint>

/// The search of rows for warps. What SearchRows does record by record, the lanes of a warp do together: they write the
/// records to be tested into a queue and take them from there in turn. Boxes have different numbers of neighbours; one
/// lane per box would leave most lanes waiting for the one with the most.
namespace cullet::psap
{
inline constexpr unsigned kSearchThreads = 128;
inline constexpr unsigned kQueue = 256;       ///< tests that a warp has room for
inline constexpr unsigned kBurst = 6;         ///< tests that a lane adds at a time
inline constexpr unsigned kPairBuffer = 128;  ///< pairs that a warp keeps before they go to the list
inline constexpr unsigned kAllLanes = 0xffffffffu;
static_assert(32 * kBurst + 64 <= kQueue && kPairBuffer >= 128, "room for the steps of all lanes");

/// Sum of the values of the lanes up to this one.
__device__ inline unsigned sumUpTo(unsigned lane, unsigned value)
{
    for (unsigned distance = 1; distance < 32; distance *= 2)
    {
        const unsigned before = __shfl_up_sync(kAllLanes, value, distance);
        value += lane >= distance ? before : 0;
    }
    return value;
}

/// Pairs that a warp found and not yet wrote. All lanes call together, but for push().
struct WarpPairs
{
    IdPair* buffer;
    unsigned lane;
    unsigned count;
    PairList list;

    __device__ void pushWhere(bool has, IdPair pair)
    {
        const unsigned lanes = __ballot_sync(kAllLanes, has);
        if (has)
            buffer[count + __popc(lanes & ((1u << lane) - 1))] = pair;
        count += __popc(lanes);
    }

    /// Makes room for two steps of all lanes.
    __device__ void flushIfFull()
    {
        if (count + 64 > kPairBuffer)
            flush();
    }

    __device__ void flush()
    {
        if (count == 0)
            return;
        __syncwarp();
        unsigned long long base = 0;
        if (lane == 0)
            base = fetchAdd(list.count, std::uint64_t{count});
        base = __shfl_sync(kAllLanes, base, 0);
        for (unsigned k = lane; k < count; k += 32)
        {
            if (base + k < list.capacity)
                list.pairs[base + k] = buffer[k];
        }
        __syncwarp();
        count = 0;
    }

    /// For single lanes, past the buffer.
    __device__ void push(IdPair pair) { list.push(pair); }
    __device__ void tested(std::uint64_t) {}
};

/// The tests that a warp has to make.
struct WarpTests
{
    static constexpr unsigned kLaneShift = 27;  ///< an entry is a lane and an index of a record below 2^27
    static constexpr std::uint32_t kIndexMask = (1u << kLaneShift) - 1;

    const SearchRows& step;
    const RowRecord* selves;  ///< [32] of the lanes
    std::uint32_t* queue;     ///< [kQueue]
    unsigned lane;
    unsigned count;
    WarpPairs& pairs;

    /// Queues the records of each lane's range.
    __device__ void add(RowRange range)
    {
        while (true)
        {
            const unsigned size = range.size();
            const unsigned burst = size < kBurst ? size : kBurst;
            if (__ballot_sync(kAllLanes, burst != 0) == 0)
                return;
            const unsigned last = sumUpTo(lane, burst);
            const unsigned total = __shfl_sync(kAllLanes, last, 31);
            if (count + total > kQueue)
                testFullGroups();
            std::uint32_t* at = queue + count + last - burst;
#pragma unroll 1
            for (unsigned k = 0; k < burst; ++k)
                at[k] = lane << kLaneShift | (range.begin + k);
            count += total;
            range.begin += burst;
        }
    }

    /// Makes as many tests as keep all lanes busy.
    __device__ void testFullGroups()
    {
        __syncwarp();
        unsigned next = 0;
        for (; next + 64 <= count; next += 64)
            testTwo(queue[next + lane], queue[next + 32 + lane]);
        const unsigned rest = count - next;
        const std::uint32_t first = lane < rest ? queue[next + lane] : 0;
        const std::uint32_t second = lane + 32 < rest ? queue[next + 32 + lane] : 0;
        __syncwarp();
        queue[lane] = first;
        queue[lane + 32] = second;
        count = rest;
    }

    __device__ void finish()
    {
        testFullGroups();
        if (count > 32)
            testTwo(queue[lane], lane + 32 < count ? queue[lane + 32] : kNone);
        else if (count != 0)
            testTwo(lane < count ? queue[lane] : kNone, kNone);
        count = 0;
    }

private:
    static constexpr std::uint32_t kNone = kIndexMask;  // no search has as many records

    __device__ void testTwo(std::uint32_t first, std::uint32_t second)
    {
        RowRecord a, b;
        bool isFirst = first != kNone;
        bool isSecond = second != kNone;
        // The loads of both before the first use.
        if (isFirst)
            a = step.records[first & kIndexMask];
        if (isSecond)
            b = step.records[second & kIndexMask];
        const RowRecord& ofFirst = selves[first >> kLaneShift];
        const RowRecord& ofSecond = selves[second >> kLaneShift];
        isFirst = isFirst && isHit(ofFirst, a);
        isSecond = isSecond && isHit(ofSecond, b);
        pairs.pushWhere(isFirst, {ofFirst.back.row, a.back.row});
        pairs.pushWhere(isSecond, {ofSecond.back.row, b.back.row});
        pairs.flushIfFull();
    }

    __device__ bool isHit(const RowRecord& self, const RowRecord& other) const
    {
        return meets(self, other) &&
               (step.isNew.takeAll || step.isNew({self.back.row, other.back.row}, overlapOf(self, other)));
    }
};

/// Queues what a record has to be tested against on one level; the lanes walk through their cells in step.
__device__ inline void queueLevel(WarpTests& tests, const RowRecord& self, const RowLevel& level,
                                  bool takesPart, std::uint32_t behind)
{
    const SearchRows& step = tests.step;
    RowWindow window{};
    if (takesPart)
        window = step.windowOf(self, level);
    RowCell cell(window);
    RowRange next{0, 0};
    if (!cell.isEnd(window))
        next = step.rangeOf(self, level, window, cell.u, cell.v, behind);
    while (__any_sync(kAllLanes, !cell.isEnd(window)))
    {
        const RowRange range = next;
        next = {0, 0};
        if (!cell.isEnd(window))
            cell.advance(window);
        // Under way while the lanes share out the one before.
        if (!cell.isEnd(window))
            next = step.rangeOf(self, level, window, cell.u, cell.v, behind);
        tests.add(range);
    }
}

/// @tparam Step SearchRows; a template so that several sources may hold it
template <class Step>
__global__ void __launch_bounds__(kSearchThreads)
    searchRows(std::uint64_t end, const Step step, const PairList list)
{
    __shared__ IdPair buffers[kSearchThreads / 32][kPairBuffer];
    __shared__ std::uint32_t queues[kSearchThreads / 32][kQueue];
    __shared__ RowRecord selves[kSearchThreads / 32][32];
    const unsigned warp = threadIdx.x / 32;
    const unsigned lane = threadIdx.x % 32;
    const std::uint32_t i = blockIdx.x * kSearchThreads + threadIdx.x;
    const std::uint32_t recordCount = step.binStarts[step.binCapacity];
    WarpPairs pairs = {buffers[warp], lane, 0, list};
    WarpTests tests = {step, selves[warp], queues[warp], lane, 0, pairs};
    const bool isRecord = i < recordCount;
    if (!isRecord && i < end && i - recordCount < *step.sideCount)
        step.searchSide(step.side[i - recordCount], i - recordCount + 1, pairs);
    if (i - lane >= recordCount)
        return;

    RowRecord self{};
    if (isRecord)
        self = step.records[i];
    selves[warp][lane] = self;
    __syncwarp();
    const std::uint32_t ownLevel = isRecord ? step.levelOf(self) : kMostLevels;
    // Records are sorted by level.
    for (std::uint32_t k = __shfl_sync(kAllLanes, ownLevel, 0); k < step.plan->levelCount; ++k)
    {
        if (!step.isEmptyLevel(k))
            queueLevel(tests, self, step.plan->levels[k], k >= ownLevel, k == ownLevel ? i + 1 : 0);
    }
    tests.finish();
    if (isRecord)
        step.searchSide(self.back.row, 0, pairs);
    __syncwarp();
    pairs.flush();
}
}  // namespace cullet::psap
