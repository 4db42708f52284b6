// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/psap/exec/executor_failure.h"
#include "cullet/cuda/runtime/cuda_error.h"
#include "cullet/cuda/runtime/fault_injection.h"

#include <atomic>

namespace cullet
{
namespace
{
std::atomic<FaultInjection> plannedFault{FaultInjection::None};
std::atomic<std::uint64_t> plannedCall{0};
std::atomic<std::uint64_t> callCount{0};
std::atomic<bool> hasHappened{false};

/// Result of that call under the planned fault.
cudaError_t faultOf(std::uint64_t call)
{
    switch (plannedFault.load(std::memory_order_relaxed))
    {
        case FaultInjection::OutOfMemory:
            return call == plannedCall ? cudaErrorMemoryAllocation : cudaSuccess;
        case FaultInjection::DeviceLost:
            return call >= plannedCall ? cudaErrorLaunchFailure : cudaSuccess;
        default:
            return cudaSuccess;
    }
}
}  // namespace

void setCudaFault(FaultInjection fault, std::uint64_t call) noexcept
{
    if (fault != FaultInjection::None)
        hasHappened = false;
    plannedFault = fault;
    plannedCall = call;
    callCount = 0;
}

bool hasCudaFaultHappened() noexcept
{
    return hasHappened;
}

cudaError_t nextCudaFault() noexcept
{
    const cudaError_t fault = faultOf(callCount.fetch_add(1, std::memory_order_relaxed));
    if (fault != cudaSuccess)
        hasHappened = true;
    return fault;
}

void throwIfFailed(cudaError_t error, const char* call)
{
    if (error == cudaSuccess)
        return;
    cudaGetLastError();
    const bool isMemory = error == cudaErrorMemoryAllocation;
    throw psap::ExecutorFailure{isMemory ? Status::OutOfMemory : Status::DeviceLost, call,
                                cudaGetErrorString(error)};
}
}  // namespace cullet
