// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/pair_lists.h"
#include "cullet/cuda/kernels/block_append.cuh"

#include <cstdint>

/// The kernels for steps that append pairs to several lists. The warps of a block claim places together.
namespace cullet::psap
{
inline constexpr unsigned kMultiAppendBlocks = 8;  ///< blocks per multiprocessor
/// Threads of a block of runCompacted(): the more, the fewer atomics.
inline constexpr unsigned kCompactedThreads = 256;
/// Blocks per multiprocessor: Turing's holds 1,024 threads, later ones 1,536 and more.
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
inline constexpr unsigned kCompactedBlocks = 4;
#else
inline constexpr unsigned kCompactedBlocks = 6;
#endif

/// Places in several lists for the pairs of a block, claimed together: atomics on the counter of a list are served
/// one after the other.
template <unsigned kWarps, std::uint32_t kLists>
struct BlockPlaces
{
    std::uint32_t counts[kLists][kWarps];  ///< pairs of the previous warps
    std::uint64_t firsts[kLists];

    /// Called by all threads of the block. @param own pairs of the warp, for each list
    __device__ void claim(const std::uint32_t (&own)[kLists], const PairLists<kLists>& lists)
    {
        // Unrolled instead of indexed, here and below: indexing would place the arrays in local memory.
#pragma unroll
        for (unsigned list = 0; list < kLists; ++list)
        {
            if (threadIdx.x % 32 == list)
                counts[list][threadIdx.x / 32] = own[list];
        }
        __syncthreads();
        if (threadIdx.x < kLists)
            claimFor(threadIdx.x, countOf(threadIdx.x, lists));
        __syncthreads();
    }
    __device__ std::uint64_t ofWarp(unsigned list) const
    {
        return firsts[list] + counts[list][threadIdx.x / 32];
    }

private:
    __device__ static std::uint64_t* countOf(unsigned list, const PairLists<kLists>& lists)
    {
        std::uint64_t* count = lists.at(0).count;
#pragma unroll
        for (unsigned k = 1; k < kLists; ++k)
            count = list == k ? lists.at(k).count : count;
        return count;
    }

    /// Called by one lane for each list, so that the atomics overlap.
    __device__ void claimFor(unsigned list, std::uint64_t* count)
    {
        std::uint32_t total = 0;
        for (unsigned warp = 0; warp < kWarps; ++warp)
        {
            const std::uint32_t ofWarp = counts[list][warp];
            counts[list][warp] = total;
            total += ofWarp;
        }
        firsts[list] = total != 0 ? fetchAdd(count, std::uint64_t{total}) : 0;
    }
};

/// Runs a step for each index; its verdict appends a pair to some of two or three lists. A block claims places in all
/// lists together, and loads what its lanes need for all their pairs before it uses any of it.
///
/// @tparam kPerLane pairs of a lane
template <unsigned kPerLane, class Step, std::uint32_t kLists>
__global__ void __launch_bounds__(kEmitThreads, kMultiAppendBlocks)
    runMultiAppend(std::uint64_t end, const Step step, const PairLists<kLists> lists)
{
    constexpr unsigned kWarps = kEmitThreads / 32;
    constexpr unsigned kAll = 0xffffffffu;
    __shared__ BlockPlaces<kWarps, kLists> places;
    const std::uint64_t first =
        static_cast<std::uint64_t>(blockIdx.x) * kPerLane * kEmitThreads + threadIdx.x;
    using Item = decltype(step.read(first));
    Item items[kPerLane];
#pragma unroll
    for (unsigned k = 0; k < kPerLane; ++k)
    {
        const std::uint64_t i = first + k * kEmitThreads;
        items[k] = i < end ? step.read(i) : Item{};
    }
    decltype(step(items[0])) verdicts[kPerLane];
#pragma unroll
    for (unsigned k = 0; k < kPerLane; ++k)
        verdicts[k] = step(items[k]);
        // Not earlier: other indices might still read what is stored.
#pragma unroll
    for (unsigned k = 0; k < kPerLane; ++k)
    {
        const std::uint64_t i = first + k * kEmitThreads;
        if (i < end)
            step.keep(i, items[k], verdicts[k]);
    }
    std::uint32_t own[kLists] = {};
#pragma unroll
    for (unsigned k = 0; k < kPerLane; ++k)
#pragma unroll
        for (unsigned list = 0; list < kLists; ++list)
            own[list] += __popc(__ballot_sync(kAll, verdicts[k].routed.isFor(list)));
    places.claim(own, lists);
#pragma unroll
    for (unsigned list = 0; list < kLists; ++list)
    {
        if (own[list] == 0)
            continue;
        const PairList to = lists.at(list);
        std::uint64_t place = places.ofWarp(list);
#pragma unroll
        for (unsigned k = 0; k < kPerLane; ++k)
        {
            const bool isMine = verdicts[k].routed.isFor(list);
            const unsigned lanes = __ballot_sync(kAll, isMine);
            const std::uint64_t slot = place + countBefore(lanes);
            if (isMine && slot < to.capacity)
                reinterpret_cast<uint2*>(to.pairs)[slot] = {verdicts[k].routed.pair.a,
                                                            verdicts[k].routed.pair.b};
            place += __popc(lanes);
        }
    }
}

/// As runMultiAppend(), for a step that appends few pairs to two lists and decides most indices at once. The
/// undecided ones are compacted: the warp queues them until it has one for each lane.
///
/// @tparam kPerLane indices of a lane that are loaded together
template <unsigned kPerLane, class Step>
__global__ void __launch_bounds__(kCompactedThreads, kCompactedBlocks)
    runCompacted(std::uint64_t end, const Step step, const PairLists<2> lists)
{
    using Undecided = typename Step::Undecided;
    using Emitter = BallotEmitter<64>;
    constexpr unsigned kWarps = kCompactedThreads / 32;
    __shared__ Undecided queues[kWarps][64];
    __shared__ alignas(8) RowPair rooms[2][kWarps][Emitter::kRoom];
    __shared__ BlockPlaces<kWarps, 2> places;
    const unsigned ofBlock = threadIdx.x / 32;
    const unsigned lane = threadIdx.x % 32;
    Undecided* const queue = queues[ofBlock];
    Emitter toFirst(rooms[0][ofBlock], lists.at(0));
    Emitter toSecond(rooms[1][ofBlock], lists.at(1));
    unsigned queued = 0;
    const auto classify = [&](unsigned count)
    {
        __syncwarp();
        queued -= count;
        RoutedPair routed;
        if (lane < count)
            routed = step.classify(queue[queued + lane]);
        toFirst.append(routed.isFor(0), routed.pair);
        toSecond.append(routed.isFor(1), routed.pair);
        __syncwarp();
    };
    using Item = decltype(step.read(end));
    const std::uint64_t all = std::uint64_t{kPerLane} * kCompactedThreads * gridDim.x;
    const std::uint64_t warp = static_cast<std::uint64_t>(blockIdx.x) * kWarps + ofBlock;
#pragma unroll 1
    for (std::uint64_t first = 32 * kPerLane * warp; first < end; first += all)
    {
        Item items[kPerLane];
        bool isUndecided[kPerLane];
#pragma unroll
        for (unsigned k = 0; k < kPerLane; ++k)
        {
            const std::uint64_t i = first + 32 * k + lane;
            items[k] = i < end ? step.read(i) : Item{};
        }
#pragma unroll
        for (unsigned k = 0; k < kPerLane; ++k)
            isUndecided[k] = step.isUndecided(items[k]);
#pragma unroll
        for (unsigned k = 0; k < kPerLane; ++k)
        {
            const std::uint64_t i = first + 32 * k + lane;
            const unsigned lanes = __ballot_sync(Emitter::kAll, isUndecided[k]);
            if (isUndecided[k])
                queue[queued + countBefore(lanes)] = step.undecided(i, items[k]);
            else if (i < end)
                step.keep(i, items[k]);
            queued += __popc(lanes);
            if (queued >= 32)
                classify(32);
        }
    }
    classify(queued);
    places.claim({toFirst.bufferedCount, toSecond.bufferedCount}, lists);
    toFirst.finishAt(places.ofWarp(0));
    toSecond.finishAt(places.ofWarp(1));
}
}  // namespace cullet::psap
