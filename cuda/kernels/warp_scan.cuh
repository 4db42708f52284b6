// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>

namespace cullet::psap
{
/// Sum of the values of all lanes up to this one; all lanes of a warp call.
template <class T>
__device__ T sumUpToLane(T value)
{
#pragma unroll
    for (unsigned distance = 1; distance < 32; distance *= 2)
    {
        const T before = __shfl_up_sync(0xffffffffu, value, distance);
        value += threadIdx.x % 32 >= distance ? before : T{};
    }
    return value;
}
/// With a shuffle that also returns whether the source lane exists, which CUDA's function does not.
__device__ inline std::uint32_t sumUpToLane(std::uint32_t value)
{
#pragma unroll
    for (unsigned distance = 1; distance < 32; distance *= 2)
        asm volatile(
            "{\n"
            ".reg .u32 before;\n"
            ".reg .pred isThere;\n"
            "shfl.sync.up.b32 before|isThere, %0, %1, 0, 0xffffffff;\n"
            "@isThere add.u32 %0, %0, before;\n"
            "}"
            : "+r"(value)
            : "r"(distance));
    return value;
}
}  // namespace cullet::psap
