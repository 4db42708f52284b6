// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#define CULLET_SOLVER_REGISTER 16
#include "cullet/plugin/solver/row_kernels.inl"

namespace cullet
{
inline namespace CULLET_PRECISION
{
const RowKernels& rowKernelsBaseline()
{
    return kKernels;
}

const RowKernels& rowKernels()
{
#if defined(__x86_64__)
    __builtin_cpu_init();
    static const RowKernels& kFastest =
        __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512vl") != 0 ? rowKernelsAvx512()
        : __builtin_cpu_supports("avx2") != 0                                             ? rowKernelsAvx2()
                                              : rowKernelsBaseline();
    return kFastest;
#else
    return rowKernelsBaseline();
#endif
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
