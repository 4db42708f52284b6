// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/simd_vector.h"

#if defined(__SSE2__)
#include <emmintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

/// What vectors of 16 bytes, a register of every x86-64, ARMv8 and POWER8, need beyond the vector extension. Each processor
/// gives the same bits. All is inlined, so that a source for a wider instruction set leaves no copy of its own to the linker.
namespace cullet
{
using FourFloats = VectorOf<float, 4>::Type;
using TwoDoubles = VectorOf<double, 2>::Type;

[[gnu::always_inline]] inline FourFloats loadFour(const float* from)
{
    FourFloats four;
    __builtin_memcpy(&four, from, sizeof(four));
    return four;
}

/// Bit i: lane i of the result of a comparison is set, that is, all of its bits are.
[[gnu::always_inline]] inline unsigned laneBits(const MaskOf<FourFloats>& mask)
{
#if defined(__SSE2__)
    return static_cast<unsigned>(_mm_movemask_ps(reinterpret_cast<__m128>(mask)));
#elif defined(__aarch64__)
    return vaddvq_u32(vandq_u32(reinterpret_cast<uint32x4_t>(mask), uint32x4_t{1, 2, 4, 8}));
#else
    return (mask[0] & 1u) | (mask[1] & 2u) | (mask[2] & 4u) | (mask[3] & 8u);
#endif
}

[[gnu::always_inline]] inline unsigned laneBits(const MaskOf<TwoDoubles>& mask)
{
#if defined(__SSE2__)
    return static_cast<unsigned>(_mm_movemask_pd(reinterpret_cast<__m128d>(mask)));
#elif defined(__aarch64__)
    return static_cast<unsigned>(vaddvq_u64(vandq_u64(reinterpret_cast<uint64x2_t>(mask), uint64x2_t{1, 2})));
#else
    return static_cast<unsigned>((mask[0] & 1) | (mask[1] & 2));
#endif
}

/// The larger number of each lane; b where they are equal or one is NaN, as x86's instruction does. The instructions of
/// other processors do not, and GCC does not find x86's in a comparison.
[[gnu::always_inline]] inline FourFloats largerOf(const FourFloats& a, const FourFloats& b)
{
#if defined(__SSE2__)
    return reinterpret_cast<FourFloats>(_mm_max_ps(reinterpret_cast<__m128>(a), reinterpret_cast<__m128>(b)));
#else
    return a > b ? a : b;
#endif
}

[[gnu::always_inline]] inline TwoDoubles largerOf(const TwoDoubles& a, const TwoDoubles& b)
{
#if defined(__SSE2__)
    return reinterpret_cast<TwoDoubles>(
        _mm_max_pd(reinterpret_cast<__m128d>(a), reinterpret_cast<__m128d>(b)));
#else
    return a > b ? a : b;
#endif
}

/// The smaller number of each lane; b where they are equal or one is NaN.
[[gnu::always_inline]] inline FourFloats smallerOf(const FourFloats& a, const FourFloats& b)
{
#if defined(__SSE2__)
    return reinterpret_cast<FourFloats>(_mm_min_ps(reinterpret_cast<__m128>(a), reinterpret_cast<__m128>(b)));
#else
    return a < b ? a : b;
#endif
}

[[gnu::always_inline]] inline TwoDoubles smallerOf(const TwoDoubles& a, const TwoDoubles& b)
{
#if defined(__SSE2__)
    return reinterpret_cast<TwoDoubles>(
        _mm_min_pd(reinterpret_cast<__m128d>(a), reinterpret_cast<__m128d>(b)));
#else
    return a < b ? a : b;
#endif
}

/// Square root without the call by which std::sqrt() sets errno for a negative argument.
[[gnu::always_inline]] inline float squareRoot(float x)
{
#if defined(__SSE2__)
    // All lanes, since the compiler moves one lane beside zeros through an integer register.
    return _mm_cvtss_f32(_mm_sqrt_ss(_mm_set1_ps(x)));
#elif defined(__aarch64__)
    return vget_lane_f32(vsqrt_f32(vdup_n_f32(x)), 0);
#else
    return __builtin_sqrtf(x);
#endif
}

[[gnu::always_inline]] inline double squareRoot(double x)
{
#if defined(__SSE2__)
    return _mm_cvtsd_f64(_mm_sqrt_sd(_mm_setzero_pd(), _mm_set1_pd(x)));
#elif defined(__aarch64__)
    return vget_lane_f64(vsqrt_f64(vdup_n_f64(x)), 0);
#else
    return __builtin_sqrt(x);
#endif
}
}  // namespace cullet
