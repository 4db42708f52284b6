// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Lists whose length exceeds an int.

#include "cullet/tests/cuda/support/long_lists.h"

#include <cuda_runtime_api.h>
#include <gtest/gtest.h>

#include <cstddef>

namespace cullet::test
{
namespace
{
TEST(CudaLongLists, AreScannedAndSortedBeyondTwoBillionEntries)
{
    constexpr std::uint64_t kLong = (1ull << 31) + 1000;
    for (const std::uint64_t count : {std::uint64_t{1000}, kLong})
    {
        std::size_t available = 0;
        std::size_t total = 0;
        ASSERT_EQ(cudaMemGetInfo(&available, &total), cudaSuccess);
        if (available < bytesForSort(count))
            GTEST_SKIP() << "needs " << (bytesForSort(count) >> 30) << " GiB of device memory";
        EXPECT_EQ(wrongAfterScan(count), 0u) << count;
        EXPECT_EQ(wrongAfterSort(count), 0u) << count;
    }
}
}  // namespace
}  // namespace cullet::test
