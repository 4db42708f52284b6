// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/host_device.h"

#include <cstdint>
#include <cstring>

namespace cullet
{
/// Adds atomically to a counter that other indices of the same step also add to; returns the previous value.
///
/// Relaxed: steps of a pipeline are separated by barriers, and no index reads what another one wrote.
CULLET_HOST_DEVICE inline std::uint32_t fetchAdd(std::uint32_t* counter, std::uint32_t value)
{
#ifdef __CUDA_ARCH__
    return atomicAdd(counter, value);
#else
    return __atomic_fetch_add(counter, value, __ATOMIC_RELAXED);
#endif
}

CULLET_HOST_DEVICE inline std::uint64_t fetchAdd(std::uint64_t* counter, std::uint64_t value)
{
#ifdef __CUDA_ARCH__
    static_assert(sizeof(unsigned long long) == sizeof(std::uint64_t), "CUDA's 64-bit atomic");
    return atomicAdd(reinterpret_cast<unsigned long long*>(counter), static_cast<unsigned long long>(value));
#else
    return __atomic_fetch_add(counter, value, __ATOMIC_RELAXED);
#endif
}

/// Sets bits atomically of a word in which other indices of the same step also set bits.
CULLET_HOST_DEVICE inline void setBits(std::uint32_t* word, std::uint32_t bits)
{
#ifdef __CUDA_ARCH__
    atomicOr(word, bits);
#else
    __atomic_fetch_or(word, bits, __ATOMIC_RELAXED);
#endif
}

/// Stores `value` atomically if the slot contains `expected`; returns the previous value, `expected` on success.
CULLET_HOST_DEVICE inline std::uint64_t compareExchange(std::uint64_t* slot, std::uint64_t expected,
                                                        std::uint64_t value)
{
#ifdef __CUDA_ARCH__
    return atomicCAS(reinterpret_cast<unsigned long long*>(slot), static_cast<unsigned long long>(expected),
                     static_cast<unsigned long long>(value));
#else
    __atomic_compare_exchange_n(slot, &expected, value, false, __ATOMIC_RELAXED, __ATOMIC_RELAXED);
    return expected;
#endif
}

/// Index of the lowest bit set.
///
/// @pre bits != 0
CULLET_HOST_DEVICE inline std::uint32_t lowestBit(std::uint32_t bits)
{
#ifdef __CUDA_ARCH__
    return static_cast<std::uint32_t>(__ffs(static_cast<int>(bits)) - 1);
#else
    return static_cast<std::uint32_t>(__builtin_ctz(bits));
#endif
}

/// Number of bits that represent `number`: 0 for 0.
CULLET_HOST_DEVICE inline std::uint32_t bitWidthOf(std::uint32_t number)
{
#ifdef __CUDA_ARCH__
    return 32u - static_cast<std::uint32_t>(__clz(static_cast<int>(number)));
#else
    return number == 0 ? 0 : 32u - static_cast<std::uint32_t>(__builtin_clz(number));
#endif
}

/// Reads 16 aligned bytes of memory that no running kernel writes, on a GPU through the cache for such memory.
template <class T>
CULLET_HOST_DEVICE inline T readConstant(const T* from)
{
    static_assert(sizeof(T) == 16 && alignof(T) == 16, "one load");
#ifdef __CUDA_ARCH__
    const float4 words = __ldg(reinterpret_cast<const float4*>(from));
    T value;
    memcpy(&value, &words, sizeof value);
    return value;
#else
    return *from;
#endif
}

CULLET_HOST_DEVICE inline std::uint32_t bitsOf(float value)
{
    std::uint32_t bits = 0;
    memcpy(&bits, &value, sizeof(bits));
    return bits;
}
}  // namespace cullet
