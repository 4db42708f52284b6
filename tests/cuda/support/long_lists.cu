// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/cuda/kernels/cuda_exec.cuh"
#include "cullet/tests/cuda/support/long_lists.h"

namespace cullet::test
{
namespace
{
struct StoreOne
{
    std::uint32_t* to;
    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const { to[i] = 1; }
};

/// Keys in descending order.
struct StoreKey
{
    std::uint64_t* to;
    std::uint64_t count;
    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const { to[i] = count - 1 - i; }
};

/// Each element must equal its index.
template <class T>
struct CountWrong
{
    const T* numbers;
    std::uint64_t* wrong;
    CULLET_HOST_DEVICE void operator()(std::uint64_t i) const
    {
        if (numbers[i] != static_cast<T>(i))
            fetchAdd(wrong, std::uint64_t{1});
    }
};

template <class T>
std::uint64_t countWrong(psap::CudaExec& exec, const DeviceBuffer<T>& numbers, std::uint64_t count)
{
    DeviceBuffer<std::uint64_t> wrong;
    exec.reserve(wrong, 1);
    exec.clear(wrong.data(), 1);
    exec.forEach(count, CountWrong<T>{numbers.data(), wrong.data()});
    std::uint64_t result = 0;
    exec.download(&result, wrong.data(), 1);
    exec.wait();
    return result;
}
}  // namespace

std::uint64_t wrongAfterScan(std::uint64_t count)
{
    psap::CudaExec exec{PsapOptions{}};
    DeviceBuffer<std::uint32_t> ones, sums;
    exec.reserve(ones, count);
    exec.reserve(sums, count);
    exec.forEach(count, StoreOne{ones.data()});
    exec.exclusiveSum(ones.data(), sums.data(), count);
    return countWrong(exec, sums, count);
}

std::uint64_t wrongAfterSort(std::uint64_t count)
{
    psap::CudaExec exec{PsapOptions{}};
    DeviceBuffer<std::uint64_t> keys, sorted;
    exec.reserve(keys, count);
    exec.reserve(sorted, count);
    exec.forEach(count, StoreKey{keys.data(), count});
    exec.sortKeys(keys.data(), sorted.data(), count, 40);
    return countWrong(exec, sorted, count);
}
}  // namespace cullet::test
