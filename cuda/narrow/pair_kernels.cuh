// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/cuda/kernels/cuda_exec.cuh"
#include "cullet/cuda/narrow/depth_steps.h"
#include "cullet/cuda/narrow/pair_distance.h"
#include "cullet/cuda/narrow/pair_steps.h"

#include <algorithm>
#include <cstdint>

/// The kernels of convex pairs, and the executor that launches them. Steps are grid constants, since views of hulls
/// point into them: else each thread would copy them.
namespace cullet::convex
{
inline constexpr unsigned kPairThreads = 128;

/// The place of this lane's element in a queue, with one atomic for the lanes that append together.
__device__ inline std::uint32_t placeInQueue(std::uint32_t* count)
{
    const unsigned lanes = __activemask();
    const unsigned lane = threadIdx.x % 32;
    const auto leader = static_cast<unsigned>(__ffs(static_cast<int>(lanes)) - 1);
    std::uint32_t first = 0;
    if (lane == leader)
        first = atomicAdd(count, static_cast<unsigned>(__popc(lanes)));
    first = __shfl_sync(lanes, first, static_cast<int>(leader));
    return first + static_cast<std::uint32_t>(__popc(lanes & ((1u << lane) - 1u)));
}

/// The supports of all lanes of a warp. Eight lanes read a block of vertices together, one lane's after another, so
/// that a warp reads four blocks at a time; where a block does not prove its vertex, its lane climbs alone.
///
/// @param isAsked whether this lane has a side
__device__ inline Support<float> supportsTogether(const HullLane* lanes, bool isAsked,
                                                  const HullSide<float>& side)
{
    constexpr unsigned kAll = 0xffffffffu;
    constexpr unsigned kFirstOfEach = 0x01010101u;
    const unsigned lane = threadIdx.x % 32, within = lane % kBlockLanes, first = lane - within;
    const bool isClimbing = isAsked && side.hull.isClimbable();
    const std::int32_t start = isClimbing ? side.hull.startOf(side.direction, side.start) : 0;
    const std::uint32_t block = isClimbing ? side.hull.blockOf(start) : 0;
    const float band = isClimbing ? side.hull.bandFor(side.direction) : 0.0f;
    const unsigned asking = __ballot_sync(kAll, isClimbing);
    float height = 0.0f;
    unsigned rivals = 1;
#pragma unroll
    for (unsigned k = 0; k < kBlockLanes; ++k)
    {
        if ((asking >> k & kFirstOfEach) == 0)
            continue;
        const int from = static_cast<int>(first + k);
        const std::uint64_t place = std::uint64_t{__shfl_sync(kAll, block, from)} * kBlockLanes + within;
        const Vec<float> d = {__shfl_sync(kAll, side.direction.x, from),
                              __shfl_sync(kAll, side.direction.y, from),
                              __shfl_sync(kAll, side.direction.z, from)};
        const float low = __shfl_sync(kAll, band, from);
        const HullLane mine = lanes[place];
        const float product = HullView::productOf(mine, d);
        const float own = __shfl_sync(kAll, product, static_cast<int>(first));
        // Lane 0 asks for the next block, which this does not read.
        const bool isRival = within == 0 ? mine.id >= 0 : product >= own - low;
        const unsigned found = __ballot_sync(kAll, isRival) >> first & 0xffu;
        if (within == k)
        {
            height = own;
            rivals = found;
        }
    }
    if (!isAsked)
        return {0, 0.0f};
    if (isClimbing && rivals == 0)
        return {start, height};
    return side.hull.support(side.direction, isClimbing ? start : side.start);
}

/// A thread for each pair. Fewer registers than the compiler would like, since the loads of a pair follow from each
/// other.
template <class Step>
__global__ void __launch_bounds__(kPairThreads, 8)
    routePairs(std::uint32_t count, const __grid_constant__ Step step, const PairQueues queues)
{
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    const auto pair = static_cast<std::uint32_t>(i);
    typename Step::Query query = {};
    PairRoute route = i < count ? step.begin(pair, query) : PairRoute::Done;
    const bool isAsked = route == PairRoute::Asked;
    const HullLane* const lanes = step.reader.hulls.lanes;
    const Support<float> a = supportsTogether(lanes, isAsked, query.a);
    const Support<float> b = supportsTogether(lanes, isAsked, query.b);
    if (isAsked)
        route = step.finish(pair, query, a, b);
    if (route == PairRoute::Failed)
        queues.searched[placeInQueue(&queues.counts->failed)] = pair;
    else if (route == PairRoute::Remembered)
        queues.searched[count - 1 - placeInQueue(&queues.counts->remembered)] = pair;
}

/// A thread for each queued pair. Whole warps for either end of the queue, since remembered pairs take another way.
template <class Step>
__global__ void __launch_bounds__(kPairThreads)
    searchQueue(std::uint32_t count, const __grid_constant__ Step step, const PairQueues queues)
{
    const std::uint64_t failed = queues.counts->failed, remembered = queues.counts->remembered;
    const std::uint64_t failedLanes = (failed + 31) / 32 * 32;
    const std::uint64_t stride = std::uint64_t{gridDim.x} * blockDim.x;
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < failedLanes + remembered;
         i += stride)
    {
        const bool isFailed = i < failed;
        if (!isFailed && i < failedLanes)
            continue;
        const std::uint32_t pair = queues.searched[isFailed ? i : count - 1 - (i - failedLanes)];
        if (!step(pair, isFailed ? PairRoute::Failed : PairRoute::Remembered))
            queues.doubtful[placeInQueue(&queues.counts->doubtful)] = pair;
    }
}

template <class Step>
__global__ void __launch_bounds__(kPairThreads)
    searchDoubtful(const __grid_constant__ Step step, const PairQueues queues)
{
    const std::uint64_t doubtful = queues.counts->doubtful;
    const std::uint64_t stride = std::uint64_t{gridDim.x} * blockDim.x;
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < doubtful; i += stride)
        step(queues.doubtful[i]);
}

template <class Step>
__global__ void runOnce(const __grid_constant__ Step step)
{
    step(0);
}

template <class Step>
__global__ void __launch_bounds__(kPairThreads)
    measurePairs(std::uint32_t count, const __grid_constant__ Step step)
{
    const std::uint64_t pair = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (pair < count)
        step(pair);
}

/// With no more registers than let a multiprocessor run the lanes of ContactQueries at once.
template <class Step>
__global__ void __launch_bounds__(kPairThreads, 3)
    runLanes(std::uint32_t lanes, const __grid_constant__ Step step)
{
    const std::uint64_t lane = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (lane < lanes)
        step(lane);
}

__device__ inline LeastBound shuffledDown(const LeastBound& from, unsigned by)
{
    constexpr unsigned kAll = 0xffffffffu;
    const auto shuffled = [by](auto value) { return __shfl_down_sync(kAll, value, by); };
    LeastBound to;
    to.bound.outward = {shuffled(from.bound.outward.x), shuffled(from.bound.outward.y),
                        shuffled(from.bound.outward.z)};
    to.bound.depth = shuffled(from.bound.depth);
    to.feature = shuffled(static_cast<unsigned long long>(from.feature));
    return to;
}

/// A warp for each queued pair.
template <class Step>
__global__ void __launch_bounds__(kPairThreads) examineQueue(const __grid_constant__ Step step)
{
    static_assert(Step::kLanes == 32, "a warp");
    const std::uint64_t queued = step.lists.counts->examined;
    const std::uint64_t stride = std::uint64_t{gridDim.x} * blockDim.x / Step::kLanes;
    const std::uint32_t lane = threadIdx.x % Step::kLanes;
    for (std::uint64_t i = (std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x) / Step::kLanes; i < queued;
         i += stride)
    {
        LeastBound least = step.examine(i, lane);
        for (unsigned by = Step::kLanes / 2; by > 0; by /= 2)
            least.take(shuffledDown(least, by));
        if (lane == 0)
            step.finish(i, least);
        __syncwarp();
    }
}

/// Runs the steps of convex pairs on one CUDA device, on one stream; see HostPairExec.
class CudaPairExec : public psap::CudaExec
{
public:
    CudaPairExec(int device, cudaStream_t stream) : CudaExec(optionsFor(device), stream)
    {
        CULLET_CUDA_TRY(cudaDeviceGetAttribute(&m_multiprocessors, cudaDevAttrMultiProcessorCount, device));
    }

    void testAxes(std::uint32_t count, const TestAxes& step, const PairQueues& queues)
    {
        psap::launch(stream(), routePairs<TestAxes>, count, kPairThreads, count, step, queues);
    }

    void searchInFloat(std::uint32_t count, const SearchInFloat& step, const PairQueues& queues)
    {
        psap::launch(stream(), searchQueue<SearchInFloat>, threadsFor(count, 16), kPairThreads, count, step,
                     queues);
    }

    void searchInDouble(std::uint32_t count, const SearchInDouble& step, const PairQueues& queues)
    {
        psap::launch(stream(), searchDoubtful<SearchInDouble>, threadsFor(count, 2), kPairThreads, step,
                     queues);
    }

    template <class Step>
    void forOne(const Step& step)
    {
        psap::launch(stream(), runOnce<Step>, 1, 1, step);
    }

    void measureDistances(std::uint32_t count, const MeasureDistances& step)
    {
        psap::launch(stream(), measurePairs<MeasureDistances>, count, kPairThreads, count, step);
    }

    std::uint32_t lanesFor(std::uint32_t count, std::uint32_t mostOfProcessor) const
    {
        return std::min(count, static_cast<std::uint32_t>(m_multiprocessors) * mostOfProcessor);
    }

    template <class Step>
    void forEachLane(std::uint32_t lanes, const Step& step)
    {
        psap::launch(stream(), runLanes<Step>, lanes, kPairThreads, lanes, step);
    }

    void examineDepths(std::uint32_t count, const ExamineDepths& step)
    {
        psap::launch(stream(), examineQueue<ExamineDepths>,
                     std::min(std::uint64_t{count} * ExamineDepths::kLanes,
                              static_cast<std::uint64_t>(m_multiprocessors) * 4 * kPairThreads),
                     kPairThreads, step);
    }

private:
    static PsapOptions optionsFor(int device)
    {
        PsapOptions options;
        options.device = device;
        return options;
    }

    /// Threads for a queue, the length of which is known to the device only.
    ///
    /// @param blocks of each multiprocessor, at most
    std::uint64_t threadsFor(std::uint32_t count, std::uint64_t blocks) const
    {
        return std::min(std::uint64_t{count},
                        static_cast<std::uint64_t>(m_multiprocessors) * blocks * kPairThreads);
    }

    int m_multiprocessors = 0;
};
}  // namespace cullet::convex
