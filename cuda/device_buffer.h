// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cuda/cuda_error.h"

#include <cuda_runtime_api.h>

#include <cstdint>
#include <utility>

namespace cullet
{
/// Owns memory that CUDA gave; knows its size in elements. Movable.
///
/// Freeing is not checked: it happens after failures too, and at exit, when the driver may be gone already.
template <class T, class Memory>
class CudaMemory
{
public:
    CudaMemory() = default;
    CudaMemory(const CudaMemory&) = delete;
    CudaMemory& operator=(const CudaMemory&) = delete;
    CudaMemory(CudaMemory&& other) noexcept
        : m_data(std::exchange(other.m_data, nullptr)),
          m_size(std::exchange(other.m_size, 0)),
          m_account(std::exchange(other.m_account, nullptr))
    {
    }
    CudaMemory& operator=(CudaMemory&& other) noexcept
    {
        std::swap(m_data, other.m_data);
        std::swap(m_size, other.m_size);
        std::swap(m_account, other.m_account);
        return *this;
    }
    ~CudaMemory() { release(); }

    T* data() const { return m_data; }
    std::uint64_t size() const { return m_size; }

    /// Throws psap::ExecutorFailure; the buffer is then empty.
    ///
    /// @param account counts the bytes for as long as they are held; null: nobody does
    void allocate(std::uint64_t size, std::uint64_t* account = nullptr)
    {
        release();
        m_data = static_cast<T*>(Memory::take(size * sizeof(T)));
        m_size = size;
        m_account = account;
        if (m_account != nullptr)
            *m_account += m_size * sizeof(T);
    }

    void release() noexcept
    {
        if (m_data != nullptr)
            Memory::giveBack(m_data);
        if (m_account != nullptr)
            *m_account -= m_size * sizeof(T);
        m_data = nullptr;
        m_size = 0;
        m_account = nullptr;
    }

private:
    T* m_data = nullptr;
    std::uint64_t m_size = 0;
    std::uint64_t* m_account = nullptr;
};

struct DeviceMemory
{
    static void* take(std::uint64_t bytes)
    {
        void* memory = nullptr;
        CULLET_CUDA_TRY(cudaMalloc(&memory, bytes));
        return memory;
    }
    static void giveBack(void* memory) noexcept
    {
        cudaFree(memory);
        cudaGetLastError();
    }
};

/// Memory of the CPU that copies to and from the device at full speed.
struct PinnedMemory
{
    static void* take(std::uint64_t bytes)
    {
        void* memory = nullptr;
        CULLET_CUDA_TRY(cudaMallocHost(&memory, bytes));
        return memory;
    }
    static void giveBack(void* memory) noexcept
    {
        cudaFreeHost(memory);
        cudaGetLastError();
    }
};

template <class T>
using DeviceBuffer = CudaMemory<T, DeviceMemory>;
template <class T>
using PinnedBuffer = CudaMemory<T, PinnedMemory>;
}  // namespace cullet
