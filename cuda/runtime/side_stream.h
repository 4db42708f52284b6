// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/cuda/runtime/cuda_error.h"
#include "cullet/cuda/runtime/event.h"

#include <cuda_runtime_api.h>

namespace cullet::psap
{
/// A second stream for work that runs concurrently with the first one.
class SideStream
{
public:
    SideStream() = default;
    SideStream(const SideStream&) = delete;
    SideStream& operator=(const SideStream&) = delete;
    ~SideStream()
    {
        if (m_own != nullptr)
            cudaStreamDestroy(m_own);
        cudaGetLastError();
    }

    /// Makes all later work on this stream wait for all earlier work on `user`.
    ///
    /// @pre join(), which creates this stream; that takes longer than many an update
    void fork(cudaStream_t user)
    {
        m_fork.record(user);
        m_fork.makeStreamWait(m_own);
    }

    /// Makes all later work on `user` wait for all earlier work on this stream.
    void join(cudaStream_t user)
    {
        if (m_own == nullptr)
            CULLET_CUDA_TRY(cudaStreamCreateWithFlags(&m_own, cudaStreamNonBlocking));
        m_join.record(m_own);
        m_join.makeStreamWait(user);
    }

    cudaStream_t stream() const { return m_own; }

    /// Whether all work on this stream is complete.
    bool isDone() const
    {
        const cudaError_t state = CULLET_CUDA_RESULT(cudaStreamQuery(m_own));
        if (state != cudaErrorNotReady)
            throwIfFailed(state, "cudaStreamQuery");
        cudaGetLastError();
        return state == cudaSuccess;
    }
    void wait() const
    {
        if (m_own != nullptr)
            CULLET_CUDA_TRY(cudaStreamSynchronize(m_own));
    }
    /// Waits for all work, and ignores errors.
    void drain() noexcept
    {
        if (m_own != nullptr)
            cudaStreamSynchronize(m_own);
    }

private:
    cudaStream_t m_own = nullptr;
    EventMark m_fork, m_join;
};
}  // namespace cullet::psap
