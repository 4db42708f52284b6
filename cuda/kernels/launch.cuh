// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/cuda/runtime/cuda_error.h"

#include <cuda_runtime_api.h>

#include <cstdint>

/// Functions that launch kernels on a stream.
namespace cullet::psap
{
/// Number of blocks for a thread per index.
inline unsigned blocksFor(std::uint64_t indices, unsigned threads)
{
    return static_cast<unsigned>((indices + threads - 1) / threads);
}

/// Launches a thread per index; launches nothing for no index.
template <class... Parameters, class... Arguments>
void launch(cudaStream_t stream, void (*kernel)(Parameters...), std::uint64_t indices, unsigned threads,
            const Arguments&... arguments)
{
    if (indices == 0)
        return;
    kernel<<<blocksFor(indices, threads), threads, 0, stream>>>(arguments...);
    CULLET_CUDA_TRY(cudaGetLastError());
}

/// Launches blocks with dynamic shared memory.
///
/// @param bytes shared memory of a block
template <class... Parameters, class... Arguments>
void launchShared(cudaStream_t stream, void (*kernel)(Parameters...), std::uint64_t blocks, unsigned threads,
                  std::uint32_t bytes, const Arguments&... arguments)
{
    CULLET_CUDA_TRY(
        cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, static_cast<int>(bytes)));
    kernel<<<static_cast<unsigned>(blocks), threads, bytes, stream>>>(arguments...);
    CULLET_CUDA_TRY(cudaGetLastError());
}

/// Whether device and driver support launchDependent(), also in a recorded graph.
inline bool canLaunchDependent(int device)
{
    int driver = 0;
    int major = 0;
    CULLET_CUDA_TRY(cudaDriverGetVersion(&driver));
    CULLET_CUDA_TRY(cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, device));
    return CUDART_VERSION >= 12030 && driver >= 12030 && major >= 9;
}

/// As launch(), for a kernel that calls syncGridDependency(). Its blocks start as soon as all blocks of the previous
/// launch have started or ended (programmatic dependent launch), instead of when that launch is complete.
///
/// @pre canLaunchDependent()
template <class... Parameters, class... Arguments>
void launchDependent(cudaStream_t stream, void (*kernel)(Parameters...), std::uint64_t indices,
                     unsigned threads, const Arguments&... arguments)
{
#if CUDART_VERSION >= 12030
    if (indices == 0)
        return;
    cudaLaunchAttribute early = {};
    early.id = cudaLaunchAttributeProgrammaticStreamSerialization;
    early.val.programmaticStreamSerializationAllowed = 1;
    cudaLaunchConfig_t config = {};
    config.gridDim = dim3(blocksFor(indices, threads));
    config.blockDim = dim3(threads);
    config.stream = stream;
    config.attrs = &early;
    config.numAttrs = 1;
    CULLET_CUDA_TRY(cudaLaunchKernelEx(&config, kernel, arguments...));
#else
    launch(stream, kernel, indices, threads, arguments...);
#endif
}

/// In a kernel: waits until all previous launches are complete and their results visible, as at the start of any
/// kernel not launched by launchDependent().
__device__ inline void syncGridDependency()
{
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
    asm volatile("griddepcontrol.wait;" ::: "memory");
#endif
}

/// In a kernel: lets the blocks of a following launchDependent() start, as far as this block is concerned.
__device__ inline void triggerDependentLaunch()
{
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
    asm volatile("griddepcontrol.launch_dependents;" ::: "memory");
#endif
}
}  // namespace cullet::psap
