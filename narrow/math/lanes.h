// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/base/simd_vector.h"
#include "cullet/base/vector16.h"

#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

/// Vectors of lanes for the support searches: GCC's vector extension, and intrinsics where it has no equivalent.
namespace cullet
{
/// 16-byte vectors, the width that every x86-64 and ARMv8 has; eight lanes are two or four of them.
template <class S>
struct Lanes
{
    static constexpr int kWidth = static_cast<int>(16 / sizeof(S));
    using Vector = typename VectorOf<S, kWidth>::Type;
    using Mask = MaskOf<Vector>;
    using Integer = LaneOf<Mask>;

    static Vector load(const S* p)
    {
        Vector v;
        std::memcpy(&v, p, sizeof(v));
        return v;
    }
    /// @pre p is a multiple of 16 bytes: the load then becomes a memory operand
    static Vector loadAligned(const S* p)
    {
        Vector v;
        std::memcpy(&v, __builtin_assume_aligned(p, sizeof(v)), sizeof(v));
        return v;
    }
    static Vector fill(S value)
    {
        // Vector{} + value would cost an addition.
        if constexpr (kWidth == 4)
            return Vector{value, value, value, value};
        else
            return Vector{value, value};
    }
    static Mask largest() { return Mask{} + std::numeric_limits<Integer>::max(); }
    static Vector magnitude(Vector v)
    {
        return reinterpret_cast<Vector>(reinterpret_cast<Mask>(v) & largest());
    }
    /// The vector with zeros replaced by 1 or -1: a divisor where some lanes are unused. A zero in an unused lane would
    /// raise the floating-point flag of a division by zero or of an invalid operation.
    static Vector withoutZeros(Vector v)
    {
        const Mask isZero = v == Vector{};
        return reinterpret_cast<Vector>(reinterpret_cast<Mask>(v) |
                                        (isZero & reinterpret_cast<Mask>(fill(S(1)))));
    }
    static Mask loadIds(const std::int32_t* p)
    {
        Mask ids = {};
        for (int lane = 0; lane < kWidth; ++lane)
            ids[lane] = p[lane];
        return ids;
    }
    /// 0, 1, 2, ...
    static Mask counting()
    {
        Mask lanes;
        for (int lane = 0; lane < kWidth; ++lane)
            lanes[lane] = lane;
        return lanes;
    }
};

/// Three coordinates and a fourth lane, or one coordinate of four points. Without AVX the compiler uses two registers
/// for doubles. Such vectors are never arguments or results by value, since the calling convention for them depends on
/// the compiler's options.
template <class S>
struct Quad
{
    using Vector = typename VectorOf<S, 4>::Type;
    using Mask = MaskOf<Vector>;

    /// @pre p is a multiple of the size
    static void load(const S* p, Vector& v)
    {
        std::memcpy(&v, __builtin_assume_aligned(p, sizeof(v)), sizeof(v));
    }

    static void makePositive(Vector& v)
    {
        constexpr typename Lanes<S>::Integer kMagnitude =
            std::numeric_limits<typename Lanes<S>::Integer>::max();
        v = reinterpret_cast<Vector>(reinterpret_cast<Mask>(v) & (Mask{} + kMagnitude));
    }

    /// See Lanes::withoutZeros().
    static void replaceZeros(Vector& v)
    {
        const Mask isZero = v == Vector{};
        v = reinterpret_cast<Vector>(reinterpret_cast<Mask>(v) |
                                     (isZero & reinterpret_cast<Mask>(Vector{} + S(1))));
    }

    static void clearLast(Vector& v)
    {
        constexpr Mask kFirstThree = {-1, -1, -1, 0};
        v = reinterpret_cast<Vector>(reinterpret_cast<Mask>(v) & kFirstThree);
    }

    /// One lane in all lanes of a narrow vector.
    template <int kLane>
    static typename Lanes<S>::Vector spread(const Vector& v)
    {
        if constexpr (Lanes<S>::kWidth == 4)
            return CULLET_SHUFFLE(v, v, kLane, kLane, kLane, kLane);
        else
            return Lanes<S>::fill(v[kLane]);
    }

    static S sumOfThree(const Vector& v) { return v[0] + v[1] + v[2]; }

    static void replace(Vector& v, int lane, S value)
    {
        constexpr Mask kCounting = {0, 1, 2, 3};
        const Mask isThis = kCounting == Mask{} + static_cast<typename Lanes<S>::Integer>(lane);
        v = isThis ? Vector{} + value : v;
    }

    static int indexOfLargest(const Vector& v)
    {
        const int low = v[1] > v[0] ? 1 : 0;
        const int high = v[3] > v[2] ? 3 : 2;
        return v[high] > v[low] ? high : low;
    }
};

/// The power of two that scales a number to between a half and 1, with less latency than a division; 0 if the number is
/// not finite or near the ends of its range.
template <class S>
inline S scaleBelowOne(S positive)
{
    using Bits = std::make_unsigned_t<typename Lanes<S>::Integer>;
    constexpr int kFractionBits = std::numeric_limits<S>::digits - 1;
    constexpr Bits kBias = std::numeric_limits<S>::max_exponent - 1;
    Bits bits;
    std::memcpy(&bits, &positive, sizeof(bits));
    const Bits exponent = bits >> kFractionBits;
    if (exponent == 0 || exponent >= 2 * kBias - 1)
        return S(0);
    bits = (2 * kBias - 1 - exponent) << kFractionBits;
    S scale;
    std::memcpy(&scale, &bits, sizeof(scale));
    return scale;
}

/// Two numbers, widened to double, in the lanes of a vector.
inline Lanes<double>::Vector widePair(float a, float b)
{
#ifdef __SSE2__
    return reinterpret_cast<Lanes<double>::Vector>(
        _mm_cvtps_pd(_mm_unpacklo_ps(_mm_set_ss(a), _mm_set_ss(b))));
#else
    return Lanes<double>::Vector{a, b};
#endif
}

inline Lanes<double>::Vector widePair(double a, double b)
{
    return Lanes<double>::Vector{a, b};
}

/// The first two lanes, widened to double.
inline Lanes<double>::Vector wideFirst(const Lanes<float>::Vector& v)
{
#ifdef __SSE2__
    return reinterpret_cast<Lanes<double>::Vector>(_mm_cvtps_pd(reinterpret_cast<__m128>(v)));
#elif defined(__aarch64__)
    return reinterpret_cast<Lanes<double>::Vector>(
        vcvt_f64_f32(vget_low_f32(reinterpret_cast<float32x4_t>(v))));
#else
    return Lanes<double>::Vector{v[0], v[1]};
#endif
}

/// The last two lanes, widened to double.
inline Lanes<double>::Vector wideLast(const Lanes<float>::Vector& v)
{
    return wideFirst(CULLET_SHUFFLE(v, v, 2, 3, 2, 3));
}

/// One lane of each of two quads, widened to double, in the lanes of a vector.
template <int kLane>
Lanes<double>::Vector widePairOf(const Quad<float>::Vector& a, const Quad<float>::Vector& b)
{
#if defined(__SSE2__) || defined(__aarch64__)
    // Without the shuffle the compiler would extract each lane by itself.
    const auto low = CULLET_SHUFFLE(a, b, kLane, kLane + 4, kLane, kLane + 4);
    return wideFirst(low);
#else
    return Lanes<double>::Vector{a[kLane], b[kLane]};
#endif
}

template <int kLane>
Lanes<double>::Vector widePairOf(const Quad<double>::Vector& a, const Quad<double>::Vector& b)
{
    return Lanes<double>::Vector{a[kLane], b[kLane]};
}

/// Bit i: lane i of four is set.
template <class S>
unsigned quadBits(const typename Quad<S>::Mask& m)
{
    if constexpr (Lanes<S>::kWidth == 4)
        return laneBits(m);
    else
        return static_cast<unsigned>((m[0] & 1) | (m[1] & 2) | (m[2] & 4) | (m[3] & 8));
}

/// The vector with lane 0 replaced by a copy of lane 1.
inline Lanes<float>::Vector withoutLaneZero(Lanes<float>::Vector v)
{
    return CULLET_SHUFFLE(v, v, 1, 1, 2, 3);
}

inline Lanes<double>::Vector withoutLaneZero(Lanes<double>::Vector v)
{
    return CULLET_SHUFFLE(v, v, 1, 1);
}

/// Largest of the lanes; a NaN lane may or may not be ignored.
inline float largestLane(Lanes<float>::Vector v)
{
    const Lanes<float>::Vector halves = CULLET_SHUFFLE(v, v, 2, 3, 0, 1);
    v = v > halves ? v : halves;
    const Lanes<float>::Vector pairs = CULLET_SHUFFLE(v, v, 1, 0, 3, 2);
    v = v > pairs ? v : pairs;
    return v[0];
}

inline double largestLane(Lanes<double>::Vector v)
{
    return v[0] > v[1] ? v[0] : v[1];
}

inline Lanes<float>::Integer smallestLane(Lanes<float>::Mask v)
{
    const Lanes<float>::Mask halves = CULLET_SHUFFLE(v, v, 2, 3, 0, 1);
    v = v < halves ? v : halves;
    return v[0] < v[1] ? v[0] : v[1];
}

inline Lanes<double>::Integer smallestLane(Lanes<double>::Mask v)
{
    return v[0] < v[1] ? v[0] : v[1];
}
}  // namespace cullet
