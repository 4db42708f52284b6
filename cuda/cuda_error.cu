// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "broad/psap_failure.h"
#include "cuda/cuda_error.h"
#include "cuda/cuda_fault.h"

#include <atomic>

namespace cullet
{
namespace
{
std::atomic<CudaFault> plannedFault{CudaFault::None};
std::atomic<std::uint64_t> plannedCall{0};
std::atomic<std::uint64_t> callCount{0};
}  // namespace

void setCudaFault(CudaFault fault, std::uint64_t call) noexcept
{
    plannedFault = fault;
    plannedCall = call;
    callCount = 0;
}

std::uint64_t cudaCallCount() noexcept
{
    return callCount;
}

cudaError_t takeCudaFault() noexcept
{
    const std::uint64_t call = callCount.fetch_add(1, std::memory_order_relaxed);
    switch (plannedFault.load(std::memory_order_relaxed))
    {
        case CudaFault::OutOfMemory:
            return call == plannedCall ? cudaErrorMemoryAllocation : cudaSuccess;
        case CudaFault::DeviceLost:
            return call >= plannedCall ? cudaErrorLaunchFailure : cudaSuccess;
        default:
            return cudaSuccess;
    }
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
