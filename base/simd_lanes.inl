// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// `Lanes`: floats in the widest register of the instruction set that the including source is compiled for. To be
// included by kernels, inside namespace cullet, and after vector16.h and, for x86, <immintrin.h>.

namespace
{
#if defined(__AVX512F__)
struct Lanes
{
    using Value = __m512;
    using Mask = __mmask16;
    static constexpr std::uint32_t kWidth = 16;
    static constexpr std::uint32_t kFull = 0xffff;
    static Value load(const float* p) { return _mm512_loadu_ps(p); }
    static void store(float* p, Value v) { _mm512_storeu_ps(p, v); }
    static Value broadcast(float v) { return _mm512_set1_ps(v); }
    static Value subtract(Value a, Value b) { return _mm512_sub_ps(a, b); }
    // Masked, because GCC 12 warns of the undefined operand inside the plain intrinsic (GCC bug 105593).
    static Value larger(Value a, Value b) { return _mm512_mask_max_ps(a, kFull, a, b); }
    static Mask le(Value a, Value b) { return _mm512_cmp_ps_mask(a, b, _CMP_LE_OQ); }
    static Mask both(Mask a, Mask b) { return static_cast<Mask>(a & b); }
    static std::uint32_t bits(Mask m) { return m; }
};
#elif defined(__AVX2__)
struct Lanes
{
    using Value = __m256;
    using Mask = __m256;
    static constexpr std::uint32_t kWidth = 8;
    static constexpr std::uint32_t kFull = 0xff;
    static Value load(const float* p) { return _mm256_loadu_ps(p); }
    static void store(float* p, Value v) { _mm256_storeu_ps(p, v); }
    static Value broadcast(float v) { return _mm256_set1_ps(v); }
    static Value subtract(Value a, Value b) { return _mm256_sub_ps(a, b); }
    static Value larger(Value a, Value b) { return _mm256_max_ps(a, b); }
    static Mask le(Value a, Value b) { return _mm256_cmp_ps(a, b, _CMP_LE_OQ); }
    static Mask both(Mask a, Mask b) { return _mm256_and_ps(a, b); }
    static std::uint32_t bits(Mask m) { return static_cast<std::uint32_t>(_mm256_movemask_ps(m)); }
};
#else
/// The baseline of any processor.
struct Lanes
{
    using Value = FourFloats;
    using Mask = MaskOf<FourFloats>;
    static constexpr std::uint32_t kWidth = 4;
    static constexpr std::uint32_t kFull = 0xf;
    static Value load(const float* p) { return loadFour(p); }
    static void store(float* p, Value v) { __builtin_memcpy(p, &v, sizeof(v)); }
    static Value broadcast(float v) { return Value{v, v, v, v}; }
    static Value subtract(Value a, Value b) { return a - b; }
    static Value larger(Value a, Value b) { return largerOf(a, b); }
    static Mask le(Value a, Value b) { return a <= b; }
    static Mask both(Mask a, Mask b) { return a & b; }
    static std::uint32_t bits(Mask m) { return laneBits(m); }
};
#endif
}  // namespace
