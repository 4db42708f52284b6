// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#define CULLET_QUERY_KERNELS kQueryKernelsBaseline
#include "cullet/broad/queries/query_kernels.inl"

namespace cullet
{
const QueryKernels& queryKernels(bool baselineSimd) noexcept
{
#if defined(__x86_64__)
    if (!baselineSimd && __builtin_cpu_supports("avx2"))
        return kQueryKernelsAvx2;
#endif
    static_cast<void>(baselineSimd);
    return kQueryKernelsBaseline;
}
}  // namespace cullet
