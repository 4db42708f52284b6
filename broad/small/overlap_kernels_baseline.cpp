// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/small/overlap_kernels.inl"

namespace cullet
{
const OverlapKernels kFlatKernelsBaseline = {"baseline", 128, findOverlaps};

const OverlapKernels& chooseFlatKernels(bool baseline)
{
#if defined(__x86_64__)
    if (!baseline && __builtin_cpu_supports("avx512f") != 0)
        return kFlatKernelsAvx512;
    if (!baseline && __builtin_cpu_supports("avx2") != 0)
        return kFlatKernelsAvx2;
#else
    (void)baseline;
#endif
    return kFlatKernelsBaseline;
}
}  // namespace cullet
