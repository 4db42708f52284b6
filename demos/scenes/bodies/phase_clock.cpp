// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/scenes/bodies/phase_clock.h"

#include <algorithm>
#include <cstring>
#include <numeric>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
struct Zone
{
    const char* name;
    Phase phase;
};

constexpr Zone kZones[] = {
    {"updateAabbs", Phase::UpdateAabbs},
    {"calculateOverlappingPairs", Phase::CalculateOverlappingPairs},
    {"dispatchAllCollisionPairs", Phase::Dispatch},
    {"calculateSimulationIslands", Phase::Islands},
    {"islandUnionFindAndQuickSort", Phase::Islands},
    {"solveConstraints", Phase::Solver},
    {"predictUnconstraintMotion", Phase::Integrate},
    {"createPredictiveContacts", Phase::Integrate},
    {"integrateTransforms", Phase::Integrate},
};

/// A global, since Bullet's callbacks have no context argument.
PhaseClock* running = nullptr;
}  // namespace

const char* phaseName(Phase phase) noexcept
{
    constexpr const char* kNames[kPhaseCount] = {
        "updateAabbs", "calculateOverlappingPairs", "dispatch", "islands", "solver", "integrate", "rest"};
    return kNames[static_cast<std::size_t>(phase)];
}

std::vector<StepSample> samplesOf(const std::vector<PhaseTimes>& steps)
{
    std::vector<StepSample> samples;
    for (std::size_t phase = 0; phase < kPhaseCount; ++phase)
    {
        samples.push_back({phaseName(static_cast<Phase>(phase)), {}});
        for (const PhaseTimes& times : steps)
            samples.back().milliseconds.push_back(times[phase]);
    }
    StepSample broadPhase = {"broadPhase", {}};
    StepSample step = {"step", {}};
    for (const PhaseTimes& times : steps)
    {
        broadPhase.milliseconds.push_back(times[static_cast<std::size_t>(Phase::UpdateAabbs)] +
                                          times[static_cast<std::size_t>(Phase::CalculateOverlappingPairs)]);
        step.milliseconds.push_back(std::accumulate(times.begin(), times.end(), 0.0));
    }
    samples.push_back(std::move(broadPhase));
    samples.push_back(std::move(step));
    return samples;
}

PhaseClock::PhaseClock(TraceLane& trace)
    : m_trace(trace),
      m_previousEnter(btGetCurrentEnterProfileZoneFunc()),
      m_previousLeave(btGetCurrentLeaveProfileZoneFunc()),
      m_stack{Phase::Rest},
      m_last(Clock::now())
{
    running = this;
    m_trace.begin("step", m_last);
    btSetCustomEnterProfileZoneFunc(onEnter);
    btSetCustomLeaveProfileZoneFunc(onLeave);
}

PhaseClock::~PhaseClock()
{
    btSetCustomEnterProfileZoneFunc(m_previousEnter);
    btSetCustomLeaveProfileZoneFunc(m_previousLeave);
    running = nullptr;
}

PhaseTimes PhaseClock::finish()
{
    charge();
    m_trace.end(m_last);
    return m_times;
}

void PhaseClock::charge()
{
    const Clock::time_point now = Clock::now();
    m_times[static_cast<std::size_t>(m_stack.back())] +=
        std::chrono::duration<double, std::milli>(now - m_last).count();
    m_last = now;
}

Phase PhaseClock::phaseOfZone(const char* zone)
{
    for (const auto& [name, phase] : m_known)
    {
        if (name == zone)
            return phase;
    }
    if (std::find(m_foreign.begin(), m_foreign.end(), zone) != m_foreign.end())
        return m_stack.back();
    for (const Zone& candidate : kZones)
    {
        if (std::strcmp(candidate.name, zone) != 0)
            continue;
        m_known.emplace_back(zone, candidate.phase);
        return candidate.phase;
    }
    m_foreign.push_back(zone);
    return m_stack.back();
}

void PhaseClock::onEnter(const char* zone)
{
    if (!running->isOnOwnThread())
        return;
    running->charge();
    running->m_trace.begin(zone, running->m_last);
    running->m_stack.push_back(running->phaseOfZone(zone));
}

void PhaseClock::onLeave()
{
    if (!running->isOnOwnThread())
        return;
    running->charge();
    running->m_trace.end(running->m_last);
    running->m_stack.pop_back();
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
