// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cuda/cuda_error.h"

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cullet::psap
{
/// A second stream for copies that come in parts, so that the first one works on a part while the next is on its way.
class PartStream
{
public:
    PartStream() = default;
    PartStream(const PartStream&) = delete;
    PartStream& operator=(const PartStream&) = delete;
    ~PartStream()
    {
        for (const cudaEvent_t event : m_events)
            cudaEventDestroy(event);
        if (m_own != nullptr)
            cudaStreamDestroy(m_own);
        cudaGetLastError();
    }

    /// The parts come after all that `user` has been given.
    ///
    /// @param isApart false: on that stream itself, which costs no events
    void begin(cudaStream_t user, bool isApart)
    {
        m_stream = user;
        m_count = 0;
        if (!isApart)
            return;
        if (m_own == nullptr)
            CULLET_CUDA_TRY(cudaStreamCreateWithFlags(&m_own, cudaStreamNonBlocking));
        m_stream = m_own;
        record(user);
        CULLET_CUDA_TRY(cudaStreamWaitEvent(m_own, m_events[0], 0));
    }

    /// Where the next part is to be copied.
    cudaStream_t stream() const { return m_stream; }

    /// That part has been enqueued.
    void end()
    {
        if (m_count != 0)
            record(m_own);
    }

    /// What `user` gets from now on waits for that part.
    void await(cudaStream_t user, std::uint64_t part)
    {
        if (m_count != 0)
            CULLET_CUDA_TRY(cudaStreamWaitEvent(user, m_events[part + 1], 0));
    }

    /// Waits for all of it, whether it went well or not.
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
    std::vector<cudaEvent_t> m_events;  ///< of the first stream's work, then of each part
    std::size_t m_count = 0;            ///< recorded since begin(); 0 where nothing is apart
};
}  // namespace cullet::psap
