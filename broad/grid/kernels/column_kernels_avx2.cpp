// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Compiled with -mavx2; entered only where the processor has it.
#if defined(__x86_64__)
#include "cullet/broad/grid/kernels/column_kernels.inl"
#include "cullet/broad/grid/kernels/motion_kernels.inl"
#include "cullet/broad/grid/kernels/skin_kernels.inl"

namespace cullet
{
const ColumnKernels kColumnKernelsAvx2 = {"avx2",          scanSelf,    scanCross,    scanOne,
                                          buildColumn,     locateBoxes, compareBoxes, findBoxesOutsideSkin,
                                          findChangedPairs};
}  // namespace cullet
#endif  // x86-64
