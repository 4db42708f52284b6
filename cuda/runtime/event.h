// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/cuda/runtime/cuda_error.h"

#include <cuda_runtime_api.h>

namespace cullet::psap
{
/// A point in the work of a stream for which the CPU or other streams can wait.
class EventMark
{
public:
    EventMark() = default;
    EventMark(const EventMark&) = delete;
    EventMark& operator=(const EventMark&) = delete;
    ~EventMark()
    {
        if (m_event != nullptr)
            cudaEventDestroy(m_event);
        cudaGetLastError();
    }

    void record(cudaStream_t stream)
    {
        if (m_event == nullptr)
            CULLET_CUDA_TRY(cudaEventCreateWithFlags(&m_event, cudaEventDisableTiming));
        CULLET_CUDA_TRY(cudaEventRecord(m_event, stream));
    }
    void wait() { CULLET_CUDA_TRY(cudaEventSynchronize(m_event)); }
    /// Makes all later work on that stream wait for this point.
    void makeStreamWait(cudaStream_t stream) { CULLET_CUDA_TRY(cudaStreamWaitEvent(stream, m_event, 0)); }

private:
    cudaEvent_t m_event = nullptr;
};
}  // namespace cullet::psap
