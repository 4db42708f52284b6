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

/// What the call says, or the fault that a test wants there; then it is not made. For calls that need not succeed.
#define CULLET_CUDA_ASK(call)                                      \
    [&]() -> cudaError_t                                           \
    {                                                              \
        const cudaError_t culletFault = ::cullet::takeCudaFault(); \
        return culletFault != cudaSuccess ? culletFault : (call);  \
    }()

/// The one way in which this library calls CUDA where a failure matters.
#define CULLET_CUDA_TRY(call) ::cullet::throwIfFailed(CULLET_CUDA_ASK(call), #call)
