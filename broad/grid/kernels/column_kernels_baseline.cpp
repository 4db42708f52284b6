// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/grid/kernels/column_kernels.inl"
#include "cullet/broad/grid/kernels/motion_kernels.inl"
#include "cullet/broad/grid/kernels/skin_kernels.inl"

namespace cullet
{
const ColumnKernels kColumnKernelsBaseline = {
    "baseline",           scanSelf,        scanCross, scanOne, buildColumn, locateBoxes, compareBoxes,
    findBoxesOutsideSkin, findChangedPairs};

const ColumnKernels& chooseColumnKernels(bool baseline)
{
#if defined(__x86_64__)
    if (!baseline && __builtin_cpu_supports("avx512f") != 0)
        return kColumnKernelsAvx512;
    if (!baseline && __builtin_cpu_supports("avx2") != 0)
        return kColumnKernelsAvx2;
#else
    (void)baseline;
#endif
    return kColumnKernelsBaseline;
}
}  // namespace cullet
