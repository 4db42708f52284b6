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
    void look(Exec& exec)
    {
        m_word.look();
        if (m_next == Step::Take && m_word.seen() >> 32 == m_made)
            take(exec);
    }

    /// Prepares an update: makes a plan where there is none.
    void prepare(Exec& exec, const SearchInput& input, std::uint64_t binCapacity)
    {
        if (!m_hasPlan)
            make(exec, input, binCapacity);
    }

    /// Makes the next step towards the next plan. To be called once for each update, after all its launches.
    void planAhead(Exec& exec, const SearchInput& input)
    {
        ++m_age;
        switch (m_next)
        {
            case Step::Keep:
                if (!m_hasPlan || m_age < m_updatesPerPlan)
                    break;
                m_sample.keep(exec, input, kBoxesInSample);
                m_statistics.reserveFor(exec, m_sample.boxes());
                m_next = Step::Sum;
                m_age = 0;
                break;
            case Step::Sum:
                exec.fork();
                exec.aside([&] { m_statistics.begin(exec, m_sample.boxes()); });
                m_next = Step::AddUp;
                break;
            case Step::AddUp:
                exec.fork();  // not concurrently with the search, whose last blocks need the multiprocessors
                exec.aside([&] { m_next = m_statistics.addUp(exec) ? Step::Plan : Step::AddUp; });
                break;
            case Step::Plan:
                exec.aside([&] { plan(exec, m_plans[1].data()); });
                m_next = Step::Ready;
                break;
            case Step::Ready:
                exec.aside([&] { m_statistics.ready(exec); });
                m_next = Step::Take;
                break;
            case Step::Take:  // in poll()
                break;
        }
    }

    const LevelPlan* plan() const { return m_plans[0].data(); }
    /// Summary of the last plan that poll() has read; 0 levels: there is none yet.
    ToldPlan told() const { return ToldPlan::of(m_word.seen()); }
    bool hasPlan() const { return m_hasPlan; }
    void forget() { m_hasPlan = false; }
    /// Takes effect with the next plan; see PlanLevels.
    void planForGroups(bool isForGroups) { m_isForGroups = isForGroups; }

private:
    template <class T>
    using Buffer = typename Exec::template Buffer<T>;

    /// Steps towards the next plan.
    enum class Step
    {
        Keep,  ///< a copy of the boxes, once the plan is old enough
        Sum,
        AddUp,
        Plan,
        Ready,  ///< of the statistics of the plan after the next one
        Take
    };

    static constexpr std::uint32_t kUpdatesPerPlan = 32;
    static constexpr std::uint64_t kBoxesInSample = 1u << 17;

    void make(Exec& exec, const SearchInput& input, std::uint64_t binCapacity)
    {
        exec.join();
        reserve(exec);
        m_binCapacity = binCapacity;
        m_sample.keep(exec, input, kBoxesInSample);
        m_statistics.collectMost(exec, m_sample.boxes());
        plan(exec, m_plans[0].data());
        exec.fork();
        exec.aside([&] { m_statistics.ready(exec); });
        m_hasPlan = true;
        m_next = Step::Keep;
        m_age = 0;
    }

    void reserve(Exec& exec)
    {
        if (m_word.isThere())
            return;
        reservePlans(exec, m_plans);
        m_word.reserve(exec);
    }

    void plan(Exec& exec, LevelPlan* to)
    {
        ++m_made;
        exec.forEach(
            1, PlanRows{m_statistics.moments(), m_statistics.sizes(), m_sample.stride(), m_axis, m_cellScale,
                        m_binScale, m_perBin, m_isForGroups, m_binCapacity, m_made, to});
        m_word.ask(exec, &to->told);
    }

    /// Copies the next plan over the one in use, so that recorded launches remain valid.
    void take(Exec& exec)
    {
        exec.copy(m_plans[0].data(), m_plans[1].data(), 1);
        m_next = Step::Keep;
    }

    PsapAxis m_axis;
    float m_cellScale, m_binScale;
    double m_perBin;
    std::uint32_t m_updatesPerPlan;
    bool m_isForGroups = false;
    std::uint64_t m_binCapacity = 0;
    bool m_hasPlan = false;
    std::uint32_t m_age = 0;   ///< updates since the statistics of the last plan were collected
    std::uint32_t m_made = 0;  ///< number of plans made
    Step m_next = Step::Keep;
    Statistics<Exec> m_statistics;
    BoxSample<Exec> m_sample;
    Buffer<LevelPlan> m_plans[2];  ///< the one in use, and the next one
    ToldWord<Exec> m_word;
};
}  // namespace cullet::psap
