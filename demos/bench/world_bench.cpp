// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/world_bench.h"

#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/program/precision.h"
#include "cullet/demos/program/progress.h"
#include "cullet/demos/program/statistics.h"

#include <algorithm>
#include <cstdio>
#include <memory>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
struct WindowSample
{
    std::vector<PhaseTimes> steps;
    std::uint64_t pairs = 0;
    std::uint64_t contactPairs = 0;
    std::uint64_t stateHash = 0;
};

struct WorldRunner
{
    std::unique_ptr<WorldScene> world;
    std::vector<WindowSample> windows;
};

std::vector<WorldRunner> makeRunners(const WorldOptions& options)
{
    WorldSceneOptions world = options.world;
    world.sleeping = false;
    std::vector<WorldRunner> runners;
    for (const std::string& backend : options.backends)
    {
        world.backend = backend;
        for (const std::string& narrow : options.narrow)
        {
            for (const std::string& update : options.updates)
            {
                world.narrow = narrow;
                world.update = update;
                WorldRunner runner;
                runner.world = makeWorldScene(options.scene, world);
                runner.windows.resize(options.windows.size());
                runners.push_back(std::move(runner));
            }
        }
    }
    return runners;
}

/// Adds a row of the trace for each world.
void traceSteps(const WorldOptions& options, std::vector<WorldRunner>& runners)
{
    for (WorldRunner& runner : runners)
    {
        WorldScene& world = *runner.world;
        const std::string name = world.broadphase().name + ", narrow " + world.options().narrow +
                                 ", update " + world.options().update + ", " + options.scene + " of " +
                                 std::to_string(world.options().bodies);
        world.setTrace({options.trace, name});
    }
}

void runStep(const WorldOptions& options, WorldRunner& runner, std::uint32_t step)
{
    const PhaseTimes times = runner.world->step();
    for (std::size_t i = 0; i < options.windows.size(); ++i)
    {
        const StepWindow& window = options.windows[i];
        if (step < window.first || step >= window.end)
            continue;
        WindowSample& sample = runner.windows[i];
        sample.steps.push_back(times);
        if (step + 1 != window.end)
            continue;
        sample.pairs = runner.world->pairCount();
        sample.contactPairs = runner.world->contactPairCount();
        sample.stateHash = runner.world->stateHash();
    }
}

Json makeRow(const WorldOptions& options, const WorldRunner& runner, std::size_t window,
             const StepSample& sample)
{
    const Statistics times = summarise(sample.milliseconds);
    const WindowSample& state = runner.windows[window];
    return {{"benchmark", "world." + sample.name + "." + options.windows[window].name},
            {"scene", options.scene},
            {"backend", runner.world->broadphase().name},
            {"narrow", runner.world->options().narrow},
            {"update", runner.world->options().update},
            {"precision", ownPrecision()},
            {"threads", runner.world->broadphase().threads},
            {"bodies", runner.world->options().bodies},
            {"pairs", state.pairs},
            {"median_ms", times.median},
            {"p90_ms", times.p90},
            {"min_ms", times.min},
            {"hash", toHex(state.stateHash)},
            {"mean_ms", times.mean},
            {"contact_pairs", state.contactPairs},
            {"steps", state.steps.size()}};
}

void printRow(const Json& row)
{
    std::printf("%-40s %-10s %-10s %-8s %8llu pairs %8llu touch  median %10.3f  mean %10.3f ms  %s\n",
                row["benchmark"].get<std::string>().c_str(), row["backend"].get<std::string>().c_str(),
                row["narrow"].get<std::string>().c_str(), row["update"].get<std::string>().c_str(),
                row["pairs"].get<unsigned long long>(), row["contact_pairs"].get<unsigned long long>(),
                row["median_ms"].get<double>(), row["mean_ms"].get<double>(),
                row["hash"].get<std::string>().c_str());
}

void report(const WorldOptions& options, const std::vector<WorldRunner>& runners, ResultFile& file)
{
    for (std::size_t window = 0; window < options.windows.size(); ++window)
    {
        for (const WorldRunner& runner : runners)
        {
            // Interrupted before this window.
            if (runner.windows[window].steps.empty())
                continue;
            for (const StepSample& sample : samplesOf(runner.windows[window].steps))
            {
                Json row = makeRow(options, runner, window, sample);
                printRow(row);
                file.addRow(std::move(row));
            }
        }
    }
}
}  // namespace

void runWorldBench(const WorldOptions& options, ResultFile& file)
{
    std::vector<WorldRunner> runners = makeRunners(options);
    traceSteps(options, runners);
    std::uint32_t steps = 0;
    for (const StepWindow& window : options.windows)
        steps = std::max(steps, window.end);
    {
        Progress progress("world " + options.scene, steps, options.quiet);
        for (std::uint32_t step = 0; step < steps && !isInterrupted(); ++step)
        {
            for (std::size_t i = 0; i < runners.size(); ++i)
                runStep(options, runners[(i + step) % runners.size()], step);
            progress.show(step + 1);
        }
    }
    report(options, runners, file);
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
