// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#ifdef __CUDACC__

#include "cullet/broad/row_pair.h"

#include <cstdint>

/// Access to the shared memory of a block on the GPU by 32-bit addresses, which stay in registers.
namespace cullet::psap
{
/// Address of an object in shared memory, in a register. The shuffle hides its value from the compiler, which would
/// otherwise compute it again from the base of shared memory at each use.
__device__ inline std::uint32_t addressInShared(const void* something)
{
    return __shfl_sync(0xffffffffu, static_cast<std::uint32_t>(__cvta_generic_to_shared(something)),
                       static_cast<int>(threadIdx.x % 32));
}
__device__ inline void storeShared(std::uint32_t address, std::uint32_t value)
{
    asm volatile("st.shared.u32 [%0], %1;" ::"r"(address), "r"(value) : "memory");
}
__device__ inline void storeShared(std::uint32_t address, RowPair pair)
{
    asm volatile("st.shared.v2.u32 [%0], {%1, %2};" ::"r"(address), "r"(pair.a), "r"(pair.b) : "memory");
}
__device__ inline std::uint32_t loadShared(std::uint32_t address)
{
    std::uint32_t value = 0;
    asm volatile("ld.shared.u32 %0, [%1];" : "=r"(value) : "r"(address) : "memory");
    return value;
}

__device__ inline uint2 loadSharedPair(std::uint32_t address)
{
    uint2 pair = {};
    asm volatile("ld.shared.v2.u32 {%0, %1}, [%2];" : "=r"(pair.x), "=r"(pair.y) : "r"(address) : "memory");
    return pair;
}
}  // namespace cullet::psap

#endif
