// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Compiled with -mavx2; entered only where the processor has it.
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
    using Value = __m256;
    using Mask = __m256;
    static constexpr std::uint32_t kWidth = 8;
    static constexpr std::uint32_t kFull = 0xff;
    static Value load(const float* p) { return _mm256_loadu_ps(p); }
    static Value broadcast(float v) { return _mm256_set1_ps(v); }
    static Value subtract(Value a, Value b) { return _mm256_sub_ps(a, b); }
    static Value larger(Value a, Value b) { return _mm256_max_ps(a, b); }
    static Mask le(Value a, Value b) { return _mm256_cmp_ps(a, b, _CMP_LE_OQ); }
    static std::uint32_t bits(Mask m) { return static_cast<std::uint32_t>(_mm256_movemask_ps(m)); }

    static void append(std::uint32_t hits, Value gap, FlaggedId id, const FlaggedId* ids, PairBuffer& out)
    {
        if (hits == 0)
            return;
        float gaps[kWidth];
        _mm256_storeu_ps(gaps, gap);
        do
        {
            const auto lane = static_cast<std::uint32_t>(__builtin_ctz(hits));
            hits &= hits - 1;
            out.first[out.count] = id;
            out.second[out.count] = ids[lane];
            out.gap[out.count] = gaps[lane];
            // Unconditional store, conditional advance: duplicates over cells are about a quarter of all hits, which a
            // branch would mispredict.
            out.count += (id | ids[lane]) >= kOwnsPair ? 1u : 0u;
        } while (hits != 0);
    }
};
}  // namespace

#include "broad/row_kernels.inl"

const RowKernels kRowKernelsAvx2 = {"avx2", scanSelf, scanCross, scanOne, gatherRow, layOut};
}  // namespace cullet
#endif  // x86-64
