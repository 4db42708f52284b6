// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/cuda/kernels/cuda_exec.cuh"
#include "cullet/cuda/narrow/pair_steps.h"

#include <algorithm>
#include <cstdint>

/// The kernels of convex pairs, and the executor that launches them.
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

template <class Step>
__global__ void __launch_bounds__(kPairThreads)
    routePairs(std::uint32_t count, const Step step, const PairQueues queues)
{
    const std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
    if (i >= count)
        return;
    const auto pair = static_cast<std::uint32_t>(i);
    const PairRoute route = step(pair);
    if (route == PairRoute::Failed)
        queues.searched[placeInQueue(&queues.counts->failed)] = pair;
    else if (route == PairRoute::Remembered)
        queues.searched[count - 1 - placeInQueue(&queues.counts->remembered)] = pair;
}

/// A thread for each queued pair. Whole warps for either end of the queue, since remembered pairs take another way.
template <class Step>
__global__ void __launch_bounds__(kPairThreads)
    searchQueue(std::uint32_t count, const Step step, const PairQueues queues)
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
__global__ void __launch_bounds__(kPairThreads) searchDoubtful(const Step step, const PairQueues queues)
{
    const std::uint64_t doubtful = queues.counts->doubtful;
    const std::uint64_t stride = std::uint64_t{gridDim.x} * blockDim.x;
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < doubtful; i += stride)
        step(queues.doubtful[i]);
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
        psap::launch(stream(), searchQueue<SearchInFloat>, threadsFor(count), kPairThreads, count, step,
                     queues);
    }

    void searchInDouble(std::uint32_t count, const SearchInDouble& step, const PairQueues& queues)
    {
        psap::launch(stream(), searchDoubtful<SearchInDouble>, threadsFor(count), kPairThreads, step, queues);
    }

private:
    static PsapOptions optionsFor(int device)
    {
        PsapOptions options;
        options.device = device;
        return options;
    }

    /// As many as the device holds at once: the length of a queue is known there only.
    std::uint64_t threadsFor(std::uint32_t count) const
    {
        constexpr std::uint64_t kBlocksPerMultiprocessor = 16;
        return std::min<std::uint64_t>(
            count, static_cast<std::uint64_t>(m_multiprocessors) * kBlocksPerMultiprocessor * kPairThreads);
    }

    int m_multiprocessors = 0;
};
}  // namespace cullet::convex
