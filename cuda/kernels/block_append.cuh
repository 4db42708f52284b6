// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/pair_lists.h"
#include "cullet/broad/psap/exec/shared_memory.h"
#include "cullet/cuda/kernels/warp_scan.cuh"

#include <cstdint>
#include <type_traits>

namespace cullet::psap
{
inline constexpr unsigned kEmitThreads = 128;

/// Writes pairs of a warp from shared memory to a list, as far as the list has room; all lanes of the warp call.
///
/// @param pairAt(k) returns pair k as a uint2: as two numbers, it would be stored in two steps
template <class PairAt>
__device__ void writeByWarp(const PairList& list, std::uint64_t place, unsigned count, const PairAt& pairAt)
{
    auto* to = reinterpret_cast<uint2*>(list.pairs);
    for (unsigned k = threadIdx.x % 32; k < count; k += 32)
    {
        if (place + k < list.capacity)
            to[place + k] = pairAt(k);
    }
}

/// Appends pairs of a warp to a list; all its lanes call.
///
/// @return place of the first pair
template <class PairAt>
__device__ std::uint64_t appendByWarp(const PairList& list, unsigned count, const PairAt& pairAt)
{
    unsigned long long place = 0;
    if (threadIdx.x % 32 == 0)
        place = fetchAdd(list.count, std::uint64_t{count});
    place = __shfl_sync(0xffffffffu, place, 0);
    writeByWarp(list, place, count, pairAt);
    return place;
}

/// Number of the given lanes that precede this one. The mask of preceding lanes is a special register, so that it
/// needs no other one.
__device__ inline std::uint32_t countBefore(std::uint32_t lanes)
{
    std::uint32_t before = 0;
    asm volatile("mov.u32 %0, %%lanemask_lt;" : "=r"(before));
    return __popc(lanes & before);
}

/// The emitter of steps whose lanes append together: a ballot gives each lane its place in the buffer of the warp. A
/// full buffer is written to the list, so that a small one suffices, which leaves more of the L1 cache.
///
/// @tparam kPairs capacity of the buffer of a warp
/// @tparam List   PairList, or DepthList
template <unsigned kPairs = 128, class List = PairList>
struct BallotEmitter
{
    static constexpr bool kHasDepths = std::is_same_v<List, DepthList>;
    static constexpr unsigned kRoom = kPairs;
    static constexpr unsigned kSlots =
        kHasDepths ? kRoom + kRoom / 2 : kRoom;  ///< size in pairs, including depths
    static constexpr unsigned kAll = 0xffffffffu;

    std::uint32_t buffer;    ///< [kRoom] pairs of the warp, then their depths: an address in shared memory
    unsigned bufferedCount;  ///< number of pairs in the buffer, the same in all lanes
    List list;

    /// @param room [kSlots] buffer of the warp
    __device__ BallotEmitter(const RowPair* room, const List& whole)
        : buffer(addressInShared(room)), bufferedCount(0), list(whole)
    {
    }

    __device__ void push(RowPair pair) { list.push(pair); }
    __device__ void tested(std::uint64_t) {}
    __device__ bool any(bool isMine) const { return __any_sync(kAll, isMine) != 0; }
    __device__ void append(bool isMine, RowPair pair, float depth = 0)
    {
        const unsigned lanes = __ballot_sync(kAll, isMine);
        const unsigned k = bufferedCount + countBefore(lanes);
        if (isMine)
            storeShared(buffer + sizeof(RowPair) * k, pair);
        if (kHasDepths && isMine)
            storeShared(depthAt(k), __float_as_uint(depth));
        bufferedCount += __popc(lanes);
        if (bufferedCount > kRoom - 32)
            flush();
    }
    /// Writes the rest of the buffer to the list.
    __device__ void finish()
    {
        if (bufferedCount != 0)
            flush();
    }
    /// As finish(), to places that have been claimed already.
    __device__ void finishAt(std::uint64_t place)
    {
        __syncwarp();
        writeByWarp(pairsOf(list), place, bufferedCount, bufferedPair());
    }

private:
    __device__ auto bufferedPair() const
    {
        return [from = buffer](unsigned k) { return loadSharedPair(from + sizeof(RowPair) * k); };
    }

    __device__ std::uint32_t depthAt(unsigned k) const
    {
        return buffer + sizeof(RowPair) * kRoom + sizeof(float) * k;
    }

    __device__ void flush()
    {
        __syncwarp();
        const std::uint64_t base = appendByWarp(pairsOf(list), bufferedCount, bufferedPair());
        if constexpr (kHasDepths)
            appendDepths(base);
        __syncwarp();
        bufferedCount = 0;
    }

    __device__ void appendDepths(std::uint64_t base)
    {
        for (unsigned k = threadIdx.x % 32; k < bufferedCount; k += 32)
        {
            if (base + k < list.pairs.capacity)
                list.depths[base + k] = __uint_as_float(loadShared(depthAt(k)));
        }
    }

    __device__ static const PairList& pairsOf(const PairList& pairs) { return pairs; }
    __device__ static const PairList& pairsOf(const DepthList& pairs) { return pairs.pairs; }
};

/// A BallotEmitter with a buffer of candidates for each lane.
template <unsigned kPairs = 128>
struct BufferedEmitter : BallotEmitter<kPairs>
{
    static constexpr std::uint32_t kMostKept = 8;
    static constexpr std::uint32_t kStride = sizeof(std::uint32_t) * kEmitThreads;

    std::uint32_t firstKept, endOfKept;  ///< buffer of the lane: addresses in shared memory, kStride apart

    /// @param room [kMostKept * kEmitThreads] buffers of the block
    __device__ BufferedEmitter(const RowPair* pairs, const std::uint32_t* room, const PairList& whole)
        : BallotEmitter<kPairs>(pairs, whole),
          firstKept(addressInShared(room + threadIdx.x)),
          endOfKept(firstKept)
    {
    }

    __device__ bool isFull() const { return endOfKept - firstKept == kMostKept * kStride; }
    __device__ bool hasRoomForTwo() const { return endOfKept - firstKept <= (kMostKept - 2) * kStride; }
    __device__ void keep(std::uint32_t something)
    {
        storeShared(endOfKept, something);
        endOfKept += kStride;
    }
    __device__ std::uint32_t keptCount() const { return (endOfKept - firstKept) / kStride; }
    __device__ std::uint32_t kept(std::uint32_t k) const { return loadShared(firstKept + k * kStride); }
    __device__ void dropKept() { endOfKept = firstKept; }

    /// Appends the pairs of `row` and each kept row of this lane. The warp claims places for all of them at once, so
    /// that no lane waits for others that have more.
    __device__ void appendKept(std::uint32_t row)
    {
        const std::uint32_t count = keptCount();
        const std::uint32_t upTo = sumUpToLane(count);
        unsigned long long place = 0;
        if (threadIdx.x % 32 == 31 && upTo != 0)
            place = fetchAdd(this->list.count, std::uint64_t{upTo});
        place = __shfl_sync(0xffffffffu, place, 31) + (upTo - count);
        auto* to = reinterpret_cast<uint2*>(this->list.pairs);
#pragma unroll 1
        for (std::uint32_t k = 0; k < count; ++k)
        {
            if (place + k < this->list.capacity)
                to[place + k] = make_uint2(row, kept(k));
        }
        dropKept();
    }
};
}  // namespace cullet::psap
