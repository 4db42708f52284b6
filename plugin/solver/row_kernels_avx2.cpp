// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// Compiled with -mavx2; entered only where the processor has it.
#if defined(__x86_64__)
#define CULLET_SOLVER_REGISTER 32
#include "cullet/plugin/solver/row_kernels.inl"

namespace cullet
{
inline namespace CULLET_PRECISION
{
const RowKernels& rowKernelsAvx2()
{
    return kKernels;
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
#endif  // x86-64
