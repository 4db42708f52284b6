// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/kernels/column_kernels.inl"
#include "cullet/broad/grid/kernels/motion_kernels.inl"
#include "cullet/broad/grid/kernels/skin_kernels.inl"

namespace cullet
{
const ColumnKernels kRowKernelsBaseline = {"baseline",  scanSelf,     scanCross,   scanOne,    buildRow,
                                           locateBoxes, compareBoxes, findOutside, findStirred};

const ColumnKernels& chooseRowKernels(bool baseline)
{
#if defined(__x86_64__)
    if (!baseline && __builtin_cpu_supports("avx512f") != 0)
        return kRowKernelsAvx512;
    if (!baseline && __builtin_cpu_supports("avx2") != 0)
        return kRowKernelsAvx2;
#else
    (void)baseline;
#endif
    return kRowKernelsBaseline;
}
}  // namespace cullet
