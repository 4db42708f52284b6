// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/psap_pairs.h"

#include <cstdint>

namespace cullet::psap
{
inline constexpr unsigned kEmitThreads = 128;

/// Appends pairs that a warp holds in shared memory; all its lanes call.
///
/// @param pairAt(k) gives the k-th as it lies in memory: as two numbers, it would be written twice
/// @param depthAt(k) by how much its boxes overlap
/// @param depths [list.capacity, out] null: not asked for
template <class PairAt, class DepthAt>
__device__ void appendTogether(const PairList& list, unsigned count, const PairAt& pairAt, float* depths,
                               const DepthAt& depthAt)
{
    const unsigned lane = threadIdx.x % 32;
    unsigned long long base = 0;
    if (lane == 0)
        base = fetchAdd(list.count, std::uint64_t{count});
    base = __shfl_sync(0xffffffffu, base, 0);
    auto* to = reinterpret_cast<uint2*>(list.pairs);
    for (unsigned k = lane; k < count; k += 32)
    {
        if (base + k >= list.capacity)
            continue;
        to[base + k] = pairAt(k);
        if (depths != nullptr)
            depths[base + k] = depthAt(k);
    }
}
template <class PairAt>
__device__ void appendTogether(const PairList& list, unsigned count, const PairAt& pairAt)
{
    appendTogether(list, count, pairAt, nullptr, [](unsigned) { return 0.0f; });
}

/// Where something lies in shared memory, as a number that stays in a register. It comes by way of a shuffle, so that
/// the compiler does not compute it again, from where the block's memory begins, at each use.
__device__ inline std::uint32_t addressInShared(const void* something)
{
    return __shfl_sync(0xffffffffu, static_cast<std::uint32_t>(__cvta_generic_to_shared(something)),
                       static_cast<int>(threadIdx.x % 32));
}
__device__ inline void storeShared(std::uint32_t address, std::uint32_t value)
{
    asm volatile("st.shared.u32 [%0], %1;" ::"r"(address), "r"(value) : "memory");
}
__device__ inline void storeShared(std::uint32_t address, IdPair pair)
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

/// How many of some lanes of a warp come before this one. A special register tells which: no other is kept for that.
__device__ inline std::uint32_t countBefore(std::uint32_t lanes)
{
    std::uint32_t before = 0;
    asm volatile("mov.u32 %0, %%lanemask_lt;" : "=r"(before));
    return __popc(lanes & before);
}

/// What a step sees of its list on the GPU where the lanes of a warp go together: no lane asks for a place, the votes of
/// all tell it. A full buffer is written out, so that a small one is enough and more of the cache is left.
///
/// @tparam kPairs that a warp has room for
template <unsigned kPairs = 128>
struct TogetherEmitter
{
    static constexpr unsigned kRoom = kPairs;
    static constexpr unsigned kAll = 0xffffffffu;

    std::uint32_t buffer;  ///< [kRoom] pairs of the warp: an address in shared memory
    unsigned held;         ///< in the buffer, the same in all lanes
    PairList list;

    __device__ TogetherEmitter(const IdPair* pairs, const PairList& whole)
        : buffer(addressInShared(pairs)), held(0), list(whole)
    {
    }

    __device__ void push(IdPair pair) { list.push(pair); }
    __device__ void tested(std::uint64_t) {}
    __device__ bool any(bool isMine) const { return __any_sync(kAll, isMine) != 0; }
    __device__ void append(bool isMine, IdPair pair)
    {
        const unsigned lanes = __ballot_sync(kAll, isMine);
        if (isMine)
            storeShared(buffer + sizeof(IdPair) * (held + countBefore(lanes)), pair);
        held += __popc(lanes);
        if (held > kRoom - 32)
            flush();
    }
    /// Writes out what there is.
    __device__ void finish()
    {
        if (held != 0)
            flush();
    }

private:
    __device__ void flush()
    {
        __syncwarp();
        appendTogether(list, held, [&](unsigned k) { return loadSharedPair(buffer + sizeof(IdPair) * k); });
        __syncwarp();
        held = 0;
    }
};

/// The same for pairs with depths.
template <unsigned kPairs>
struct DepthEmitter
{
    static constexpr unsigned kRoom = kPairs;
    static constexpr unsigned kAll = 0xffffffffu;

    std::uint32_t buffer;  ///< [kRoom] pairs of the warp, then their depths: an address in shared memory
    unsigned held;         ///< in the buffer, the same in all lanes
    DepthList list;

    /// @param room [kRoom + kRoom / 2] of the warp
    __device__ DepthEmitter(const IdPair* room, const DepthList& whole)
        : buffer(addressInShared(room)), held(0), list(whole)
    {
    }

    __device__ void append(bool isMine, IdPair pair, float depth)
    {
        const unsigned lanes = __ballot_sync(kAll, isMine);
        const unsigned k = held + countBefore(lanes);
        if (isMine)
        {
            storeShared(pairAt(k), pair);
            storeShared(depthAt(k), __float_as_uint(depth));
        }
        held += __popc(lanes);
        if (held > kRoom - 32)
            flush();
    }
    /// Writes out what there is.
    __device__ void finish()
    {
        if (held != 0)
            flush();
    }

private:
    __device__ std::uint32_t pairAt(unsigned k) const { return buffer + sizeof(IdPair) * k; }
    __device__ std::uint32_t depthAt(unsigned k) const
    {
        return buffer + sizeof(IdPair) * kRoom + sizeof(float) * k;
    }

    __device__ void flush()
    {
        __syncwarp();
        appendTogether(
            list.pairs, held, [&](unsigned k) { return loadSharedPair(pairAt(k)); }, list.depths,
            [&](unsigned k) { return __uint_as_float(loadShared(depthAt(k))); });
        __syncwarp();
        held = 0;
    }
};

/// What a step sees of a list.
template <class List, unsigned kPairs>
struct EmitterFor : TogetherEmitter<kPairs>
{
    static constexpr unsigned kSlots = kPairs;  ///< for a warp

    using TogetherEmitter<kPairs>::TogetherEmitter;
};
template <unsigned kPairs>
struct EmitterFor<DepthList, kPairs> : DepthEmitter<kPairs>
{
    static constexpr unsigned kSlots = kPairs + kPairs / 2;

    using DepthEmitter<kPairs>::DepthEmitter;
};

/// The same for a step that keeps some of what it finds for a while.
template <unsigned kPairs = 128>
struct KeepingEmitter : TogetherEmitter<kPairs>
{
    static constexpr std::uint32_t kMostKept = 8;
    static constexpr std::uint32_t kStride = sizeof(std::uint32_t) * kEmitThreads;

    std::uint32_t firstKept, endOfKept;  ///< of this lane: addresses in shared memory, kStride apart

    /// @param room [kMostKept * kEmitThreads] of the block
    __device__ KeepingEmitter(const IdPair* pairs, const std::uint32_t* room, const PairList& whole)
        : TogetherEmitter<kPairs>(pairs, whole),
          firstKept(addressInShared(room + threadIdx.x)),
          endOfKept(firstKept)
    {
    }

    __device__ bool isFull() const { return endOfKept - firstKept == kMostKept * kStride; }
    __device__ bool hasRoomForTwo() const { return endOfKept - firstKept <= (kMostKept - 2) * kStride; }
    __device__ void keep(std::uint32_t something)
    {
        storeShared(endOfKept, something);
        endOfKept += kStride;
    }
    __device__ std::uint32_t keptCount() const { return (endOfKept - firstKept) / kStride; }
    __device__ std::uint32_t kept(std::uint32_t k) const { return loadShared(firstKept + k * kStride); }
    __device__ void dropKept() { endOfKept = firstKept; }
};
}  // namespace cullet::psap
