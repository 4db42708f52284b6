// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "broad/row_soa.h"

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
    static Value load(const float* p) { return _mm_loadu_ps(p); }
    static Value broadcast(float v) { return _mm_set1_ps(v); }
    static Value subtract(Value a, Value b) { return _mm_sub_ps(a, b); }
    static Value larger(Value a, Value b) { return _mm_max_ps(a, b); }
    static Mask le(Value a, Value b) { return _mm_cmple_ps(a, b); }
    static Mask both(Mask a, Mask b) { return _mm_and_ps(a, b); }
    static std::uint32_t bits(Mask m) { return static_cast<std::uint32_t>(_mm_movemask_ps(m)); }
};
constexpr std::uint32_t kLanesFull = 0xf;
#else
/// Portable single lane, for processors without SSE2.
struct Lanes
{
    using Value = float;
    using Mask = bool;
    static constexpr std::uint32_t kWidth = 1;
    static Value load(const float* p) { return *p; }
    static Value broadcast(float v) { return v; }
    static Value subtract(Value a, Value b) { return a - b; }
    static Value larger(Value a, Value b) { return a > b ? a : b; }
    static Mask le(Value a, Value b) { return a <= b; }
    static Mask both(Mask a, Mask b) { return a && b; }
    static std::uint32_t bits(Mask m) { return m ? 1u : 0u; }
};
constexpr std::uint32_t kLanesFull = 1;
#endif
}  // namespace

#include "broad/row_kernels.inl"

const RowKernels kRowKernelsBaseline = {"baseline", scanSelf, scanCross, scanOne};

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
