// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/psap_row_plan.h"
#include "broad/psap_search_input.h"

#include <algorithm>
#include <cstdint>

namespace cullet::psap
{
/// Makes a plan from a sample of the boxes, and keeps it for some updates.
template <class Exec>
class RowPlanner
{
public:
    /// @param perBin as PlanRows::perBin
    RowPlanner(const PsapOptions& options, PsapAxis axis, double perBin)
        : m_axis(axis), m_cellScale(options.cellScale), m_binScale(options.binScale), m_perBin(perBin)
    {
    }

    /// For one update; makes a plan where there is none or that one is old.
    void prepare(Exec& exec, const SearchInput& input, std::uint64_t binCapacity)
    {
        if (isStale())
            make(exec, input, binCapacity);
        ++m_age;
    }

    const RowPlan* plan() const { return m_plan.data(); }
    /// Levels that the sizes ask for, in the last plan that the executor was waited for; 0: none yet.
    std::uint32_t levelCount() const { return m_levelCount.size() == 0 ? 0 : *m_levelCount.data(); }
    bool isStale() const { return m_age >= kUpdatesPerPlan; }
    void forget() { m_age = kUpdatesPerPlan; }
    /// From the next plan on; see PlanRows.
    void planForGroups(bool isForGroups) { m_isForGroups = isForGroups; }
    /// Counts an update without prepare().
    void countUse() { ++m_age; }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    static constexpr std::uint32_t kUpdatesPerPlan = 32;
    static constexpr std::uint64_t kBoxesInSample = 1u << 17;

    void make(Exec& exec, const SearchInput& input, std::uint64_t binCapacity)
    {
        exec.reserve(m_plan, 1);
        if (m_levelCount.size() == 0)
        {
            exec.reserve(m_levelCount, 1);
            *m_levelCount.data() = 0;
        }
        const std::uint64_t stride = std::max<std::uint64_t>(1, input.count / kBoxesInSample);
        m_statistics.collectMost(exec, input, stride);
        exec.forEach(
            1, PlanRows{m_statistics.moments(), m_statistics.sizes(), static_cast<double>(stride), m_axis,
                        m_cellScale, m_binScale, m_perBin, m_isForGroups, binCapacity, m_plan.data()});
        exec.download(m_levelCount.data(), &m_plan.data()->levelsBySize, 1);
        m_age = 0;
    }

    PsapAxis m_axis;
    float m_cellScale, m_binScale;
    double m_perBin;
    bool m_isForGroups = false;
    std::uint32_t m_age = kUpdatesPerPlan;
    Statistics<Exec> m_statistics;
    Buffer<RowPlan> m_plan;
    typename Exec::template Staging<std::uint32_t> m_levelCount;
};
}  // namespace cullet::psap
