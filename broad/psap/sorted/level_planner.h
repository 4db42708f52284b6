// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/psap/data/level_plan.h"
#include "cullet/broad/psap/data/plan_sampling.h"

#include <cstdint>

namespace cullet::psap
{
/// Makes plans from samples of the boxes, and uses each for several updates. The first plan is made at once; later
/// ones are made in steps, one step per update on the side stream, and adopted when they are complete, so that no
/// update waits for them.
template <class Exec>
class LevelPlanner
{
public:
    /// @param perBin as PlanLevels::perBin
    LevelPlanner(const PsapOptions& options, PsapAxis axis, double perBin)
        : m_axis(axis),
          m_cellScale(options.cellScale),
          m_binScale(options.binScale),
          m_perBin(perBin),
          m_updatesPerPlan(options.updatesPerPlan != 0 ? options.updatesPerPlan : kUpdatesPerPlan)
    {
    }

    /// Polls for the next plan, and adopts it when it is complete. No other function does this, so that the plan
    /// stays the same within an update, in which a search may have to be repeated.
    void poll(Exec& exec)
    {
        m_mailbox.poll();
        if (m_next == Step::Replace && m_mailbox.value() >> 32 == m_plansMade)
            replacePlan(exec);
    }

    /// Prepares an update: makes a plan where there is none.
    void prepare(Exec& exec, const SearchInput& input, std::uint64_t binCapacity)
    {
        if (!m_hasPlan)
            make(exec, input, binCapacity);
    }

    /// Makes the next step towards the next plan. To be called once for each update, after all its launches.
    void advanceNextPlan(Exec& exec, const SearchInput& input)
    {
        ++m_age;
        switch (m_next)
        {
            case Step::Sample:
                if (!m_hasPlan || m_age < m_updatesPerPlan)
                    break;
                m_sample.keep(exec, input, kBoxesInSample);
                m_statistics.reserveFor(exec, m_sample.boxes());
                m_next = Step::Sum;
                m_age = 0;
                break;
            case Step::Sum:
                exec.fork();
                exec.onSideStream([&] { m_statistics.begin(exec, m_sample.boxes()); });
                m_next = Step::Reduce;
                break;
            case Step::Reduce:
                exec.fork();  // not concurrently with the search, whose last blocks need the multiprocessors
                exec.onSideStream([&]
                                  { m_next = m_statistics.reduceStep(exec) ? Step::Plan : Step::Reduce; });
                break;
            case Step::Plan:
                exec.onSideStream([&] { plan(exec, m_plans[1].data()); });
                m_next = Step::PrepareNext;
                break;
            case Step::PrepareNext:
                exec.onSideStream([&] { m_statistics.prepareNext(exec); });
                m_next = Step::Replace;
                break;
            case Step::Replace:  // in poll()
                break;
        }
    }

    const LevelPlan* plan() const { return m_plans[0].data(); }
    /// Summary of the last plan that poll() has read; 0 levels: there is none yet.
    PlanSummary summary() const { return PlanSummary::of(m_mailbox.value()); }
    bool hasPlan() const { return m_hasPlan; }
    void forget() { m_hasPlan = false; }
    /// Takes effect with the next plan; see PlanLevels.
    void planForWarps(bool isForWarps) { m_isForWarps = isForWarps; }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    /// Steps towards the next plan.
    enum class Step
    {
        Sample,  ///< a copy of the boxes, once the plan is old enough
        Sum,
        Reduce,
        Plan,
        PrepareNext,  ///< of the statistics of the plan after the next one
        Replace
    };

    static constexpr std::uint32_t kUpdatesPerPlan = 32;
    static constexpr std::uint64_t kBoxesInSample = 1u << 17;

    void make(Exec& exec, const SearchInput& input, std::uint64_t binCapacity)
    {
        exec.join();
        reserve(exec);
        m_binCapacity = binCapacity;
        m_sample.keep(exec, input, kBoxesInSample);
        m_statistics.collectWithinWindow(exec, m_sample.boxes());
        plan(exec, m_plans[0].data());
        exec.fork();
        exec.onSideStream([&] { m_statistics.prepareNext(exec); });
        m_hasPlan = true;
        m_next = Step::Sample;
        m_age = 0;
    }

    void reserve(Exec& exec)
    {
        if (m_mailbox.isReserved())
            return;
        reservePlans(exec, m_plans);
        m_mailbox.reserve(exec);
    }

    void plan(Exec& exec, LevelPlan* to)
    {
        ++m_plansMade;
        exec.forEach(
            1, PlanLevels{m_statistics.moments(), m_statistics.sizes(), m_sample.stride(), m_axis,
                          m_cellScale, m_binScale, m_perBin, m_isForWarps, m_binCapacity, m_plansMade, to});
        m_mailbox.request(exec, &to->summary);
    }

    /// Copies the next plan over the one in use, so that recorded launches remain valid.
    void replacePlan(Exec& exec)
    {
        exec.copy(m_plans[0].data(), m_plans[1].data(), 1);
        m_next = Step::Sample;
    }

    PsapAxis m_axis;
    float m_cellScale, m_binScale;
    double m_perBin;
    std::uint32_t m_updatesPerPlan;
    bool m_isForWarps = false;
    std::uint64_t m_binCapacity = 0;
    bool m_hasPlan = false;
    std::uint32_t m_age = 0;        ///< updates since the statistics of the last plan were collected
    std::uint32_t m_plansMade = 0;  ///< number of plans made
    Step m_next = Step::Sample;
    Statistics<Exec> m_statistics;
    BoxSample<Exec> m_sample;
    Buffer<LevelPlan> m_plans[2];  ///< the one in use, and the next one
    ResultMailbox<Exec> m_mailbox;
};
}  // namespace cullet::psap
