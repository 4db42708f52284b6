// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/world_report.h"

#include "cullet/demos/program/precision.h"
#include "cullet/demos/program/statistics.h"

#include <cmath>
#include <cstdio>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
constexpr double kMillimetres = 1000;

Json makeRow(const WorldOptions& options, const WorldRunner& runner, std::size_t window,
             const StepSample& sample)
{
    const Statistics times = summarise(sample.milliseconds);
    const WindowSample& state = runner.windows[window];
    const WorldScene& world = *runner.world;
    return {{"benchmark", "world." + sample.name + "." + options.windows[window].name},
            {"scene", options.scene},
            {"backend", world.broadphase().name},
            {"narrow", world.options().narrow},
            {"update", world.options().update},
            {"precision", ownPrecision()},
            {"threads", world.threads()},
            {"bodies", world.options().bodies},
            {"pairs", state.pairs},
            {"median_ms", times.median},
            {"p90_ms", times.p90},
            {"min_ms", times.min},
            {"hash", toHex(state.stateHash)},
            {"mean_ms", times.mean},
            {"contact_pairs", state.contactPairs},
            {"steps", state.steps.size()},
            {"parts", runner.parts->name},
            {"depth_mean_mm", kMillimetres * state.quality.points.mean},
            {"depth_p99_mm", kMillimetres * state.quality.points.p99},
            {"depth_max_mm", kMillimetres * state.quality.points.max},
            {"overlap_mean_mm", kMillimetres * state.quality.pairs.mean},
            {"overlap_p99_mm", kMillimetres * state.quality.pairs.p99},
            {"overlap_max_mm", kMillimetres * state.quality.pairs.max},
            {"energy_j", state.quality.energy},
            {"sleepers", state.quality.sleepers},
            {"steps_to_sleep", state.stepsToSleep},
            {"drift_mm", kMillimetres * state.drift},
            {"joint_mean_mm", kMillimetres * state.quality.meanJointError},
            {"joint_max_mm", kMillimetres * state.quality.maxJointError},
            {"solver", world.options().solver},
            {"reuse_mm", kMillimetres * world.options().reuse}};
}

void printHeadOf(const WorldOptions& options, const StepWindow& window)
{
    std::printf(
        "\n%s, %s: steps %u to %u, median ms\n%-46s %9s %9s %9s %9s %9s %9s %9s %9s |%8s %8s %8s %8s %9s %8s "
        " %s\n",
        options.scene.c_str(), window.name.c_str(), window.first, window.end, "", "step", "boxes", "pairs",
        "dispatch", "islands", "solver", "integrate", "rest", "pairs", "touch", "mm mean", "mm max",
        "J a body", "asleep", "hash");
}

void printWorld(const WorldRunner& runner, const WindowSample& state, const std::vector<StepSample>& samples)
{
    std::printf("%-46s %9.3f", runner.title.c_str(), summarise(samples.back().milliseconds).median);
    for (std::size_t phase = 0; phase < kPhaseCount; ++phase)
        std::printf(" %9.3f", summarise(samples[phase].milliseconds).median);
    std::printf(" |%8llu %8llu %8.2f %8.1f %9.1e %8llu  %s\n", static_cast<unsigned long long>(state.pairs),
                static_cast<unsigned long long>(state.contactPairs), kMillimetres * state.quality.pairs.mean,
                kMillimetres * state.quality.pairs.max, state.quality.energy,
                static_cast<unsigned long long>(state.quality.sleepers), toHex(state.stateHash).c_str());
}
}  // namespace

std::string titleOf(const WorldOptions& options, const WorldParts& parts, const WorldScene& world)
{
    std::string title = parts.name;
    if (title.empty())
        title = parts.backend + ", narrow " + parts.narrow + ", update " + parts.update;
    if (parts.solver != "bullet")
        title += ", solver " + parts.solver;
    if (parts.reuse > 0)
        title += ", reuse " + std::to_string(std::lround(kMillimetres * 1000 * parts.reuse)) + " um";
    if (!parts.name.empty() || options.threads.size() > 1)
        title += ", " + std::to_string(world.threads()) + (world.threads() == 1 ? " thread" : " threads");
    return title;
}

void reportWorlds(const WorldOptions& options, const std::vector<WorldRunner>& runners, ResultFile& file)
{
    for (std::size_t window = 0; window < options.windows.size(); ++window)
    {
        bool hasHead = false;
        for (const WorldRunner& runner : runners)
        {
            // Interrupted before this window, or measured in other worlds.
            if (runner.windows[window].steps.empty())
                continue;
            if (!hasHead)
                printHeadOf(options, options.windows[window]);
            hasHead = true;
            const std::vector<StepSample> samples = samplesOf(runner.windows[window].steps);
            printWorld(runner, runner.windows[window], samples);
            for (const StepSample& sample : samples)
                file.addRow(makeRow(options, runner, window, sample));
        }
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
