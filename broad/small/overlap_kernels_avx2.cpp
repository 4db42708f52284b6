// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Compiled with -mavx2; called only where the processor has it.
#if defined(__x86_64__)
#include "cullet/broad/small/overlap_kernels.inl"

namespace cullet
{
const OverlapKernels kOverlapKernelsAvx2 = {"avx2", 384, findOverlaps};
}  // namespace cullet
#endif  // x86-64
