// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cuda_runtime_api.h>

namespace cullet
{
/// The fault that a test wants at this call, or cudaSuccess. Counts the call.
cudaError_t takeCudaFault() noexcept;

/// Throws psap::ExecutorFailure unless `error` is cudaSuccess. Clears the runtime's remembered error, so that a later,
/// unrelated check does not find it.
void throwIfFailed(cudaError_t error, const char* call);
}  // namespace cullet

/// The one way in which this library calls CUDA where a failure matters.
#define CULLET_CUDA_TRY(call)                                                              \
    do                                                                                     \
    {                                                                                      \
        const cudaError_t culletFault = ::cullet::takeCudaFault();                         \
        ::cullet::throwIfFailed(culletFault != cudaSuccess ? culletFault : (call), #call); \
    } while (false)
