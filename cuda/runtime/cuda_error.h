// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cuda_runtime_api.h>

namespace cullet
{
/// The fault that a test has planned for this call, or cudaSuccess. Counts the call.
cudaError_t nextCudaFault() noexcept;

/// Throws psap::ExecutorFailure unless `error` is cudaSuccess. Clears the runtime's remembered error, so that a later,
/// unrelated check does not find it.
void throwIfFailed(cudaError_t error, const char* call);
}  // namespace cullet

/// Result of the call, or the fault that a test has planned for it; the call is then not made. For calls that may
/// fail.
#define CULLET_CUDA_RESULT(call)                                   \
    [&]() -> cudaError_t                                           \
    {                                                              \
        const cudaError_t culletFault = ::cullet::nextCudaFault(); \
        return culletFault != cudaSuccess ? culletFault : (call);  \
    }()

/// Makes a CUDA call that must succeed. All such calls of the library use it.
#define CULLET_CUDA_TRY(call) ::cullet::throwIfFailed(CULLET_CUDA_RESULT(call), #call)
