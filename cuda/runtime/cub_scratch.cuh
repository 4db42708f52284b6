// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/exec/executor_failure.h"
#include "cullet/cuda/runtime/cuda_error.h"
#include "cullet/cuda/runtime/device_buffer.h"

#include <cub/version.cuh>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace cullet::psap
{
/// Type of the number of elements in a long scan: int before CUB 2.7, of CUDA 12.8.
using LongScan = std::conditional_t<(CUB_VERSION >= 200700), std::uint64_t, int>;

/// The temporary memory of CUB.
class CubScratch
{
public:
    /// Calls body(scratch, bytes, n).
    ///
    /// @tparam Long type of n where an int, which is faster, is too small
    /// @param exec  allocates the memory
    template <class Long, class Exec, class Body>
    void call(Exec& exec, std::uint64_t count, const Body& body)
    {
        if (count <= static_cast<std::uint64_t>(std::numeric_limits<int>::max()))
            callWith(exec, static_cast<int>(count), body);
        else if constexpr (sizeof(Long) > sizeof(int))
            callWith(exec, static_cast<Long>(count), body);
        else
            throw ExecutorFailure{Status::OutOfMemory, "CudaExec",
                                  "2^31 elements or more in one scan, which takes CUDA 12.8"};
    }

private:
    /// Calls CUB twice: to query the size of its temporary memory, and with that memory.
    template <class Exec, class Count, class Body>
    void callWith(Exec& exec, Count count, const Body& body)
    {
        std::size_t bytes = 0;
        CULLET_CUDA_TRY(body(nullptr, bytes, count));
        exec.reserve(m_memory, std::max<std::size_t>(bytes, 1));
        CULLET_CUDA_TRY(body(m_memory.data(), bytes, count));
    }

    DeviceBuffer<unsigned char> m_memory;
};
}  // namespace cullet::psap
