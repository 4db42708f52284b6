// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Compiled with -mavx512f; entered only where the processor has it.
#if defined(__x86_64__)
#include <LinearMath/btScalar.h>

#include <cstdint>

// A block fills no more.
#ifdef BT_USE_DOUBLE_PRECISION
#define CULLET_SOLVER_REGISTER 64
#else
#define CULLET_SOLVER_REGISTER 32
#endif
#include "cullet/plugin/solver/row_kernels.inl"

namespace cullet
{
inline namespace CULLET_PRECISION
{
const RowKernels& rowKernelsAvx512()
{
    return kKernels;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
#endif  // x86-64
