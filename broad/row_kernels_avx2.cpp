// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Compiled with -mavx2; entered only where the processor has it.
#include "broad/row_soa.h"

#if defined(__x86_64__)
#include <immintrin.h>

namespace cullet
{
namespace
{
struct Lanes
{
    using Value = __m256;
    using Mask = __m256;
    static constexpr std::uint32_t kWidth = 8;
    static Value load(const float* p) { return _mm256_loadu_ps(p); }
    static Value broadcast(float v) { return _mm256_set1_ps(v); }
    static Value subtract(Value a, Value b) { return _mm256_sub_ps(a, b); }
    static Value larger(Value a, Value b) { return _mm256_max_ps(a, b); }
    static Mask le(Value a, Value b) { return _mm256_cmp_ps(a, b, _CMP_LE_OQ); }
    static Mask both(Mask a, Mask b) { return _mm256_and_ps(a, b); }
    static std::uint32_t bits(Mask m) { return static_cast<std::uint32_t>(_mm256_movemask_ps(m)); }
};
constexpr std::uint32_t kLanesFull = 0xff;
}  // namespace

#include "broad/row_kernels.inl"

const RowKernels kRowKernelsAvx2 = {"avx2", scanSelf, scanCross, scanOne};
}  // namespace cullet
#endif  // x86-64
