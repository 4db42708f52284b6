// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/grid/columns/column_soa.h"

#include <vector>

namespace cullet::test
{
/// The kernels of every instruction set that this processor supports.
inline std::vector<const ColumnKernels*> kernelsHere()
{
    std::vector<const ColumnKernels*> kernels = {&kColumnKernelsBaseline};
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2") != 0)
        kernels.push_back(&kColumnKernelsAvx2);
    if (__builtin_cpu_supports("avx512f") != 0)
        kernels.push_back(&kColumnKernelsAvx512);
#endif
    return kernels;
}
}  // namespace cullet::test
