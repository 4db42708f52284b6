// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "broad/cell_rule.h"
#include "broad/row_soa.h"

#include <algorithm>
#include <cstring>
#include <limits>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace cullet
{
namespace
{
#if defined(__SSE2__)
struct Lanes
{
    using Value = __m128;
    using Mask = __m128;
    static constexpr std::uint32_t kWidth = 4;
    static constexpr std::uint32_t kFull = 0xf;
    static Value load(const float* p) { return _mm_loadu_ps(p); }
    static Value broadcast(float v) { return _mm_set1_ps(v); }
    static Value subtract(Value a, Value b) { return _mm_sub_ps(a, b); }
    static Value larger(Value a, Value b) { return _mm_max_ps(a, b); }
    static Mask le(Value a, Value b) { return _mm_cmple_ps(a, b); }
    static std::uint32_t bits(Mask m) { return static_cast<std::uint32_t>(_mm_movemask_ps(m)); }

    static void append(std::uint32_t hits, Value gap, FlaggedId id, const FlaggedId* ids, PairBuffer& out)
    {
        if (hits == 0)
            return;
        float gaps[kWidth];
        _mm_storeu_ps(gaps, gap);
        do
        {
            const auto lane = static_cast<std::uint32_t>(__builtin_ctz(hits));
            hits &= hits - 1;
            out.first[out.count] = id;
            out.second[out.count] = ids[lane];
            out.gap[out.count] = gaps[lane];
            // Unconditional store, conditional advance: duplicates over cells are about a quarter of all hits, which a
            // branch would mispredict.
            out.count += (id | ids[lane]) >= kOwnsPair ? 1u : 0u;
        } while (hits != 0);
    }
};
#else
/// Portable single lane, for processors without SSE2.
struct Lanes
{
    using Value = float;
    using Mask = bool;
    static constexpr std::uint32_t kWidth = 1;
    static constexpr std::uint32_t kFull = 1;
    static Value load(const float* p) { return *p; }
    static Value broadcast(float v) { return v; }
    static Value subtract(Value a, Value b) { return a - b; }
    static Value larger(Value a, Value b) { return a > b ? a : b; }
    static Mask le(Value a, Value b) { return a <= b; }
    static std::uint32_t bits(Mask m) { return m ? 1u : 0u; }
    static void append(std::uint32_t hits, Value gap, FlaggedId id, const FlaggedId* ids, PairBuffer& out)
    {
        out.first[out.count] = id;
        out.second[out.count] = *ids;
        out.gap[out.count] = gap;
        out.count += hits != 0 && (id | *ids) >= kOwnsPair ? 1u : 0u;
    }
};
#endif
}  // namespace

#include "broad/row_kernels.inl"

const RowKernels kRowKernelsBaseline = {"baseline", scanSelf, scanCross, scanOne, gatherRow, layOut};

const RowKernels& chooseRowKernels(bool baseline)
{
#if defined(__x86_64__)
    if (!baseline && __builtin_cpu_supports("avx512f") != 0)
        return kRowKernelsAvx512;
    if (!baseline && __builtin_cpu_supports("avx2") != 0)
        return kRowKernelsAvx2;
#else
    (void)baseline;
#endif
    return kRowKernelsBaseline;
}
}  // namespace cullet
