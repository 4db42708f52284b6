// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/aabb.h"
#include "cullet/broad/backend.h"
#include "cullet/broad/row_pair.h"
#include "cullet/demos/scenes/splitmix64.h"

#include <cuda_runtime_api.h>

#include <cstdint>
#include <stdexcept>
#include <vector>

// Shared by GPU benchmarks: errors as exceptions, boxes in device memory, device timers, and hashes of pairs.
namespace cullet
{
/// Frames before the timed ones.
inline constexpr int kWarmUps = 6;

inline void checkCuda(cudaError_t error)
{
    if (error != cudaSuccess)
        throw std::runtime_error(cudaGetErrorString(error));
}

inline void requireOk(Status status)
{
    if (status != Status::Ok)
        throw std::runtime_error(status == Status::OutOfMemory ? "out of device memory"
                                                               : "the device failed");
}

/// A stream that waits for no other.
class Stream
{
public:
    Stream() { checkCuda(cudaStreamCreateWithFlags(&m_stream, cudaStreamNonBlocking)); }
    Stream(const Stream&) = delete;
    Stream& operator=(const Stream&) = delete;
    ~Stream() { cudaStreamDestroy(m_stream); }
    cudaStream_t get() const { return m_stream; }

private:
    cudaStream_t m_stream = nullptr;
};

/// Milliseconds of a stream between two points.
class StreamTimer
{
public:
    explicit StreamTimer(cudaStream_t stream) : m_stream(stream)
    {
        checkCuda(cudaEventCreate(&m_begin));
        checkCuda(cudaEventCreate(&m_end));
    }
    StreamTimer(const StreamTimer&) = delete;
    StreamTimer& operator=(const StreamTimer&) = delete;
    ~StreamTimer()
    {
        cudaEventDestroy(m_begin);
        cudaEventDestroy(m_end);
    }

    void begin() { checkCuda(cudaEventRecord(m_begin, m_stream)); }
    void end() { checkCuda(cudaEventRecord(m_end, m_stream)); }
    /// Waits for the end.
    double milliseconds() const
    {
        checkCuda(cudaEventSynchronize(m_end));
        float ms = 0;
        checkCuda(cudaEventElapsedTime(&ms, m_begin, m_end));
        return ms;
    }

private:
    cudaStream_t m_stream;
    cudaEvent_t m_begin = nullptr, m_end = nullptr;
};

/// Boxes in device memory.
class DeviceBoxes
{
public:
    explicit DeviceBoxes(std::uint64_t count)
    {
        checkCuda(cudaMalloc(reinterpret_cast<void**>(&m_data), count * sizeof(Aabb)));
    }
    explicit DeviceBoxes(const std::vector<Aabb>& boxes) : DeviceBoxes(boxes.size())
    {
        checkCuda(cudaMemcpy(m_data, boxes.data(), boxes.size() * sizeof(Aabb), cudaMemcpyHostToDevice));
    }
    DeviceBoxes(const DeviceBoxes&) = delete;
    DeviceBoxes& operator=(const DeviceBoxes&) = delete;
    ~DeviceBoxes() { cudaFree(m_data); }
    Aabb* data() const { return m_data; }

private:
    Aabb* m_data = nullptr;
};

/// Hash of a pair; the hash of a set is the sum over its pairs, independent of their order.
inline std::uint64_t hashOf(Pair pair)
{
    return splitMix(pairKey(pair));
}

/// @param pairs [count] rows, in device memory
inline std::uint64_t hashOfDevicePairs(const RowPair* pairs, std::uint64_t count)
{
    std::vector<RowPair> found(count);
    checkCuda(cudaMemcpy(found.data(), pairs, count * sizeof(RowPair), cudaMemcpyDeviceToHost));
    std::uint64_t hash = 0;
    for (const RowPair pair : found)
        hash += hashOf(makePair(pair.a, pair.b));
    return hash;
}
}  // namespace cullet
