// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Compiled with -mavx512f; entered only where the processor has it.
#include "broad/row_soa.h"

#if defined(__x86_64__)
#include <immintrin.h>

namespace cullet
{
namespace
{
struct Lanes
{
    using Value = __m512;
    using Mask = __mmask16;
    static constexpr std::uint32_t kWidth = 16;
    static Value load(const float* p) { return _mm512_loadu_ps(p); }
    static Value broadcast(float v) { return _mm512_set1_ps(v); }
    static Value subtract(Value a, Value b) { return _mm512_sub_ps(a, b); }
    static Value larger(Value a, Value b) { return _mm512_max_ps(a, b); }
    static Mask le(Value a, Value b) { return _mm512_cmp_ps_mask(a, b, _CMP_LE_OQ); }
    static Mask both(Mask a, Mask b) { return static_cast<Mask>(a & b); }
    static std::uint32_t bits(Mask m) { return m; }
};
constexpr std::uint32_t kLanesFull = 0xffff;
}  // namespace

#include "broad/row_kernels.inl"

const RowKernels kRowKernelsAvx512 = {"avx512", scanSelf, scanCross, scanOne};
}  // namespace cullet
#endif  // x86-64
