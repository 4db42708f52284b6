// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/exec/executor.h"
#include "cullet/cuda/runtime/cuda_error.h"

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

namespace cullet
{
// deallocate() does not check for errors: it also runs after failures and at exit, when the driver may have been
// unloaded.
struct DeviceMemory
{
    static constexpr std::size_t kAlignment = 256;

    static void* allocateBytes(std::uint64_t bytes)
    {
        void* memory = nullptr;
        CULLET_CUDA_TRY(cudaMalloc(&memory, bytes));
        return memory;
    }
    static void deallocate(void* memory) noexcept
    {
        cudaFree(memory);
        cudaGetLastError();
    }
};

/// Memory of the CPU that copies to and from the device at full speed.
struct PinnedMemory
{
    static constexpr std::size_t kAlignment = 256;

    static void* allocateBytes(std::uint64_t bytes)
    {
        void* memory = nullptr;
        CULLET_CUDA_TRY(cudaMallocHost(&memory, bytes));
        return memory;
    }
    static void deallocate(void* memory) noexcept
    {
        cudaFreeHost(memory);
        cudaGetLastError();
    }
};

template <class T>
using DeviceBuffer = psap::ExecutorBuffer<T, DeviceMemory>;
template <class T>
using PinnedBuffer = psap::ExecutorBuffer<T, PinnedMemory>;
}  // namespace cullet
