// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#define CULLET_MESH_KERNELS kMeshKernelsBaseline
#include "cullet/mid/mesh_kernels.inl"

namespace cullet
{
const MeshKernels& meshKernels(bool baselineSimd) noexcept
{
#if defined(__x86_64__)
    if (!baselineSimd && __builtin_cpu_supports("avx2"))
        return kMeshKernelsAvx2;
#endif
    static_cast<void>(baselineSimd);
    return kMeshKernelsBaseline;
}
}  // namespace cullet
