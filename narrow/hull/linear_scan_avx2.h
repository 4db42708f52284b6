// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#ifdef __SSE2__
#include <algorithm>
#include <cstdint>
#include <immintrin.h>
#include <limits>

namespace cullet
{
/// Determined once, at program start.
inline const bool kHasAvx2 = (__builtin_cpu_init(), __builtin_cpu_supports("avx2") != 0);

struct LinearMaximum
{
    std::int32_t index;  ///< of the largest product, the lowest of equal ones; beyond the end if NaN
    float value;
};

/// A direction with each component in all lanes.
struct WideDirection
{
    __m256 x, y, z;
};

[[gnu::target("avx2"), gnu::always_inline]] inline WideDirection spreadAvx2(__m128 d)
{
    return {_mm256_broadcastss_ps(d), _mm256_broadcastss_ps(_mm_shuffle_ps(d, d, 0x55)),
            _mm256_broadcastss_ps(_mm_shuffle_ps(d, d, 0xaa))};
}

/// Rounds from left to right, so that the bits are the same as without AVX2.
template <class Rows>
[[gnu::target("avx2"), gnu::always_inline]] inline __m256 productsAvx2(const Rows& rows, std::int32_t i,
                                                                       const WideDirection& d)
{
    const __m256 xy = _mm256_add_ps(_mm256_mul_ps(_mm256_loadu_ps(rows.x() + i), d.x),
                                    _mm256_mul_ps(_mm256_loadu_ps(rows.y() + i), d.y));
    return _mm256_add_ps(xy, _mm256_mul_ps(_mm256_loadu_ps(rows.z() + i), d.z));
}

[[gnu::target("avx2"), gnu::always_inline]] inline __m256 largestInAllLanes(__m256 v)
{
    v = _mm256_max_ps(v, _mm256_permute2f128_ps(v, v, 1));
    v = _mm256_max_ps(v, _mm256_shuffle_ps(v, v, 0x4e));
    return _mm256_max_ps(v, _mm256_shuffle_ps(v, v, 0xb1));
}

[[gnu::target("avx2"), gnu::always_inline]] inline __m256d productsAvx2(const double* x, const double* y,
                                                                        const double* z,
                                                                        const __m256d (&d)[3])
{
    const __m256d xy =
        _mm256_add_pd(_mm256_mul_pd(_mm256_loadu_pd(x), d[0]), _mm256_mul_pd(_mm256_loadu_pd(y), d[1]));
    return _mm256_add_pd(xy, _mm256_mul_pd(_mm256_loadu_pd(z), d[2]));
}

/// Largest x[i] d[0] + y[i] d[1] + z[i] d[2]. A third of the instructions of the scan with four lanes.
template <class Rows>
[[gnu::target("avx2"), gnu::always_inline]] inline LinearMaximum linearMaximumOf(const Rows& rows,
                                                                                 const WideDirection& d)
{
    __m256 best = _mm256_set1_ps(-std::numeric_limits<float>::infinity());
    __m256i index = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    __m256i where = _mm256_set1_epi32(std::numeric_limits<std::int32_t>::max());
    const __m256i eight = _mm256_set1_epi32(8);
    const std::int32_t count = rows.paddedCount();
    for (std::int32_t i = 0; i < count; i += 8)
    {
        const __m256 product = productsAvx2(rows, i, d);
        const __m256 isLarger = _mm256_cmp_ps(product, best, _CMP_GT_OQ);
        // The maximum of a NaN and a number is the second operand. So only the index depends on the comparison.
        best = _mm256_max_ps(product, best);
        where = _mm256_blendv_epi8(where, index, _mm256_castps_si256(isLarger));
        index = _mm256_add_epi32(index, eight);
    }
    const __m256 all = largestInAllLanes(best);
    // Lowest index among the lanes that have the maximum.
    const __m256i others = _mm256_castps_si256(_mm256_cmp_ps(best, all, _CMP_NEQ_UQ));
    where = _mm256_or_si256(where, _mm256_srli_epi32(others, 1));
    __m128i low = _mm_min_epi32(_mm256_castsi256_si128(where), _mm256_extracti128_si256(where, 1));
    low = _mm_min_epi32(low, _mm_shuffle_epi32(low, 0x4e));
    low = _mm_min_epi32(low, _mm_shuffle_epi32(low, 0xb1));
    return {_mm_cvtsi128_si32(low), _mm256_cvtss_f32(all)};
}

/// @param direction three components and any fourth
template <class Rows>
[[gnu::target("avx2"), gnu::noinline]] LinearMaximum linearMaximumAvx2(const Rows& rows,
                                                                       const float* direction)
{
    return linearMaximumOf(rows, {_mm256_broadcast_ss(direction), _mm256_broadcast_ss(direction + 1),
                                  _mm256_broadcast_ss(direction + 2)});
}

/// The index of the largest x[i] d[0] + y[i] d[1] + z[i] d[2], the lowest of equal ones; beyond the end if NaN.
template <class Rows>
[[gnu::target("avx2"), gnu::noinline]] std::int64_t indexOfMaximumAvx2(const Rows& rows,
                                                                       const double* direction)
{
    const __m256d d[] = {_mm256_broadcast_sd(direction), _mm256_broadcast_sd(direction + 1),
                         _mm256_broadcast_sd(direction + 2)};
    __m256d best = _mm256_set1_pd(-std::numeric_limits<double>::infinity());
    __m256i index = _mm256_setr_epi64x(0, 1, 2, 3);
    __m256i where = _mm256_set1_epi64x(std::numeric_limits<std::int64_t>::max());
    const std::int32_t count = rows.paddedCount();
    for (std::int32_t i = 0; i < count; i += 4)
    {
        const __m256d product = productsAvx2(rows.x() + i, rows.y() + i, rows.z() + i, d);
        const __m256d isLarger = _mm256_cmp_pd(product, best, _CMP_GT_OQ);
        best = _mm256_max_pd(product, best);
        where = _mm256_blendv_epi8(where, index, _mm256_castpd_si256(isLarger));
        index = _mm256_add_epi64(index, _mm256_set1_epi64x(4));
    }
    __m256d all = _mm256_max_pd(best, _mm256_permute2f128_pd(best, best, 1));
    all = _mm256_max_pd(all, _mm256_shuffle_pd(all, all, 5));
    const __m256i others = _mm256_castpd_si256(_mm256_cmp_pd(best, all, _CMP_NEQ_UQ));
    where = _mm256_or_si256(where, _mm256_srli_epi64(others, 1));
    alignas(32) std::int64_t lanes[4];
    _mm256_store_si256(reinterpret_cast<__m256i*>(lanes), where);
    return std::min(std::min(lanes[0], lanes[1]), std::min(lanes[2], lanes[3]));
}

/// See bitsOfHigh().
template <class Rows>
[[gnu::target("avx2"), gnu::noinline]] std::uint64_t bitsOfHighAvx2(const Rows& rows, const float* direction,
                                                                    float low, std::int32_t begin)
{
    const WideDirection d = {_mm256_broadcast_ss(direction), _mm256_broadcast_ss(direction + 1),
                             _mm256_broadcast_ss(direction + 2)};
    const std::int32_t count = std::min(rows.paddedCount() - begin, 64);
    std::uint64_t below = 0;
    for (std::int32_t i = 0; i < count; i += 8)
    {
        const __m256 isBelow =
            _mm256_cmp_ps(productsAvx2(rows, begin + i, d), _mm256_set1_ps(low), _CMP_LT_OQ);
        below |= std::uint64_t(static_cast<unsigned>(_mm256_movemask_ps(isBelow))) << i;
    }
    return ~below;
}

template <class Rows>
[[gnu::target("avx2"), gnu::noinline]] std::uint64_t bitsOfHighAvx2(const Rows& rows, const double* direction,
                                                                    double low, std::int32_t begin)
{
    const __m256d d[] = {_mm256_broadcast_sd(direction), _mm256_broadcast_sd(direction + 1),
                         _mm256_broadcast_sd(direction + 2)};
    const double *const x = rows.x() + begin, *const y = rows.y() + begin, *const z = rows.z() + begin;
    const std::int32_t count = std::min(rows.paddedCount() - begin, 64);
    std::uint64_t below = 0;
    for (std::int32_t i = 0; i < count; i += 4)
    {
        const __m256d isBelow =
            _mm256_cmp_pd(productsAvx2(x + i, y + i, z + i, d), _mm256_set1_pd(low), _CMP_LT_OQ);
        below |= std::uint64_t(static_cast<unsigned>(_mm256_movemask_pd(isBelow))) << i;
    }
    return ~below;
}

template <class Rows>
[[gnu::target("avx2"), gnu::always_inline]] inline float largestProductOf(const Rows& rows, __m128 direction)
{
    const WideDirection d = spreadAvx2(direction);
    __m256 best = productsAvx2(rows, 0, d);
    const std::int32_t count = rows.paddedCount();
    for (std::int32_t i = 8; i < count; i += 8)
        best = _mm256_max_ps(best, productsAvx2(rows, i, d));
    return _mm256_cvtss_f32(largestInAllLanes(best));
}

/// The largest products of two hulls, without their vertices.
template <class Rows>
[[gnu::target("avx2"), gnu::noinline]] void largestProductsAvx2(const Rows& a, __m128 directionA,
                                                                const Rows& b, __m128 directionB,
                                                                float (&largest)[2])
{
    largest[0] = largestProductOf(a, directionA);
    largest[1] = largestProductOf(b, directionB);
}
}  // namespace cullet
#endif
