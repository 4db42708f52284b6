// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/search.h"
#include "cullet/cuda/device_pairs.h"
#include "cullet/cuda/kernels/cuda_exec.cuh"
#include "cullet/cuda/kernels/guarded.cuh"
#include "cullet/cuda/runtime/graph_launches.cuh"

#include <cstdint>

namespace cullet::psap
{
/// Finds all pairs of boxes in device memory with a search.
///
/// @tparam SearchOn   Search, or another class with its members
/// @tparam SearchOptions what it is made of; PsapOptions or derived from it
template <template <class> class SearchOn = Search, class SearchOptions = PsapOptions>
class PairFinder final : public DevicePairFinder
{
public:
    PairFinder(const SearchOptions& options, cudaStream_t stream)
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
        m_search = SearchOn<CudaExec>(m_options);
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

    SearchOptions m_options;
    CudaExec m_exec;  ///< declared before the buffers, which use its memory
    SearchOn<CudaExec> m_search;
    SearchInput m_input{};
    bool m_hasSearch = false;
    std::uint64_t m_lastCount = 0;
    GraphLaunches<SearchOn<CudaExec>::kPhases> m_launches;
    DeviceBuffer<RowPair> m_pairs;
    DeviceBuffer<std::uint64_t> m_found;
    PinnedBuffer<std::uint64_t> m_count;
};
}  // namespace cullet::psap
