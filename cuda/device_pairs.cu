// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/psap/delta_search.h"
#include "cullet/broad/psap/search.h"
#include "cullet/cuda/device_pairs.h"
#include "cullet/cuda/kernels/cuda_exec.cuh"
#include "cullet/cuda/runtime/cuda_device.h"
#include "cullet/cuda/runtime/graph_launches.cuh"

#include <new>
#include <utility>

namespace cullet
{
namespace
{
using namespace psap;

/// Calls `body`. After a failure waits for all work and calls `forget`.
template <class Body, class Forget>
Status guarded(CudaExec& exec, const Body& body, const Forget& forget)
{
    Status status = Status::OutOfMemory;
    try
    {
        const CudaExec::DeviceGuard use(exec);
        body();
        return Status::Ok;
    }
    catch (const ExecutorFailure& failure)
    {
        status = failure.status;
    }
    catch (const std::bad_alloc&)
    {
    }
    exec.drain();
    forget();
    return status;
}

class PairFinder final : public DevicePairFinder
{
public:
    PairFinder(const PsapOptions& options, cudaStream_t stream)
        : m_options(options), m_exec(options, stream), m_search(options)
    {
    }

    Status enqueue(const Aabb* boxes, std::uint64_t count) override
    {
        return guarded(
            m_exec,
            [&]
            {
                m_exec.reserve(m_found, 1);
                m_exec.reserve(m_count, 1);
                enqueueOrThrow({boxes, count, m_found.data(), m_lastCount});
            },
            [&] { forget(); });
    }

    DevicePairsAhead ahead() const override { return {m_pairs.data(), m_pairs.size(), m_found.data()}; }

    Status collect(DevicePairs& pairs) override
    {
        pairs = {};
        return guarded(
            m_exec,
            [&]
            {
                if (!m_hasSearch)
                    return;
                collectOrThrow();
                pairs = {m_pairs.data(), *m_count.data()};
                m_lastCount = pairs.count;
            },
            [&] { forget(); });
    }

    std::uint64_t bytes() const override { return m_exec.bytes(); }

private:
    void forget()
    {
        m_launches.drop();
        m_search = Search<CudaExec>(m_options);
        m_input = {};
        m_hasSearch = false;
    }

    void enqueueOrThrow(SearchInput input)
    {
        const bool isSame = input.boxes == m_input.boxes && input.count == m_input.count;
        m_input = input;
        m_hasSearch = true;
        m_search.poll(m_exec);
        if (!isSame)
            m_launches.drop();
        if (!isSame || !m_search.isRepeatable(m_exec, input))
        {
            m_exec.reserve(m_pairs, m_options.initialCapacity);
            searchOnce();
        }
        else if (m_launches.launch(m_exec.stream(), m_search.nextPhase(), m_search.launches(),
                                   [&] { searchOnce(); }))
            m_search.countRepeat();
        m_search.advanceNextPlan(m_exec);
    }

    void collectOrThrow()
    {
        fetchCount();
        if (*m_count.data() == kOverflowed)
        {
            m_search.buildByCounting(m_exec, m_input.boxes);
            emit();
            fetchCount();
        }
        while (*m_count.data() > m_pairs.size())
        {
            m_launches.drop();
            m_exec.reserve(m_pairs, *m_count.data());
            m_exec.clear(m_found.data(), 1);
            emit();
            fetchCount();
        }
    }

    void searchOnce()
    {
        m_search.build(m_exec, m_input);
        emit();
    }

    void emit() { m_search.emit(m_exec, EveryPair{}, {m_pairs.data(), m_pairs.size(), m_found.data()}); }

    void fetchCount()
    {
        m_exec.download(m_count.data(), m_found.data(), 1);
        m_exec.wait();
    }

    PsapOptions m_options;
    CudaExec m_exec;  ///< declared before the buffers, which use its memory
    Search<CudaExec> m_search;
    SearchInput m_input{};
    bool m_hasSearch = false;
    std::uint64_t m_lastCount = 0;
    GraphLaunches<Search<CudaExec>::kPhases> m_launches;
    DeviceBuffer<RowPair> m_pairs;
    DeviceBuffer<std::uint64_t> m_found;
    PinnedBuffer<std::uint64_t> m_count;
};

class DeltaFinder final : public DeviceDeltaFinder
{
public:
    DeltaFinder(const PsapOptions& options, cudaStream_t stream)
        : m_options(options), m_exec(options, stream), m_search(options)
    {
    }

    Status enqueue(const Aabb* boxes, std::uint64_t count) override
    {
        return guarded(
            m_exec,
            [&]
            {
                finish();
                enqueueOrThrow(boxes, count);
                m_exec.mark();
                m_isFinished = false;
            },
            [&] { recover(); });
    }

    DeviceDeltasAhead ahead() const override
    {
        return {m_search.kept(), m_search.added(), m_search.addedRoom(), m_search.removed(),
                m_search.deviceCounts()};
    }

    Status collect(DeviceDeltas& deltas) override
    {
        deltas = {};
        return guarded(
            m_exec,
            [&]
            {
                finish();
                const DeltaCounts& counts = m_search.counts();
                deltas = {m_search.kept(), counts.kept,        m_search.added(),
                          counts.added,    m_search.removed(), counts.removed};
            },
            [&] { recover(); });
    }

    void forget() override
    {
        m_exec.drain();
        m_search.forget();
        m_isFinished = true;
    }

    std::uint64_t bytes() const override { return m_exec.bytes(); }

private:
    void recover()
    {
        m_launches.drop();
        m_search.recover(m_options);
        m_isFinished = true;
    }

    void enqueueOrThrow(const Aabb* boxes, std::uint64_t count)
    {
        if (!m_search.prepare(m_exec, boxes, count))
        {
            m_launches.drop();
            m_search.launch(m_exec);
        }
        else if (!m_search.isRepeatable(m_exec))
            m_search.launch(m_exec);
        else if (m_launches.launch(m_exec.stream(), m_search.nextPhase(), m_search.launches(),
                                   [&] { m_search.launch(m_exec); }))
            m_search.countRepeat();
        m_search.advanceNextPlan(m_exec);
    }

    /// Completes the last search, repeating it where a list was too short.
    void finish()
    {
        if (m_isFinished)
            return;
        m_exec.awaitMark();
        if (!m_search.finish(m_exec))
            m_launches.drop();
        m_isFinished = true;
    }

    PsapOptions m_options;
    CudaExec m_exec;  ///< declared before the buffers, which use its memory
    DeltaSearch<CudaExec> m_search;
    bool m_isFinished = true;
    GraphLaunches<DeltaSearch<CudaExec>::kPhases> m_launches;
};

/// @tparam Made class that is constructed with options and a stream
template <class Finder, class Made>
std::unique_ptr<Finder> make(const PsapOptions& options, CUstream_st* stream, std::string* why)
{
    return makeOnDevice(options.device, why,
                        [&]() -> std::unique_ptr<Finder> { return std::make_unique<Made>(options, stream); });
}
}  // namespace

std::unique_ptr<DevicePairFinder> makeDevicePairFinder(const PsapOptions& options, CUstream_st* stream,
                                                       std::string* why)
{
    return make<DevicePairFinder, PairFinder>(options, stream, why);
}

std::unique_ptr<DeviceDeltaFinder> makeDeviceDeltaFinder(const PsapOptions& options, CUstream_st* stream,
                                                         std::string* why)
{
    return make<DeviceDeltaFinder, DeltaFinder>(options, stream, why);
}
}  // namespace cullet
