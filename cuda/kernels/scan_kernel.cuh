// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/cuda/kernels/warp_scan.cuh"

#include <cstdint>

/// The kernel for scans that fit into one block.
namespace cullet::psap
{
inline constexpr unsigned kScanThreads = 1024;
/// One block scans so many elements in the time that CUB's two launches take to start.
inline constexpr unsigned kMostPerThread = 16;
inline constexpr std::uint64_t kMostInBlock = kMostPerThread * kScanThreads;

/// out[i] = sum of in[0 .. i-1]. Each warp has a contiguous part, whose elements are interleaved over its lanes; it
/// loads all of them before it uses any.
///
/// @tparam kPerLane elements of a thread
template <unsigned kPerLane, class T>
__global__ void __launch_bounds__(kScanThreads) scanInBlock(const T* in, T* out, unsigned count)
{
    constexpr unsigned kAll = 0xffffffffu;
    __shared__ T totals[kScanThreads / 32];
    const unsigned warp = threadIdx.x / 32;
    const unsigned lane = threadIdx.x % 32;
    const unsigned begin = 32 * kPerLane * warp + lane;
    T sums[kPerLane];
#pragma unroll
    for (unsigned k = 0; k < kPerLane; ++k)
        sums[k] = begin + 32 * k < count ? in[begin + 32 * k] : T{};
    T total = 0;
#pragma unroll
    for (unsigned k = 0; k < kPerLane; ++k)
    {
        const T upTo = sumUpToLane(sums[k]);
        sums[k] = total + upTo - sums[k];
        total += __shfl_sync(kAll, upTo, 31);
    }
    if (lane == 0)
        totals[warp] = total;
    __syncthreads();
    const T upToWarp = sumUpToLane(totals[lane]);
    const T before = __shfl_sync(kAll, upToWarp, static_cast<int>(warp)) - total;
#pragma unroll
    for (unsigned k = 0; k < kPerLane; ++k)
    {
        if (begin + 32 * k < count)
            out[begin + 32 * k] = before + sums[k];
    }
}
}  // namespace cullet::psap
