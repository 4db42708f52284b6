// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// cullet_device_pairs [BODIES]: a broad phase for a simulation on the GPU.
//
// Balls fly through a box on the device. In every frame one kernel moves them and writes their boxes, DevicePairFinder
// finds the overlapping pairs, and another kernel counts the neighbours of each ball from them. All of it runs on one
// stream; the CPU reads only the number of pairs. cullet_device_deltas avoids that, too.

#include "cullet/cuda/device_pairs.h"
#include "cullet/demos/device_balls.cuh"

#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>

namespace
{
using namespace cullet;

constexpr int kFrames = 100;

__global__ void __launch_bounds__(kThreads)
    countNeighbours(const RowPair* pairs, std::uint64_t count, unsigned* neighbours)
{
    const std::uint64_t i = static_cast<std::uint64_t>(blockIdx.x) * kThreads + threadIdx.x;
    if (i >= count)
        return;
    atomicAdd(&neighbours[pairs[i].a], 1u);
    atomicAdd(&neighbours[pairs[i].b], 1u);
}

void run(std::uint32_t balls)
{
    cudaStream_t stream = nullptr;
    checkCuda(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
    std::string why;
    const auto finder = makeDevicePairFinder({}, stream, &why);
    if (!finder)
        throw std::runtime_error(why);
    Aabb* boxes = allocate<Aabb>(balls);
    unsigned* neighbours = allocate<unsigned>(balls);
    const float side = std::cbrt(32.0f * static_cast<float>(balls));
    for (int frame = 0; frame < kFrames; ++frame)
    {
        fly<<<blocksFor(balls), kThreads, 0, stream>>>(balls, side, 0.1f * static_cast<float>(frame), boxes);
        checkCuda(cudaMemsetAsync(neighbours, 0, balls * sizeof(unsigned), stream));
        DevicePairs found;
        if (finder->enqueue(boxes, balls) != Status::Ok || finder->collect(found) != Status::Ok)
            throw std::runtime_error("the search failed");
        if (found.count != 0)
            countNeighbours<<<blocksFor(found.count), kThreads, 0, stream>>>(found.pairs, found.count,
                                                                             neighbours);
        checkCuda(cudaGetLastError());
        if (frame % 10 == 0)
            std::printf("frame %d: %llu pairs, %.2f neighbours per ball\n", frame,
                        static_cast<unsigned long long>(found.count),
                        2.0 * static_cast<double>(found.count) / balls);
    }
    checkCuda(cudaStreamSynchronize(stream));
    checkCuda(cudaFree(neighbours));
    checkCuda(cudaFree(boxes));
}
}  // namespace

int main(int argc, char** argv)
{
    return mainWithBalls("cullet_device_pairs", argc, argv, run);
}
