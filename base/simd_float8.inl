// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Eight floats and the few operations on them that the query kernels need, in the widest registers that the including
// translation unit is compiled for. Comparisons are false for NaN. Internal linkage, as query_kernels.inl requires.
#include "cullet/base/vector16.h"

#include <cstdint>

#if defined(__AVX__)
#include <immintrin.h>
#endif

namespace cullet
{
namespace
{
#if defined(__AVX__)
struct Float8
{
    __m256 v;
};
inline Float8 load(const float* p)
{
    return {_mm256_loadu_ps(p)};
}
inline void store(float* p, Float8 x)
{
    _mm256_storeu_ps(p, x.v);
}
inline Float8 broadcast(float x)
{
    return {_mm256_set1_ps(x)};
}
inline Float8 operator-(Float8 a, Float8 b)
{
    return {_mm256_sub_ps(a.v, b.v)};
}
inline Float8 operator*(Float8 a, Float8 b)
{
    return {_mm256_mul_ps(a.v, b.v)};
}
inline Float8 smaller(Float8 a, Float8 b)
{
    return {_mm256_min_ps(a.v, b.v)};
}
inline Float8 larger(Float8 a, Float8 b)
{
    return {_mm256_max_ps(a.v, b.v)};
}
inline Float8 operator&(Float8 a, Float8 b)
{
    return {_mm256_and_ps(a.v, b.v)};
}
inline Float8 operator<=(Float8 a, Float8 b)
{
    return {_mm256_cmp_ps(a.v, b.v, _CMP_LE_OQ)};
}
inline std::uint32_t bits(Float8 mask)
{
    return static_cast<std::uint32_t>(_mm256_movemask_ps(mask.v));
}
#else
/// Two registers of the baseline of any processor.
struct Float8
{
    FourFloats v, w;
};
inline Float8 load(const float* p)
{
    return {loadFour(p), loadFour(p + 4)};
}
inline void store(float* p, Float8 x)
{
    __builtin_memcpy(p, &x, sizeof(x));
}
inline Float8 broadcast(float x)
{
    const FourFloats four = {x, x, x, x};
    return {four, four};
}
inline Float8 operator-(Float8 a, Float8 b)
{
    return {a.v - b.v, a.w - b.w};
}
inline Float8 operator*(Float8 a, Float8 b)
{
    return {a.v * b.v, a.w * b.w};
}
inline Float8 smaller(Float8 a, Float8 b)
{
    return {smallerOf(a.v, b.v), smallerOf(a.w, b.w)};
}
inline Float8 larger(Float8 a, Float8 b)
{
    return {largerOf(a.v, b.v), largerOf(a.w, b.w)};
}
using FourBits = MaskOf<FourFloats>;
inline Float8 operator&(Float8 a, Float8 b)
{
    return {reinterpret_cast<FourFloats>(reinterpret_cast<FourBits>(a.v) & reinterpret_cast<FourBits>(b.v)),
            reinterpret_cast<FourFloats>(reinterpret_cast<FourBits>(a.w) & reinterpret_cast<FourBits>(b.w))};
}
inline Float8 operator<=(Float8 a, Float8 b)
{
    return {reinterpret_cast<FourFloats>(a.v <= b.v), reinterpret_cast<FourFloats>(a.w <= b.w)};
}
inline std::uint32_t bits(Float8 mask)
{
    return laneBits(reinterpret_cast<FourBits>(mask.v)) | laneBits(reinterpret_cast<FourBits>(mask.w)) << 4;
}
#endif
}  // namespace
}  // namespace cullet
