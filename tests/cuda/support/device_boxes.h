// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/cuda/device_pairs.h"
#include "cullet/cuda/runtime/device_buffer.h"

#include <cuda_runtime_api.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace cullet::test
{
/// cudaMemcpy() from pageable memory may return before the transfer is complete, and a finder's own stream does not
/// wait for it.
inline void upload(const DeviceBuffer<Aabb>& to, const std::vector<Aabb>& boxes)
{
    ASSERT_EQ(cudaMemcpy(to.data(), boxes.data(), boxes.size() * sizeof(Aabb), cudaMemcpyHostToDevice),
              cudaSuccess);
    ASSERT_EQ(cudaDeviceSynchronize(), cudaSuccess);
}

inline std::vector<RowPair> download(const DevicePairs& found)
{
    std::vector<RowPair> rows(found.count);
    EXPECT_EQ(cudaMemcpy(rows.data(), found.pairs, rows.size() * sizeof(RowPair), cudaMemcpyDeviceToHost),
              cudaSuccess);
    return rows;
}

inline std::vector<RowPair> findOnDevice(DevicePairFinder& finder, const DeviceBuffer<Aabb>& boxes,
                                         std::uint64_t count)
{
    DevicePairs found;
    EXPECT_EQ(finder.enqueue(boxes.data(), count), Status::Ok);
    EXPECT_EQ(finder.collect(found), Status::Ok);
    return download(found);
}
}  // namespace cullet::test
