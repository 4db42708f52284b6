// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/cuda/support/pair_sums.h"

#include <cuda_runtime_api.h>

#include <cmath>
#include <stdexcept>

namespace cullet::test
{
namespace
{
constexpr unsigned kThreads = 256;
constexpr unsigned kTile = kThreads;          // boxes of a block in shared memory
constexpr unsigned kMine = 4;                 // boxes of a thread in registers
constexpr unsigned kRows = kThreads * kMine;  // boxes that a block tests against others
constexpr unsigned kOthers = 8192;            // number of these others

void check(cudaError_t error)
{
    if (error != cudaSuccess)
        throw std::runtime_error(cudaGetErrorString(error));
}

/// The box, or one for which every comparison is false.
__device__ Aabb boxOrNothing(const Aabb* boxes, std::uint32_t row, std::uint32_t count)
{
    if (row < count && isValid(boxes[row]))
        return boxes[row];
    return {{NAN, NAN, NAN}, {NAN, NAN, NAN}};
}

/// Both corners, laid out for few loads from shared memory.
struct alignas(16) TileBox
{
    float4 first;
    float2 last;
};

__device__ bool meet(const Aabb& a, const TileBox& b)
{
    // All six comparisons without branches, which would cost more.
    return (a.min[0] <= b.first.w) & (b.first.x <= a.max[0]) & (a.min[1] <= b.last.x) &
           (b.first.y <= a.max[1]) & (a.min[2] <= b.last.y) & (b.first.z <= a.max[2]);
}

__device__ void addTo(PairSum* total, const PairSum& sum)
{
    if (sum.count == 0)
        return;
    atomicAdd(reinterpret_cast<unsigned long long*>(&total->count), sum.count);
    atomicAdd(reinterpret_cast<unsigned long long*>(&total->hash), sum.hash);
}

/// Block (x, y) tests the x-th kRows boxes against the later ones of the y-th kOthers boxes.
__global__ void sumPairs(const Aabb* boxes, std::uint32_t count, PairSum* total)
{
    __shared__ TileBox tile[kTile];
    const std::uint32_t firstRow = blockIdx.x * kRows;
    const std::uint32_t end = min((blockIdx.y + 1) * kOthers, count);
    Aabb mine[kMine];
#pragma unroll
    for (unsigned k = 0; k < kMine; ++k)
        mine[k] = boxOrNothing(boxes, firstRow + k * kThreads + threadIdx.x, count);
    PairSum sum;
    for (std::uint32_t begin = max(blockIdx.y * kOthers, firstRow); begin < end; begin += kTile)
    {
        __syncthreads();
        const Aabb box = boxOrNothing(boxes, begin + threadIdx.x, count);
        tile[threadIdx.x] = {{box.min[0], box.min[1], box.min[2], box.max[0]}, {box.max[1], box.max[2]}};
        __syncthreads();
        for (unsigned other = 0; other < kTile; ++other)
        {
            const TileBox box = tile[other];
#pragma unroll
            for (unsigned k = 0; k < kMine; ++k)
            {
                const std::uint32_t row = firstRow + k * kThreads + threadIdx.x;
                if (meet(mine[k], box) && row < begin + other)
                    sum.add(row, begin + other);
            }
        }
    }
    addTo(total, sum);
}

__global__ void sumList(const RowPair* pairs, std::uint64_t count, PairSum* total)
{
    PairSum sum;
    for (std::uint64_t i = blockIdx.x * kThreads + threadIdx.x; i < count; i += gridDim.x * kThreads)
        sum.add(pairs[i].a, pairs[i].b);
    addTo(total, sum);
}

/// The sum that `launch` accumulates on the device.
template <class Launch>
PairSum summed(const Launch& launch)
{
    PairSum* total = nullptr;
    check(cudaMalloc(reinterpret_cast<void**>(&total), sizeof(PairSum)));
    check(cudaMemset(total, 0, sizeof(PairSum)));
    launch(total);
    check(cudaGetLastError());
    PairSum sum;
    check(cudaMemcpy(&sum, total, sizeof(sum), cudaMemcpyDeviceToHost));
    check(cudaFree(total));
    return sum;
}
}  // namespace

PairSum sumOfBruteForce(const Aabb* boxes, std::uint32_t count)
{
    const dim3 blocks((count + kRows - 1) / kRows, (count + kOthers - 1) / kOthers);
    return summed([&](PairSum* total) { sumPairs<<<blocks, kThreads>>>(boxes, count, total); });
}

PairSum sumOf(const DevicePairs& pairs)
{
    return summed([&](PairSum* total) { sumList<<<512, kThreads>>>(pairs.pairs, pairs.count, total); });
}
}  // namespace cullet::test
