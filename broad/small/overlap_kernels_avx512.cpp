// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Compiled with -mavx512f; called only where the processor has it.
#if defined(__x86_64__)
#include "cullet/broad/small/overlap_kernels.inl"

namespace cullet
{
const OverlapKernels kOverlapKernelsAvx512 = {"avx512", 512, findOverlaps};
}  // namespace cullet
#endif  // x86-64
