// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/pair_lists.h"
#include "cullet/cuda/kernels/block_append.cuh"
#include "cullet/cuda/kernels/launch.cuh"

#include <cstdint>
#include <type_traits>

/// The kernels that run a step for each index.
namespace cullet::psap
{
inline constexpr unsigned kMostThreads = 256;  ///< of a block of runStep()
/// Blocks per multiprocessor: more warps to hide latency, fewer registers. Turing's holds 1,024 threads, later ones
/// 1,536 and more.
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
inline constexpr unsigned kAppendWarpBlocks = 8;
inline constexpr unsigned kWarpStepBlocks = 8;
#else
inline constexpr unsigned kAppendWarpBlocks = 12;
inline constexpr unsigned kWarpStepBlocks = 10;
#endif
/// Fewer blocks, and so more registers, where all blocks of a small world run at once.
inline constexpr unsigned kBinSlotBlocks = 8;
/// Capacity of the buffer of a warp, in pairs: a larger one needs fewer atomics, and leaves less L1 cache.
inline constexpr unsigned kPairsOfAppendWarp = 192;
inline constexpr unsigned kPairsOfWarpStep = 192;
inline constexpr unsigned kWarpBuffer = 384;  ///< capacity of the buffer of a warp, in pairs

/// Whether a launch after the step may start early, as declared by the step.
template <class Step, class = void>
inline constexpr bool kTriggersDependentLaunch = false;
template <class Step>
inline constexpr bool kTriggersDependentLaunch<Step, std::void_t<decltype(Step::kTriggersDependentLaunch)>> =
    Step::kTriggersDependentLaunch;

template <class Step>
__global__ void __launch_bounds__(kMostThreads)
    runStep(std::uint64_t begin, std::uint64_t end, const Step step)
{
    if constexpr (kTriggersDependentLaunch<Step>)
        triggerDependentLaunch();
    const std::uint64_t i = begin + static_cast<std::uint64_t>(blockIdx.x) * blockDim.x + threadIdx.x;
    if (i < end)
        step(i);
}

/// The emitter of steps whose lanes append independently: a buffer in shared memory, whose pairs are appended to the
/// list with one atomic per warp.
struct WarpEmitter
{
    RowPair* buffer;
    unsigned* count;
    PairList list;

    __device__ void push(RowPair pair)
    {
        const unsigned slot = atomicAdd(count, 1u);
        if (slot < kWarpBuffer)
            buffer[slot] = pair;
        else
            list.push(pair);
    }
    __device__ void tested(std::uint64_t) {}
};

template <class Step>
__global__ void __launch_bounds__(kEmitThreads)
    runAppend(std::uint64_t end, const Step step, const PairList list)
{
    __shared__ alignas(8) RowPair buffers[kEmitThreads / 32][kWarpBuffer];
    __shared__ unsigned counts[kEmitThreads / 32];
    const unsigned warp = threadIdx.x / 32;
    const unsigned lane = threadIdx.x % 32;
    if (lane == 0)
        counts[warp] = 0;
    __syncwarp();
    WarpEmitter emit = {buffers[warp], &counts[warp], list};
    const std::uint64_t i = static_cast<std::uint64_t>(blockIdx.x) * blockDim.x + threadIdx.x;
    if (i < end)
        step(i, emit);
    __syncwarp();

    const unsigned count = counts[warp] < kWarpBuffer ? counts[warp] : kWarpBuffer;
    if (count != 0)
        appendByWarp(list, count,
                     [&](unsigned k) { return reinterpret_cast<const uint2*>(buffers[warp])[k]; });
}

template <class Step>
__global__ void __launch_bounds__(kEmitThreads, kAppendWarpBlocks)
    runAppendWarp(std::uint64_t end, const Step step, const PairList list)
{
    using Emitter = BufferedEmitter<kPairsOfAppendWarp>;
    __shared__ alignas(8) RowPair buffers[kEmitThreads / 32][Emitter::kRoom];
    __shared__ std::uint32_t kept[Emitter::kMostKept * kEmitThreads];
    Emitter emit(buffers[threadIdx.x / 32], kept, list);
    const std::uint64_t i = static_cast<std::uint64_t>(blockIdx.x) * kEmitThreads + threadIdx.x;
    step(i, i < end, emit);
    emit.finish();
}

/// As runAppendWarp(), for a step with two lists that is so short that atomics would dominate: atomics on the counter
/// of a list are served one after the other, each in more than a nanosecond.
///
/// @tparam kPerLane indices of a lane, 32 apart. The buffer of a warp holds as many pairs of the first list; the
///     second list usually gets few pairs.
template <unsigned kPerLane, class Step>
__global__ void __launch_bounds__(kEmitThreads, kAppendWarpBlocks)
    runPartition(std::uint64_t end, const Step step, const DepthList first, const PairList second)
{
    constexpr unsigned kWarps = kEmitThreads / 32;
    using First = BallotEmitter<32 * (kPerLane == 1 ? 2 : kPerLane), DepthList>;
    using Second = BallotEmitter<64>;
    __shared__ alignas(8) RowPair ofFirst[kWarps][First::kSlots];
    __shared__ alignas(8) RowPair ofSecond[kWarps][Second::kRoom];
    First toFirst(ofFirst[threadIdx.x / 32], first);
    Second toSecond(ofSecond[threadIdx.x / 32], second);
    const std::uint64_t warp = (static_cast<std::uint64_t>(blockIdx.x) * kEmitThreads + threadIdx.x) / 32;
    std::uint64_t i = 32 * kPerLane * warp + threadIdx.x % 32;
    const auto read = [&] { return i < end ? step.read(i) : DepthPair{}; };
    DepthPair next = read();
#pragma unroll 1
    for (unsigned k = 0; k < kPerLane; ++k)
    {
        const DepthPair item = next;
        i += 32;
        if (k + 1 < kPerLane)
            next = read();
        step(item, toFirst, toSecond);
    }
    toFirst.finish();
    toSecond.finish();
}

using WarpStepPairs = BallotEmitter<kPairsOfWarpStep>;

/// The emitter of steps whose lanes cooperate.
template <class Scratch>
struct WarpStepEmitter : WarpStepPairs
{
    static constexpr std::uint32_t kLanes = 32;

    Scratch* shared;  ///< scratch memory of the warp

    __device__ WarpStepEmitter(const WarpStepPairs& emitter, Scratch* scratch)
        : WarpStepPairs(emitter), shared(scratch)
    {
    }

    __device__ Scratch& scratch() const { return *shared; }
    __device__ std::uint32_t lane() const { return threadIdx.x % kLanes; }
    __device__ void sync() const { __syncwarp(); }
    __device__ std::uint32_t ballot(bool isMine) const { return __ballot_sync(kAll, isMine); }
    __device__ std::uint32_t countOf(std::uint32_t lanes) const { return __popc(lanes); }
    __device__ std::uint32_t rankIn(std::uint32_t lanes) const
    {
        return __popc(lanes & ((1u << lane()) - 1u));
    }
    __device__ std::uint32_t from(std::uint32_t value, std::uint32_t lane) const
    {
        return __shfl_sync(kAll, value, static_cast<int>(lane));
    }
    __device__ std::uint32_t sum(std::uint32_t value) const
    {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 800
        return __reduce_add_sync(kAll, value);
#else
        for (int distance = 1; distance < 32; distance *= 2)
            value += __shfl_xor_sync(kAll, value, distance);
        return value;
#endif
    }
    __device__ float least(float value) const
    {
        return fromOrdered(leastOf(ordered(value)));
    }

    /// Appends pairAt(k) for each bit k that is set, in each lane. Lanes write their pairs to consecutive places,
    /// without a ballot for each pair.
    template <class PairAt>
    __device__ void appendEach(std::uint32_t bits, const PairAt& pairAt)
    {
        const unsigned count = __popc(bits);
        const unsigned upTo = sumUpToLane(count);
        const unsigned total = __shfl_sync(kAll, upTo, 31);
        if (bufferedCount + total > kRoom)
            finish();
        if (total > kRoom)
            return appendInTurn(bits, pairAt);
        std::uint32_t to = buffer + sizeof(RowPair) * (bufferedCount + upTo - count);
        for (; bits != 0; to += sizeof(RowPair))
        {
            const unsigned k = 31u - __clz(bits);
            storeShared(to, pairAt(k));
            bits ^= 1u << k;
        }
        bufferedCount += total;
    }

private:
    template <class PairAt>
    __device__ void appendInTurn(std::uint32_t bits, const PairAt& pairAt)
    {
        for (; any(bits != 0); bits &= bits - 1)
            append(bits != 0, bits != 0 ? pairAt(lowestBit(bits)) : RowPair{});
    }

    /// The bits of a float as an integer with the same order.
    __device__ static int ordered(float value)
    {
        const int bits = __float_as_int(value);
        return bits ^ ((bits >> 31) & 0x7fffffff);
    }
    __device__ static float fromOrdered(int number)
    {
        return __int_as_float(number ^ ((number >> 31) & 0x7fffffff));
    }
    __device__ static int leastOf(int number)
    {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 800
        return __reduce_min_sync(kAll, number);
#else
        for (int distance = 1; distance < 32; distance *= 2)
            number = min(number, __shfl_xor_sync(kAll, number, distance));
        return number;
#endif
    }
};

template <class Step>
__global__ void __launch_bounds__(kEmitThreads, kWarpStepBlocks)
    runWarp(std::uint64_t end, const Step step, const PairList list)
{
    using Scratch = typename Step::Scratch;
    __shared__ alignas(8) RowPair buffers[kEmitThreads / 32][WarpStepPairs::kRoom];
    __shared__ Scratch scratches[kEmitThreads / 32];
    WarpStepEmitter<Scratch> emit({buffers[threadIdx.x / 32], list}, &scratches[threadIdx.x / 32]);
    const std::uint64_t i = static_cast<std::uint64_t>(blockIdx.x) * kEmitThreads + threadIdx.x;
    step(i, i < end, emit);
    emit.finish();
}

/// As runAppendWarp(), for bins: a block distributes the slots of its bins over its lanes. Most bins have no record
/// or one, and lanes with a bin each would wait for those with more.
template <std::uint32_t kSharers, class Step>
__global__ void __launch_bounds__(kEmitThreads, kBinSlotBlocks)
    runBinSlots(std::uint32_t bins, const Step step, const PairList list)
{
    constexpr unsigned kBins = kEmitThreads / kSharers;
    constexpr unsigned kSlots = 16;  // a power of two: the bin and the slot are bits of a number
    static_assert(Step::kMostRoom <= kSlots, "a bin has more slots than there are numbers for");
    __shared__ alignas(8) RowPair buffers[kEmitThreads / 32][BufferedEmitter<>::kRoom];
    __shared__ std::uint32_t kept[BufferedEmitter<>::kMostKept * kEmitThreads];
    __shared__ std::uint16_t slots[kBins * Step::kMostRoom];
    __shared__ std::uint32_t slotCount;
    const std::uint32_t firstBin = blockIdx.x * kBins;
    const std::uint32_t bin = firstBin + threadIdx.x;
    const bool isBin = threadIdx.x < kBins && bin < bins;
    if (threadIdx.x == 0)
        slotCount = 0;
    if (isBin)
        step.clear(bin);
    __syncthreads();
    syncGridDependency();
    BufferedEmitter<> emit(buffers[threadIdx.x / 32], kept, list);

    // In any order: a scan would take more instructions, and each warp executes only some hundred.
    const std::uint32_t count = isBin ? step.countOf(bin) : 0;
    const std::uint32_t first = count != 0 ? atomicAdd(&slotCount, count) : 0;
#pragma unroll 1
    for (std::uint32_t k = 0; k < count; ++k)
        slots[first + k] = static_cast<std::uint16_t>(threadIdx.x * kSlots + k);
    __syncthreads();
    const std::uint32_t total = slotCount;
    if (isBin)
        step.begin(bin, emit);

    for (std::uint32_t base = 0; base < total * kSharers; base += kEmitThreads)
    {
        const std::uint32_t index = (base + threadIdx.x) / kSharers;
        const bool isSlot = index < total;
        if (!emit.any(isSlot))
            break;
        const std::uint32_t slot = slots[isSlot ? index : total - 1];
        step(firstBin + slot / kSlots, slot % kSlots, threadIdx.x % kSharers, isSlot, emit);
    }
    emit.finish();
}
}  // namespace cullet::psap
