// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/broad/psap/delta_search.h"
#include "cullet/cuda/device_pairs.h"
#include "cullet/cuda/pair_finder.cuh"
#include "cullet/cuda/runtime/cuda_device.h"

#include <memory>
#include <string>
#include <utility>

namespace cullet
{
namespace
{
using namespace psap;

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
    return make<DevicePairFinder, PairFinder<>>(options, stream, why);
}

std::unique_ptr<DeviceDeltaFinder> makeDeviceDeltaFinder(const PsapOptions& options, CUstream_st* stream,
                                                         std::string* why)
{
    return make<DeviceDeltaFinder, DeltaFinder>(options, stream, why);
}
}  // namespace cullet
