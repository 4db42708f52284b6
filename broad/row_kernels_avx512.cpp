// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Compiled with -mavx512f; entered only where the processor has it.
#include "broad/cell_rule.h"
#include "broad/row_soa.h"

#include <algorithm>
#include <cstring>
#include <limits>

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
    static constexpr std::uint32_t kFull = 0xffff;
    static Value load(const float* p) { return _mm512_loadu_ps(p); }
    static Value broadcast(float v) { return _mm512_set1_ps(v); }
    static Value subtract(Value a, Value b) { return _mm512_sub_ps(a, b); }
    // Masked, because GCC 12 takes the undefined operand inside the plain one for a mistake (GCC bug 105593).
    static Value larger(Value a, Value b) { return _mm512_mask_max_ps(a, kFull, a, b); }
    static Mask le(Value a, Value b) { return _mm512_cmp_ps_mask(a, b, _CMP_LE_OQ); }
    static std::uint32_t bits(Mask m) { return m; }

    /// Without a branch: whether a vector has hits is hard to predict.
    static void append(std::uint32_t hits, Value gap, FlaggedId id, const FlaggedId* ids, PairBuffer& out)
    {
        const __m512i first = _mm512_set1_epi32(static_cast<int>(id));
        const __m512i second = _mm512_loadu_si512(ids);
        const Mask owned =
            _mm512_mask_cmpge_epu32_mask(static_cast<Mask>(hits), _mm512_or_si512(first, second),
                                         _mm512_set1_epi32(static_cast<int>(kOwnsPair)));
        _mm512_storeu_si512(out.first + out.count, first);
        _mm512_storeu_si512(out.second + out.count, _mm512_maskz_compress_epi32(owned, second));
        _mm512_storeu_ps(out.gap + out.count, _mm512_maskz_compress_ps(owned, gap));
        out.count += static_cast<std::uint32_t>(__builtin_popcount(owned));
    }
};
}  // namespace

#include "broad/row_kernels.inl"

const RowKernels kRowKernelsAvx512 = {"avx512", scanSelf, scanCross, scanOne, gatherRow, layOut};
}  // namespace cullet
#endif  // x86-64
