// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Eight floats and the few operations on them that the query kernels need, in the widest registers that the including
// translation unit is compiled for. Comparisons are false for NaN. Internal linkage, as query_kernels.inl requires.
#include <cstdint>

#if defined(__SSE2__)
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
#elif defined(__SSE2__)
struct Float8
{
    __m128 v, w;
};
inline Float8 load(const float* p)
{
    return {_mm_loadu_ps(p), _mm_loadu_ps(p + 4)};
}
inline void store(float* p, Float8 x)
{
    _mm_storeu_ps(p, x.v);
    _mm_storeu_ps(p + 4, x.w);
}
inline Float8 broadcast(float x)
{
    return {_mm_set1_ps(x), _mm_set1_ps(x)};
}
inline Float8 operator-(Float8 a, Float8 b)
{
    return {_mm_sub_ps(a.v, b.v), _mm_sub_ps(a.w, b.w)};
}
inline Float8 operator*(Float8 a, Float8 b)
{
    return {_mm_mul_ps(a.v, b.v), _mm_mul_ps(a.w, b.w)};
}
inline Float8 smaller(Float8 a, Float8 b)
{
    return {_mm_min_ps(a.v, b.v), _mm_min_ps(a.w, b.w)};
}
inline Float8 larger(Float8 a, Float8 b)
{
    return {_mm_max_ps(a.v, b.v), _mm_max_ps(a.w, b.w)};
}
inline Float8 operator&(Float8 a, Float8 b)
{
    return {_mm_and_ps(a.v, b.v), _mm_and_ps(a.w, b.w)};
}
inline Float8 operator<=(Float8 a, Float8 b)
{
    return {_mm_cmple_ps(a.v, b.v), _mm_cmple_ps(a.w, b.w)};
}
inline std::uint32_t bits(Float8 mask)
{
    return static_cast<std::uint32_t>(_mm_movemask_ps(mask.v) | _mm_movemask_ps(mask.w) << 4);
}
#else
struct Float8
{
    float v[8];
};
template <class Operation>
inline Float8 perLane(Operation operation)
{
    Float8 result;
    for (int i = 0; i < 8; ++i)
        result.v[i] = operation(i);
    return result;
}
inline Float8 load(const float* p)
{
    return perLane([=](int i) { return p[i]; });
}
inline Float8 broadcast(float x)
{
    return perLane([=](int) { return x; });
}
inline void store(float* p, const Float8& x)
{
    for (int i = 0; i < 8; ++i)
        p[i] = x.v[i];
}
inline Float8 operator-(const Float8& a, const Float8& b)
{
    return perLane([&](int i) { return a.v[i] - b.v[i]; });
}
inline Float8 operator*(const Float8& a, const Float8& b)
{
    return perLane([&](int i) { return a.v[i] * b.v[i]; });
}
inline Float8 smaller(const Float8& a, const Float8& b)
{
    return perLane([&](int i) { return a.v[i] < b.v[i] ? a.v[i] : b.v[i]; });
}
inline Float8 larger(const Float8& a, const Float8& b)
{
    return perLane([&](int i) { return a.v[i] > b.v[i] ? a.v[i] : b.v[i]; });
}
inline Float8 operator&(const Float8& a, const Float8& b)
{
    return perLane([&](int i) { return a.v[i] != 0.0f && b.v[i] != 0.0f ? 1.0f : 0.0f; });
}
inline Float8 operator<=(const Float8& a, const Float8& b)
{
    return perLane([&](int i) { return a.v[i] <= b.v[i] ? 1.0f : 0.0f; });
}
inline std::uint32_t bits(const Float8& mask)
{
    std::uint32_t result = 0;
    for (int i = 0; i < 8; ++i)
        result |= (mask.v[i] != 0.0f ? 1u : 0u) << i;
    return result;
}
#endif
}  // namespace
}  // namespace cullet
