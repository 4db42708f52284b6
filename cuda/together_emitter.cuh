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

/// What a step sees of its list on the GPU where the lanes of a warp go together: no lane asks for a place, the votes of
/// all tell it. A full buffer is written out, so that a small one is enough and more of the cache is left.
struct TogetherEmitter
{
    static constexpr unsigned kRoom = 128;
    static constexpr std::uint32_t kMostKept = 8;
    static constexpr unsigned kAll = 0xffffffffu;

    IdPair* buffer;  ///< [kRoom] of the warp
    unsigned held;   ///< in the buffer, the same in all lanes
    PairList list;
    std::uint32_t* keptRecords;  ///< of this lane: every kEmitThreads-th, kMostKept of them
    std::uint32_t keptRecordCount;

    __device__ bool isFull() const { return keptRecordCount == kMostKept; }
    __device__ void keep(std::uint32_t record) { keptRecords[kEmitThreads * keptRecordCount++] = record; }
    __device__ std::uint32_t keptCount() const { return keptRecordCount; }
    __device__ std::uint32_t kept(std::uint32_t k) const { return keptRecords[kEmitThreads * k]; }
    __device__ void dropKept() { keptRecordCount = 0; }

    __device__ void push(IdPair pair) { list.push(pair); }
    __device__ void tested(std::uint64_t) {}
    __device__ bool any(bool isMine) const { return __any_sync(kAll, isMine) != 0; }
    __device__ void append(bool isMine, IdPair pair)
    {
        const unsigned lanes = __ballot_sync(kAll, isMine);
        if (isMine)
            buffer[held + __popc(lanes & ((1u << threadIdx.x % 32) - 1u))] = pair;
        held += __popc(lanes);
        if (held > kRoom - 32)
            flush();
    }
    __device__ void flush()
    {
        __syncwarp();
        appendTogether(list, buffer, held);
        __syncwarp();
        held = 0;
    }
};
}  // namespace cullet::psap
