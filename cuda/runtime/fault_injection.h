// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>

namespace cullet
{
/// What a test makes CUDA answer.
enum class FaultInjection
{
    None,
    OutOfMemory,  ///< that one call says cudaErrorMemoryAllocation
    DeviceLost    ///< that call and all later ones say cudaErrorLaunchFailure
};

/// Lets the `call`-th CUDA call that matters from now on (0: the next) fail without being made. For tests; None ends it.
///
/// Counts the calls of all threads together.
void setCudaFault(FaultInjection fault, std::uint64_t call) noexcept;

/// Whether a call has failed because of the last fault that was not None.
bool hasCudaFaultHappened() noexcept;
}  // namespace cullet
