// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/world_bench.h"

#include "cullet/demos/bench/world_report.h"
#include "cullet/demos/drop/pair_audit.h"
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/files/hash_check.h"
#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/program/progress.h"

#include <algorithm>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
/// Steps of one world before the next world's turn: as in `cullet run`.
constexpr std::uint32_t kBlock = 5;

/// Parts without threads make one world.
bool isRepeated(const std::vector<WorldRunner>& runners, const WorldParts& parts, const WorldScene& world)
{
    return world.threads() == 1 &&
           std::any_of(runners.begin(), runners.end(),
                       [&](const WorldRunner& other)
                       { return other.parts == &parts && other.world->threads() == 1; });
}

std::vector<WorldRunner> makeRunners(const WorldOptions& options, bool mayRest)
{
    WorldSceneOptions scene = options.world;
    scene.sleeping = mayRest;
    std::vector<WorldRunner> runners;
    for (const WorldParts& parts : options.parts)
    {
        for (const int threads : options.threads)
        {
            WorldRunner runner;
            runner.parts = &parts;
            runner.world = makeWorldScene(options.scene, parts.options(scene, threads));
            runner.title = titleOf(options, parts, *runner.world);
            runner.windows.resize(options.windows.size());
            if (!isRepeated(runners, parts, *runner.world))
                runners.push_back(std::move(runner));
        }
    }
    return runners;
}

/// Adds a row of the trace for each world.
void traceSteps(const WorldOptions& options, std::vector<WorldRunner>& runners)
{
    for (WorldRunner& runner : runners)
        runner.world->setTrace({options.trace, runner.title + ", " + options.scene + " of " +
                                                   std::to_string(runner.world->options().bodies)});
}

/// Worlds of which the same bits are promised: cullet's broad phases all give the same pairs in the same order, and neither
/// the number of threads nor cullet::World changes anything.
std::string promiseOf(const WorldOptions& options, const WorldRunner& runner, const StepWindow& window)
{
    const WorldScene& world = *runner.world;
    const std::string broad = world.broadphase().cullet != nullptr ? "cullet" : world.broadphase().name;
    return options.scene + ", " + window.name + ", broad phase " + broad + ", narrow phase " +
           world.options().narrow + ", solver " + world.options().solver + ", reuse " +
           std::to_string(world.options().reuse);
}

void requireExactPairs(const WorldRunner& runner)
{
    btDiscreteDynamicsWorld& world = runner.world->world();
    if (runner.world->broadphase().cullet == nullptr ||
        digestCache(world) == digestExact(collectProxies(world)))
        return;
    throw ProgramError(kExitDisagreement, runner.title + ": the pairs are not the exact ones of the boxes");
}

/// All worlds of a run that have the same rule of sleeping.
class WorldRun
{
public:
    WorldRun(const WorldOptions& options, bool mayRest)
        : m_options(options), m_mayRest(mayRest), m_runners(makeRunners(options, mayRest))
    {
        traceSteps(options, m_runners);
    }

    void run()
    {
        std::uint32_t steps = 0;
        for (const StepWindow& window : m_options.windows)
            steps = std::max(steps, window.mayRest == m_mayRest ? window.end : 0);
        Progress progress("world " + m_options.scene, steps, m_options.quiet);
        for (std::uint32_t done = 0; done < steps && !isInterrupted(); done += kBlock)
        {
            const std::uint32_t end = std::min(done + kBlock, steps);
            for (std::size_t i = 0; i < m_runners.size(); ++i)
                runBlock(m_runners[(i + done / kBlock) % m_runners.size()], done, end);
            progress.show(end);
        }
    }

    void report(ResultFile& file) const { reportWorlds(m_options, m_runners, file); }

private:
    void runBlock(WorldRunner& runner, std::uint32_t first, std::uint32_t end)
    {
        for (std::uint32_t step = first; step < end && !isInterrupted(); ++step)
        {
            const PhaseTimes times = runner.world->step();
            noteSleep(runner, step);
            for (std::size_t i = 0; i < m_options.windows.size(); ++i)
                sample(runner, i, step, times);
        }
    }

    void noteSleep(WorldRunner& runner, std::uint32_t step) const
    {
        if (!m_mayRest)
            return;
        const bool areAsleep = sleepersOf(runner.world->world()).areAlmostAll();
        if (!areAsleep || runner.stepsToSleep < 0)
            runner.stepsToSleep = areAsleep ? std::int64_t{step} + 1 : -1;
    }

    void sample(WorldRunner& runner, std::size_t index, std::uint32_t step, const PhaseTimes& times)
    {
        const StepWindow& window = m_options.windows[index];
        if (window.mayRest != m_mayRest || step < window.first || step >= window.end)
            return;
        WindowSample& sample = runner.windows[index];
        sample.steps.push_back(times);
        if (step == window.first)
            sample.firstPlaces = placesOf(runner.world->world());
        if (step + 1 != window.end)
            return;
        sample.pairs = runner.world->pairCount();
        sample.contactPairs = runner.world->contactPairCount();
        sample.stateHash = runner.world->stateHash();
        sample.quality = qualityOf(runner.world->world());
        sample.drift = meanWay(sample.firstPlaces, placesOf(runner.world->world()));
        sample.stepsToSleep = runner.stepsToSleep;
        requireExactPairs(runner);
        if (!runner.parts->isMt)
            m_states.require(promiseOf(m_options, runner, window), runner.title, sample.pairs,
                             sample.stateHash);
    }

    const WorldOptions& m_options;
    bool m_mayRest;
    std::vector<WorldRunner> m_runners;
    HashCheck m_states{"the pairs or transforms"};
};
}  // namespace

void runWorldBench(const WorldOptions& options, ResultFile& file)
{
    for (const bool mayRest : {false, true})
    {
        const auto isMine = [&](const StepWindow& window) { return window.mayRest == mayRest; };
        if (isInterrupted() || std::none_of(options.windows.begin(), options.windows.end(), isMine))
            continue;
        WorldRun run(options, mayRest);
        run.run();
        run.report(file);
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
