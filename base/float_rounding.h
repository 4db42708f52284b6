// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>
#include <cstring>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace cullet
{
/// The float before or after one that is not infinite in that direction, as std::nextafter() without a call and without
/// floating-point exceptions.
///
/// @param isUp   whether the result is the next larger float
/// @param isStep false: returns the value. Not a branch, since callers cannot predict it
inline float stepFloat(float value, bool isUp, bool isStep) noexcept
{
    std::int32_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    constexpr std::int32_t kSign = INT32_MIN;
    if ((bits & ~kSign) == 0 && isStep)
        bits = isUp ? 0 : kSign;  // the zero that is next to the smallest numbers of that side
    // Larger bits are farther from zero.
    bits += (bits < 0) != isUp ? std::int32_t{isStep} : -std::int32_t{isStep};
    std::memcpy(&value, &bits, sizeof bits);
    return value;
}

/// Largest float that is not above `value`; -inf and +inf stay, a value beyond the float range becomes -inf or FLT_MAX.
inline float roundDownToFloat(double value) noexcept
{
    const float nearest = static_cast<float>(value);
    return stepFloat(nearest, false, static_cast<double>(nearest) > value);
}

/// Smallest float that is not below `value`.
inline float roundUpToFloat(double value) noexcept
{
    const float nearest = static_cast<float>(value);
    return stepFloat(nearest, true, static_cast<double>(nearest) < value);
}

#ifdef __SSE2__
/// Rounds three numbers as roundUpToFloat(), or as roundDownToFloat(), in half of the instructions.
template <bool kIsUp>
inline void roundThreeToFloat(double a, double b, double c, float (&rounded)[3]) noexcept
{
    const __m128d xy = _mm_set_pd(b, a), z = _mm_set_sd(c);
    const __m128 nearXy = _mm_cvtpd_ps(xy), nearZ = _mm_cvtpd_ps(z);
    const __m128d backXy = _mm_cvtps_pd(nearXy), backZ = _mm_cvtps_pd(nearZ);
    const __m128d isOffXy = kIsUp ? _mm_cmplt_pd(backXy, xy) : _mm_cmpgt_pd(backXy, xy);
    const __m128d isOffZ = kIsUp ? _mm_cmplt_pd(backZ, z) : _mm_cmpgt_pd(backZ, z);
    const __m128i isOff = _mm_castps_si128(
        _mm_shuffle_ps(_mm_castpd_ps(isOffXy), _mm_castpd_ps(isOffZ), _MM_SHUFFLE(2, 0, 2, 0)));
    __m128i bits = _mm_castps_si128(_mm_movelh_ps(nearXy, nearZ));
    // As stepFloat().
    const __m128i isZero =
        _mm_and_si128(isOff, _mm_cmpeq_epi32(_mm_add_epi32(bits, bits), _mm_setzero_si128()));
    bits = kIsUp ? _mm_andnot_si128(isZero, bits) : _mm_or_si128(bits, _mm_slli_epi32(isZero, 31));
    // 1 for a positive number, -1 for a negative one: away from zero, as bits.
    const __m128i away = _mm_or_si128(_mm_srai_epi32(bits, 31), _mm_set1_epi32(1));
    const __m128i step = _mm_and_si128(isOff, away);
    bits = kIsUp ? _mm_add_epi32(bits, step) : _mm_sub_epi32(bits, step);
    const __m128 result = _mm_castsi128_ps(bits);
    _mm_storel_pi(reinterpret_cast<__m64*>(rounded), result);
    _mm_store_ss(rounded + 2, _mm_movehl_ps(result, result));
}
#else
template <bool kIsUp>
inline void roundThreeToFloat(double a, double b, double c, float (&rounded)[3]) noexcept
{
    rounded[0] = kIsUp ? roundUpToFloat(a) : roundDownToFloat(a);
    rounded[1] = kIsUp ? roundUpToFloat(b) : roundDownToFloat(b);
    rounded[2] = kIsUp ? roundUpToFloat(c) : roundDownToFloat(c);
}
#endif
}  // namespace cullet
