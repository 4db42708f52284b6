// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/small/overlap_kernels.inl"

namespace cullet
{
const OverlapKernels kOverlapKernelsBaseline = {"baseline", 128, findOverlaps};

const OverlapKernels& chooseOverlapKernels(bool baseline)
{
#if defined(__x86_64__)
    if (!baseline && __builtin_cpu_supports("avx512f") != 0)
        return kOverlapKernelsAvx512;
    if (!baseline && __builtin_cpu_supports("avx2") != 0)
        return kOverlapKernelsAvx2;
#else
    (void)baseline;
#endif
    return kOverlapKernelsBaseline;
}
}  // namespace cullet
