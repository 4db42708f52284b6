// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/demos/bench/cuda/support/cuda_timing.h"

#include <cuda_runtime.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <stdexcept>

// Balls in device memory, for the programs that find their pairs there.
namespace cullet
{
inline constexpr unsigned kThreads = 256;

inline unsigned blocksFor(std::uint64_t count)
{
    return static_cast<unsigned>((count + kThreads - 1) / kThreads);
}

template <class T>
T* allocate(std::uint64_t count)
{
    void* memory = nullptr;
    checkCuda(cudaMalloc(&memory, count * sizeof(T)));
    return static_cast<T*>(memory);
}

/// A number in [0, 1) for a ball, constant over all frames.
__device__ inline float fractionOf(std::uint32_t ball, std::uint32_t stream)
{
    std::uint32_t bits = ball * 2654435761u ^ stream * 2246822519u;
    bits = (bits ^ bits >> 15) * 2246822519u;
    bits = (bits ^ bits >> 13) * 3266489917u;
    return static_cast<float>((bits ^ bits >> 16) >> 8) / 16777216.0f;
}

/// Moves balls of radius 1 back and forth between the walls.
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

/// Runs a program whose argument is the number of balls, by default 100,000.
inline int mainWithBalls(const char* program, int argc, char** argv,
                         const std::function<void(std::uint32_t)>& run)
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
        std::fprintf(stderr, "%s: %s\n", program, error.what());
        return 1;
    }
}
}  // namespace cullet
