// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// cullet_device_pairs [BODIES]: a broad phase for a simulation that lives on the GPU.
//
// Balls fly through a box on the device. In every frame one kernel moves them and writes their boxes, DevicePairFinder
// finds the overlapping pairs, and another kernel counts the neighbours of each ball from them. All of it is put on one
// stream; nothing but the number of pairs ever comes to the CPU.

#include "cuda/device_pairs.h"

#include <cuda_runtime.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>

namespace
{
using namespace cullet;

constexpr unsigned kThreads = 256;
constexpr int kFrames = 100;

void check(cudaError_t error)
{
    if (error != cudaSuccess)
        throw std::runtime_error(cudaGetErrorString(error));
}

unsigned blocksFor(std::uint64_t count)
{
    return static_cast<unsigned>((count + kThreads - 1) / kThreads);
}

template <class T>
T* allocate(std::uint64_t count)
{
    void* memory = nullptr;
    check(cudaMalloc(&memory, count * sizeof(T)));
    return static_cast<T*>(memory);
}

/// A number in [0, 1) of a ball, the same in every frame.
__device__ float fractionOf(std::uint32_t ball, std::uint32_t stream)
{
    std::uint32_t bits = ball * 2654435761u ^ stream * 2246822519u;
    bits = (bits ^ bits >> 15) * 2246822519u;
    bits = (bits ^ bits >> 13) * 3266489917u;
    return static_cast<float>((bits ^ bits >> 16) >> 8) / 16777216.0f;
}

/// Balls of radius 1 go back and forth between the walls.
__global__ void __launch_bounds__(kThreads) fly(std::uint32_t count, float side, float time, Aabb* boxes)
{
    const std::uint32_t ball = blockIdx.x * kThreads + threadIdx.x;
    if (ball >= count)
        return;
    for (std::uint32_t axis = 0; axis < 3; ++axis)
    {
        const float way = side * fractionOf(ball, axis) + time * (fractionOf(ball, axis + 3) - 0.5f);
        const float folded = fabsf(fmodf(way, 2 * side));
        const float centre = folded < side ? folded : 2 * side - folded;
        boxes[ball].min[axis] = centre - 1;
        boxes[ball].max[axis] = centre + 1;
    }
}

__global__ void __launch_bounds__(kThreads)
    countNeighbours(const IdPair* pairs, std::uint64_t count, unsigned* neighbours)
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
    check(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
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
        check(cudaMemsetAsync(neighbours, 0, balls * sizeof(unsigned), stream));
        DevicePairs found;
        if (finder->enqueue(boxes, balls) != Status::Ok || finder->collect(found) != Status::Ok)
            throw std::runtime_error("the search failed");
        if (found.count != 0)
            countNeighbours<<<blocksFor(found.count), kThreads, 0, stream>>>(found.pairs, found.count,
                                                                             neighbours);
        check(cudaGetLastError());
        if (frame % 10 == 0)
            std::printf("frame %d: %llu pairs, %.2f neighbours per ball\n", frame,
                        static_cast<unsigned long long>(found.count),
                        2.0 * static_cast<double>(found.count) / balls);
    }
    check(cudaStreamSynchronize(stream));
    check(cudaFree(neighbours));
    check(cudaFree(boxes));
}
}  // namespace

int main(int argc, char** argv)
{
    try
    {
        const long balls = argc > 1 ? std::atol(argv[1]) : 100000;
        if (balls < 1 || balls > 100000000)
            throw std::runtime_error("between 1 and 100000000 bodies");
        run(static_cast<std::uint32_t>(balls));
        return 0;
    }
    catch (const std::exception& error)
    {
        std::fprintf(stderr, "cullet_device_pairs: %s\n", error.what());
        return 1;
    }
}
