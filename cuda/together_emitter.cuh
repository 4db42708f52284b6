// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/psap_pairs.h"

#include <cstdint>

namespace cullet::psap
{
inline constexpr unsigned kEmitThreads = 128;

/// Appends pairs that a warp holds in shared memory; all its lanes call.
__device__ inline void appendTogether(const PairList& list, const IdPair* pairs, unsigned count)
{
    const unsigned lane = threadIdx.x % 32;
    unsigned long long base = 0;
    if (lane == 0)
        base = fetchAdd(list.count, std::uint64_t{count});
    base = __shfl_sync(0xffffffffu, base, 0);
    // A pair at a time: as two numbers, it would be written twice.
    const auto* from = reinterpret_cast<const uint2*>(pairs);
    auto* to = reinterpret_cast<uint2*>(list.pairs);
    for (unsigned k = lane; k < count; k += 32)
    {
        if (base + k < list.capacity)
            to[base + k] = from[k];
    }
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

/// What a step sees of its list on the GPU where the lanes of a warp go together: no lane asks for a place, the votes of
/// all tell it. A full buffer is written out, so that a small one is enough and more of the cache is left.
struct TogetherEmitter
{
    static constexpr unsigned kRoom = 128;
    static constexpr unsigned kAll = 0xffffffffu;

    IdPair* buffer;         ///< [kRoom] of the warp
    std::uint32_t address;  ///< of the buffer in shared memory
    unsigned held;          ///< in the buffer, the same in all lanes
    PairList list;

    __device__ TogetherEmitter(IdPair* pairs, const PairList& whole)
        : buffer(pairs), address(addressInShared(pairs)), held(0), list(whole)
    {
    }

    __device__ void push(IdPair pair) { list.push(pair); }
    __device__ void tested(std::uint64_t) {}
    __device__ bool any(bool isMine) const { return __any_sync(kAll, isMine) != 0; }
    __device__ void append(bool isMine, IdPair pair)
    {
        const unsigned lanes = __ballot_sync(kAll, isMine);
        if (isMine)
            storeShared(address + sizeof(IdPair) * (held + __popc(lanes & ((1u << threadIdx.x % 32) - 1u))),
                        pair);
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
        appendTogether(list, buffer, held);
        __syncwarp();
        held = 0;
    }
};

/// The same for a step that keeps some of what it finds for a while.
struct KeepingEmitter : TogetherEmitter
{
    static constexpr std::uint32_t kMostKept = 8;
    static constexpr std::uint32_t kStride = sizeof(std::uint32_t) * kEmitThreads;

    std::uint32_t firstKept, endOfKept;  ///< of this lane: addresses in shared memory, kStride apart

    /// @param room [kMostKept * kEmitThreads] of the block
    __device__ KeepingEmitter(IdPair* pairs, const std::uint32_t* room, const PairList& whole)
        : TogetherEmitter(pairs, whole), firstKept(addressInShared(room + threadIdx.x)), endOfKept(firstKept)
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
