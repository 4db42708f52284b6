// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "broad/psap_pipeline.h"
#include "cuda/cuda_device.h"
#include "cuda/cuda_exec.cuh"
#include "cuda/device_pairs.h"

#include <new>

namespace cullet
{
namespace
{
using namespace psap;

class PairFinder final : public DevicePairFinder
{
public:
    PairFinder(const PsapOptions& options, cudaStream_t stream)
        : m_options(options), m_exec(options, stream), m_search(options)
    {
    }
    ~PairFinder() override { dropGraphs(); }

    Status enqueue(const Aabb* boxes, std::uint64_t count) override
    {
        return guarded(
            [&]
            {
                m_exec.reserve(m_found, 1);
                m_exec.reserve(m_count, 1);
                enqueueOrThrow({boxes, count, m_found.data(), m_lastCount});
            });
    }

    Status collect(DevicePairs& pairs) override
    {
        return guarded(
            [&]
            {
                pairs = {};
                if (m_found.size() == 0)
                    return;
                fetchCount();
                if (*m_count.data() == kSpilled)
                {
                    m_search.buildByCounting(m_exec);
                    emit();
                    fetchCount();
                }
                while (*m_count.data() > m_pairs.size())
                {
                    dropGraphs();
                    m_exec.reserve(m_pairs, *m_count.data());
                    m_exec.clear(m_found.data(), 1);
                    emit();
                    fetchCount();
                }
                pairs = {m_pairs.data(), *m_count.data()};
                m_lastCount = pairs.count;
            });
    }

    std::uint64_t bytes() const override { return m_exec.bytes(); }

private:
    template <class Body>
    Status guarded(const Body& body)
    {
        try
        {
            const CudaExec::Use use(m_exec);
            body();
            return Status::Ok;
        }
        catch (const ExecutorFailure& failure)
        {
            dropGraphs();
            m_search = Search<CudaExec>(m_options);
            return failure.status;
        }
        catch (const std::bad_alloc&)
        {
            return Status::OutOfMemory;
        }
    }

    void enqueueOrThrow(SearchInput input)
    {
        const bool isSame = input.boxes == m_input.boxes && input.count == m_input.count;
        m_input = input;
        m_search.look();
        if (!isSame)
            dropGraphs();
        if (isSame && m_search.isRepeatable(m_exec, input))
        {
            if (m_search.launches() != m_recorded)
                dropGraphs();
            m_recorded = m_search.launches();
            cudaGraphExec_t& graph = m_graphs[m_search.nextPhase()];
            if (graph == nullptr)
                record(graph);
            else
                m_search.countRepeat();
            CULLET_CUDA_TRY(cudaGraphLaunch(graph, m_exec.stream()));
            return;
        }
        m_exec.reserve(m_pairs, m_options.initialCapacity);
        searchOnce();
    }

    void searchOnce()
    {
        m_search.build(m_exec, m_input);
        emit();
    }

    void emit()
    {
        EntryTest all{};
        all.takeAll = true;
        m_search.emit(m_exec, all, {m_pairs.data(), m_pairs.size(), m_found.data()});
    }

    void fetchCount()
    {
        m_exec.download(m_count.data(), m_found.data(), 1);
        m_exec.wait();
    }

    /// Records the launches of one search, so that they go to the device in one call.
    void record(cudaGraphExec_t& graphOfPhase)
    {
        cudaGraph_t graph = nullptr;
        CULLET_CUDA_TRY(cudaStreamBeginCapture(m_exec.stream(), cudaStreamCaptureModeThreadLocal));
        try
        {
            searchOnce();
        }
        catch (...)
        {
            cudaStreamEndCapture(m_exec.stream(), &graph);
            if (graph != nullptr)
                cudaGraphDestroy(graph);
            cudaGetLastError();
            throw;
        }
        CULLET_CUDA_TRY(cudaStreamEndCapture(m_exec.stream(), &graph));
        const cudaError_t error = cudaGraphInstantiateWithFlags(&graphOfPhase, graph, 0);
        cudaGraphDestroy(graph);
        throwIfFailed(error, "cudaGraphInstantiateWithFlags");
    }

    void dropGraphs() noexcept
    {
        for (cudaGraphExec_t& graph : m_graphs)
        {
            if (graph != nullptr)
                cudaGraphExecDestroy(graph);
            graph = nullptr;
        }
    }

    PsapOptions m_options;
    CudaExec m_exec;
    Search<CudaExec> m_search;
    SearchInput m_input{};
    std::uint64_t m_lastCount = 0;
    cudaGraphExec_t m_graphs[Search<CudaExec>::kPhases] = {};
    std::uint32_t m_recorded = 0;  ///< launches of the search that the graphs are made of
    DeviceBuffer<IdPair> m_pairs;
    DeviceBuffer<std::uint64_t> m_found;
    PinnedBuffer<std::uint64_t> m_count;
};
}  // namespace

std::unique_ptr<DevicePairFinder> makeDevicePairFinder(const PsapOptions& options, CUstream_st* stream,
                                                       std::string* why)
{
    std::string reason;
    if (cudaDeviceUsable(&reason))
    {
        try
        {
            return std::make_unique<PairFinder>(options, stream);
        }
        catch (const ExecutorFailure& failure)
        {
            reason = std::string("the CUDA device does not start: ") + failure.call + ": " + failure.reason;
        }
    }
    if (why != nullptr)
        *why = reason;
    return nullptr;
}
}  // namespace cullet
