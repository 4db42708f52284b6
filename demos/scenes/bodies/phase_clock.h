// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/program/files/trace_file.h"

#include <LinearMath/btQuickprof.h>

#include <array>
#include <chrono>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// The parts of a step of a Bullet world.
enum class Phase
{
    UpdateAabbs,  ///< shape boxes and setAabb, in which DBVT finds pairs
    CalculateOverlappingPairs,
    Dispatch,  ///< narrow phase
    Islands,
    Solver,
    Integrate,  ///< prediction, predictive contacts and integration of transforms
    Rest
};

constexpr std::size_t kPhaseCount = 7;

const char* phaseName(Phase phase) noexcept;

/// Milliseconds per phase.
using PhaseTimes = std::array<double, kPhaseCount>;

/// One quantity over all steps, in milliseconds.
struct StepSample
{
    std::string name;
    std::vector<double> milliseconds;
};

/// Every phase, then "broadPhase" (updateAabbs + calculateOverlappingPairs: the cost of a broad phase, in whichever of
/// them it finds pairs) and "step" (all phases).
std::vector<StepSample> samplesOf(const std::vector<PhaseTimes>& steps);

/// Measures single steps through Bullet's profile zones, which call custom functions even where Bullet's own profiler
/// is compiled out (btSetCustomEnterProfileZoneFunc).
///
/// Time is attributed to the innermost zone with a phase, so the phases add up to the whole step. Zones of other threads
/// than the measured one are left out. One clock may run at a time.
class PhaseClock
{
public:
    /// Runs `step` and returns its time per phase; every zone, with or without a phase, is written to the trace.
    template <class Step>
    static PhaseTimes measure(TraceLane& trace, Step step)
    {
        PhaseClock clock(trace);
        step();
        return clock.finish();
    }

private:
    using Clock = std::chrono::steady_clock;

    explicit PhaseClock(TraceLane& trace);
    ~PhaseClock();
    PhaseTimes finish();

    bool isOnOwnThread() const { return std::this_thread::get_id() == m_thread; }
    static void onEnter(const char* zone);
    static void onLeave();
    void charge();
    Phase phaseOfZone(const char* zone);

    std::thread::id m_thread = std::this_thread::get_id();
    TraceLane& m_trace;
    btEnterProfileZoneFunc* m_previousEnter;
    btLeaveProfileZoneFunc* m_previousLeave;
    std::vector<Phase> m_stack;
    std::vector<std::pair<const char*, Phase>> m_known;  ///< only zones with their own phase
    std::vector<const char*> m_foreign;
    PhaseTimes m_times = {};
    Clock::time_point m_last;
};
}  // namespace CULLET_PRECISION
}  // namespace cullet
