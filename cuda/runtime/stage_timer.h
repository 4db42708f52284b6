// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/cuda/runtime/cuda_error.h"

#include <cuda_runtime_api.h>

#include <cstddef>
#include <vector>

#if defined(__has_include)
#if __has_include(<nvtx3/nvToolsExt.h>)
#include <nvtx3/nvToolsExt.h>
#define CULLET_HAS_NVTX 1
#endif
#endif

namespace cullet::psap
{
/// Marks the stages of an update on a stream: as NVTX ranges for profilers where the toolkit has NVTX, and with events
/// where the caller wants times.
class StageTimer
{
public:
    explicit StageTimer(bool isTiming) : m_isTiming(isTiming) {}
    StageTimer(const StageTimer&) = delete;
    StageTimer& operator=(const StageTimer&) = delete;
    ~StageTimer()
    {
        closeRange();
        for (const cudaEvent_t event : m_events)
            cudaEventDestroy(event);
        cudaGetLastError();
    }

    /// Begins a stage, which all later work on the stream belongs to; null: no stage.
    void begin(const char* name, cudaStream_t stream)
    {
        closeRange();
        if (m_isTiming)
            recordEvent(name, stream);
#ifdef CULLET_HAS_NVTX
        if (name != nullptr)
            nvtxRangePushA(name);
#endif
        m_isOpen = name != nullptr;
    }

    void drop() noexcept
    {
        m_names.clear();
    }

    /// The durations of the stages since the last call, each up to the beginning of the next one. Waits for the last
    /// one.
    void collect(Array<StageTime>& stages)
    {
        stages.clear();
        if (!m_names.empty())
            CULLET_CUDA_TRY(cudaEventSynchronize(m_events[m_names.size() - 1]));
        for (std::size_t k = 0; k + 1 < m_names.size(); ++k)
        {
            float milliseconds = 0;
            CULLET_CUDA_TRY(cudaEventElapsedTime(&milliseconds, m_events[k], m_events[k + 1]));
            stages.push_back({m_names[k], static_cast<double>(milliseconds)});
        }
        m_names.clear();
    }

private:
    void recordEvent(const char* name, cudaStream_t stream)
    {
        if (m_names.size() == m_events.size())
        {
            cudaEvent_t event = nullptr;
            CULLET_CUDA_TRY(cudaEventCreate(&event));
            m_events.push_back(event);
        }
        CULLET_CUDA_TRY(cudaEventRecord(m_events[m_names.size()], stream));
        m_names.push_back(name);
    }

    /// Ends the current NVTX range, also one that an exception has interrupted.
    void closeRange()
    {
#ifdef CULLET_HAS_NVTX
        if (m_isOpen)
            nvtxRangePop();
#endif
        m_isOpen = false;
    }

    bool m_isTiming;
    bool m_isOpen = false;
    std::vector<const char*> m_names;
    std::vector<cudaEvent_t> m_events;
};
}  // namespace cullet::psap
