// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/cuda/runtime/cuda_error.h"

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cullet::psap
{
/// Copies in parts on a stream of their own, so that the first stream can process a part while the next one is
/// copied.
class ChunkedUpload
{
public:
    ChunkedUpload() = default;
    ChunkedUpload(const ChunkedUpload&) = delete;
    ChunkedUpload& operator=(const ChunkedUpload&) = delete;
    ~ChunkedUpload()
    {
        for (const cudaEvent_t event : m_events)
            cudaEventDestroy(event);
        if (m_own != nullptr)
            cudaStreamDestroy(m_own);
        cudaGetLastError();
    }

    /// Begins a series of parts. They do not wait for earlier work on `user`, unless they use that stream itself.
    ///
    /// @param hasOwnStream false: the parts use `user` itself, which costs no events
    void begin(cudaStream_t user, bool hasOwnStream)
    {
        m_count = 0;
        m_hasOwnStream = hasOwnStream;
        if (hasOwnStream && m_own == nullptr)
            CULLET_CUDA_TRY(cudaStreamCreateWithFlags(&m_own, cudaStreamNonBlocking));
        m_stream = hasOwnStream ? m_own : user;
    }

    /// The stream on which the next part is to be copied.
    cudaStream_t stream() const { return m_stream; }

    /// Marks the end of a part, after its copy has been enqueued.
    void end()
    {
        if (m_hasOwnStream)
            record(m_own);
    }

    /// Makes all later work on `user` wait for that part.
    void await(cudaStream_t user, std::uint64_t part)
    {
        if (m_hasOwnStream)
            CULLET_CUDA_TRY(cudaStreamWaitEvent(user, m_events[part], 0));
    }

    /// Waits for all parts, and ignores errors.
    void drain() noexcept
    {
        if (m_own != nullptr)
            cudaStreamSynchronize(m_own);
    }

private:
    void record(cudaStream_t stream)
    {
        if (m_count == m_events.size())
        {
            cudaEvent_t event = nullptr;
            CULLET_CUDA_TRY(cudaEventCreateWithFlags(&event, cudaEventDisableTiming));
            m_events.push_back(event);
        }
        CULLET_CUDA_TRY(cudaEventRecord(m_events[m_count], stream));
        ++m_count;
    }

    cudaStream_t m_own = nullptr;
    cudaStream_t m_stream = nullptr;
    bool m_hasOwnStream = false;
    std::vector<cudaEvent_t> m_events;  ///< one per part
    std::size_t m_count = 0;            ///< recorded since begin()
};
}  // namespace cullet::psap
