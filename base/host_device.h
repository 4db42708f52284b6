// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>

/// Marks a function that the CPU and the GPU run from the same source. Empty outside nvcc.
#ifdef __CUDACC__
#define CULLET_HOST_DEVICE __host__ __device__
#else
#define CULLET_HOST_DEVICE
#endif

/// Unrolls the loop that follows on the GPU, so that what it indexes stays in registers.
#ifdef __CUDA_ARCH__
#define CULLET_UNROLL _Pragma("unroll")
#else
#define CULLET_UNROLL
#endif

namespace cullet
{
/// Number of zeros above the highest bit set.
///
/// @pre bits != 0
CULLET_HOST_DEVICE inline int leadingZeros(std::uint64_t bits)
{
#ifdef __CUDA_ARCH__
    return __clzll(static_cast<long long>(bits));
#else
    return __builtin_clzll(bits);
#endif
}

/// Adds 1 atomically to a counter of arrivals; returns the previous value. Whoever arrives sees what earlier ones wrote
/// before they arrived.
CULLET_HOST_DEVICE inline std::uint32_t arriveAt(std::uint32_t* counter)
{
#ifdef __CUDA_ARCH__
    __threadfence();
    const std::uint32_t before = atomicAdd(counter, 1u);
    __threadfence();
    return before;
#else
    return __atomic_fetch_add(counter, 1u, __ATOMIC_ACQ_REL);
#endif
}
}  // namespace cullet
