// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/records.h"
#include "cullet/broad/psap/exec/shared_memory.h"

#include <cstdint>

/// The memory that the lanes of a warp share, and how they divide their tests (warp_search.h).
namespace cullet::psap
{
/// The box around some records.
struct Region
{
    float s0, s1, u0, u1, v0, v1;

    CULLET_HOST_DEVICE static Region emptyBox()
    {
        return {kInfinity, -kInfinity, kInfinity, -kInfinity, kInfinity, -kInfinity};
    }

    CULLET_HOST_DEVICE void include(const SortRecord& record)
    {
        s0 = record.front.s0 < s0 ? record.front.s0 : s0;
        s1 = record.front.s1 > s1 ? record.front.s1 : s1;
        u0 = record.front.u0 < u0 ? record.front.u0 : u0;
        u1 = record.front.u1 > u1 ? record.front.u1 : u1;
        v0 = record.back.v0 < v0 ? record.back.v0 : v0;
        v1 = record.back.v1 > v1 ? record.back.v1 : v1;
    }

    CULLET_HOST_DEVICE bool meets(const SortRecord& record) const
    {
        return (int{psap::meets({s0, s1, u0, u1}, record.front)} &
                int{psap::meets({v0, v1, 0, 0}, record.back)}) != 0;
    }

    CULLET_HOST_DEVICE bool isLongerThan(float length) const
    {
        return s1 - s0 > length || u1 - u0 > length || v1 - v0 > length;
    }
};

/// hits |= bit, if the boxes overlap.
CULLET_HOST_DEVICE inline void addIfMeets(std::uint32_t& hits, std::uint32_t bit, const SortRecord& a,
                                          const SortRecord& b)
{
#ifdef __CUDA_ARCH__
    // In a sequence of many tests the compiler keeps the result of each comparison apart, runs out of predicates, and
    // needs 12 instructions per test.
    asm("{\n"
        ".reg .pred p;\n"
        "setp.le.f32 p, %2, %3;\n"
        "setp.le.and.f32 p, %4, %5, p;\n"
        "setp.le.and.f32 p, %6, %7, p;\n"
        "setp.le.and.f32 p, %8, %9, p;\n"
        "setp.le.and.f32 p, %10, %11, p;\n"
        "setp.le.and.f32 p, %12, %13, p;\n"
        "@p or.b32 %0, %0, %1;\n"
        "}"
        : "+r"(hits)
        : "r"(bit), "f"(a.front.s0), "f"(b.front.s1), "f"(b.front.s0), "f"(a.front.s1), "f"(a.front.u0),
          "f"(b.front.u1), "f"(b.front.u0), "f"(a.front.u1), "f"(a.back.v0), "f"(b.back.v1), "f"(b.back.v0),
          "f"(a.back.v1));
#else
    hits |= meets(a, b) ? bit : 0;
#endif
}

/// The records that a warp has queued for tests, in a ring buffer. Three arrays, so that consecutive lanes access
/// consecutive addresses.
struct WarpScratch
{
    static constexpr std::uint32_t kTestsPerBatch = 32;
    static constexpr std::uint32_t kRecords = 2 * kTestsPerBatch;

    struct alignas(8) Height
    {
        float v0, v1;
    };

    SortRecord::Front fronts[kRecords];
    Height heights[kRecords];
    std::uint32_t rows[kRecords];

    CULLET_HOST_DEVICE void put(std::uint32_t k, const SortRecord& record)
    {
#ifdef __CUDA_ARCH__
        // The index is computed once, not for each array.
        asm volatile("" : "+r"(k));
#endif
        fronts[k] = record.front;
        heights[k] = {record.back.v0, record.back.v1};
        rows[k] = record.back.row;
    }
    /// The record without its bin.
    CULLET_HOST_DEVICE SortRecord at(std::uint32_t k) const
    {
        return {fronts[k], {heights[k].v0, heights[k].v1, rows[k], kNoBin}};
    }
};

/// Rows of a WarpScratch, starting with a given one.
class ScratchRows
{
public:
#ifdef __CUDA_ARCH__
    // An address in shared memory, in a register.
    __device__ explicit ScratchRows(const std::uint32_t* first)
        : m_first(static_cast<std::uint32_t>(__cvta_generic_to_shared(first)))
    {
        asm volatile("" : "+r"(m_first));
    }
    __device__ std::uint32_t at(std::uint32_t k) const
    {
        return loadShared(m_first + static_cast<std::uint32_t>(sizeof(std::uint32_t)) * k);
    }

private:
    std::uint32_t m_first;
#else
    CULLET_HOST_DEVICE explicit ScratchRows(const std::uint32_t* first) : m_first(first) {}
    CULLET_HOST_DEVICE std::uint32_t at(std::uint32_t k) const
    {
        return m_first[k];
    }

private:
    const std::uint32_t* m_first;
#endif
};

/// How kLanes lanes, each with a record, divide the tests of all their records against other ones. The lanes form
/// kCount parts. Each part has all the records, kCount in each of its lanes, and tests them against every kCount-th
/// other record. One load of another record then serves more tests, and lanes find more equal numbers of pairs.
///
/// The result of a lane has a bit for each of its records and each turn, those of its first record lowest.
template <std::uint32_t kLanes>
struct HalfWarps
{
    static constexpr std::uint32_t kCount = kLanes < 2 ? 1 : 2;
    static constexpr std::uint32_t kSize = kLanes / kCount;
    static constexpr std::uint32_t kTurns = WarpScratch::kTestsPerBatch / kCount;

    std::uint32_t lane;

    CULLET_HOST_DEVICE std::uint32_t number() const { return lane / kSize; }

    /// Lane whose record is the k-th one of this lane; its own is the first.
    CULLET_HOST_DEVICE std::uint32_t laneOf(std::uint32_t k) const { return lane ^ k * kSize; }

    /// The bits of the records of a set of lanes.
    CULLET_HOST_DEVICE std::uint32_t bitsOf(std::uint32_t lanes) const
    {
        std::uint32_t bits = 0;
        CULLET_UNROLL
        for (std::uint32_t k = 0; k < kCount; ++k)
            bits |= (lanes >> laneOf(k) & 1u) != 0 ? ~0u >> (32 - kTurns) << kTurns * k : 0;
        return bits;
    }

    /// The bits of the turns in which there is another record, where fewer than kTestsPerBatch others are queued.
    CULLET_HOST_DEVICE std::uint32_t bitsWithin(std::uint32_t others) const
    {
        const std::uint32_t turns = (others + kCount - 1 - number()) / kCount;
        std::uint32_t bits = 0;
        CULLET_UNROLL
        for (std::uint32_t k = 0; k < kCount; ++k)
            bits |= ((1u << turns) - 1) << kTurns * k;
        return bits;
    }
};
}  // namespace cullet::psap
