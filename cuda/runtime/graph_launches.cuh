// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/cuda/runtime/cuda_error.h"

#include <cuda_runtime_api.h>

#include <array>
#include <cstddef>
#include <cstdint>

namespace cullet::psap
{
/// CUDA graphs of the launches of a search, recorded once for each phase, so that one call launches them all.
template <std::size_t kPhases>
class GraphLaunches
{
public:
    GraphLaunches() = default;
    GraphLaunches(const GraphLaunches&) = delete;
    GraphLaunches& operator=(const GraphLaunches&) = delete;
    ~GraphLaunches() { drop(); }

    /// Discards all recorded graphs.
    void drop() noexcept
    {
        for (cudaGraphExec_t& graph : m_graphs)
        {
            if (graph != nullptr)
                cudaGraphExecDestroy(graph);
            graph = nullptr;
        }
    }

    /// Launches the graph of a phase. Where there is none, records it by calling `body`.
    ///
    /// @param version version of the launches of all phases: graphs of another version are discarded
    /// @return whether the graph existed, so that `body` was not called
    template <class Body>
    bool launch(cudaStream_t stream, unsigned phase, std::uint32_t version, const Body& body)
    {
        if (version != m_version)
            drop();
        m_version = version;
        const bool wasRecorded = m_graphs[phase] != nullptr;
        if (!wasRecorded)
            record(stream, m_graphs[phase], body);
        CULLET_CUDA_TRY(cudaGraphLaunch(m_graphs[phase], stream));
        return wasRecorded;
    }

private:
    /// Records the work of a stream. The destructor ends the recording after a failure too, since the stream cannot
    /// be used otherwise.
    class Recording
    {
    public:
        explicit Recording(cudaStream_t stream) : m_stream(stream)
        {
            CULLET_CUDA_TRY(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal));
        }
        Recording(const Recording&) = delete;
        Recording& operator=(const Recording&) = delete;
        ~Recording()
        {
            if (m_isOpen)
                cudaStreamEndCapture(m_stream, &m_graph);
            if (m_graph != nullptr)
                cudaGraphDestroy(m_graph);
            cudaGetLastError();
        }

        cudaGraph_t end()
        {
            CULLET_CUDA_TRY(cudaStreamEndCapture(m_stream, &m_graph));
            m_isOpen = false;
            return m_graph;
        }

    private:
        cudaStream_t m_stream;
        cudaGraph_t m_graph = nullptr;
        bool m_isOpen = true;
    };

    template <class Body>
    static void record(cudaStream_t stream, cudaGraphExec_t& recorded, const Body& body)
    {
        Recording recording(stream);
        body();
        CULLET_CUDA_TRY(cudaGraphInstantiateWithFlags(&recorded, recording.end(), 0));
    }

    std::array<cudaGraphExec_t, kPhases> m_graphs{};
    std::uint32_t m_version = 0;
};
}  // namespace cullet::psap
