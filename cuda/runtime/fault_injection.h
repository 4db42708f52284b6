// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>

namespace cullet
{
/// The fault that a test injects into CUDA calls.
enum class FaultInjection
{
    None,
    OutOfMemory,  ///< one call returns cudaErrorMemoryAllocation
    DeviceLost    ///< one call and all later ones return cudaErrorLaunchFailure
};

/// Makes the `call`-th checked CUDA call from now on (0: the next) fail without being made. For tests; None ends it.
///
/// Counts the calls of all threads together.
void setCudaFault(FaultInjection fault, std::uint64_t call) noexcept;

/// Whether a call has failed because of the last fault that was not None.
bool hasCudaFaultHappened() noexcept;
}  // namespace cullet
