// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/mesh/mesh_bench.h"

#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/program/precision.h"
#include "cullet/demos/program/progress.h"
#include "cullet/demos/program/statistics.h"
#include "cullet/demos/scenes/meshes/mesh_quality.h"

#include <cstdio>
#include <memory>

namespace cullet
{
inline namespace CULLET_PRECISION
{
namespace
{
struct NamedMotion
{
    const char* name;
    MeshMotion motion;
    int settling;  ///< steps before the measured ones
};

constexpr NamedMotion kMotions[] = {{"rest", MeshMotion::Rest, 60},
                                    {"sliding", MeshMotion::Sliding, 20},
                                    {"falling", MeshMotion::Falling, 0}};

/// One narrow phase in one case, with the milliseconds of its steps.
struct MeshRunner
{
    std::string narrow;
    std::unique_ptr<MeshWorld> world;
    std::vector<double> narrowMs, stepMs;
};

struct MeshBenchCase
{
    const MeshBenchOptions& options;
    const NamedMotion& motion;
    MeshCase meshCase;
};

std::vector<MeshRunner> makeMeshRunners(const MeshBenchCase& c)
{
    std::vector<MeshRunner> runners;
    for (const std::string& narrow : c.options.narrow)
        runners.push_back({narrow, std::make_unique<MeshWorld>(c.meshCase, narrow), {}, {}});
    return runners;
}

void measureMeshCase(const MeshBenchCase& c, std::vector<MeshRunner>& runners)
{
    const int end = c.motion.settling + c.options.steps;
    for (int step = 0; step < end && !isInterrupted(); ++step)
    {
        for (std::size_t i = 0; i < runners.size(); ++i)
        {
            MeshRunner& runner = runners[(i + static_cast<std::size_t>(step)) % runners.size()];
            const PhaseTimes times = runner.world->step();
            if (step < c.motion.settling)
                continue;
            runner.narrowMs.push_back(times[static_cast<std::size_t>(Phase::Dispatch)]);
            double whole = 0;
            for (const double phase : times)
                whole += phase;
            runner.stepMs.push_back(whole);
        }
    }
}

Json meshRowHead(const std::string& benchmark, const std::string& mesh, const std::string& shape,
                 const std::string& narrow)
{
    return {{"benchmark", "mesh." + benchmark}, {"scene", mesh}, {"backend", narrow},
            {"precision", ownPrecision()},      {"threads", 1},  {"shape", shape}};
}

Json makeMeshRow(const MeshBenchCase& c, const MeshRunner& first, const MeshRunner& runner)
{
    const Statistics narrow = summarise(runner.narrowMs), step = summarise(runner.stepMs);
    Json row = meshRowHead(c.motion.name, c.meshCase.mesh, c.meshCase.shape, runner.narrow);
    const double bodies = c.meshCase.bodies;
    row.update({{"bodies", c.meshCase.bodies},
                {"pairs", runner.world->pairCount()},
                {"median_ms", narrow.median},
                {"p90_ms", narrow.p90},
                {"min_ms", narrow.min},
                {"hash", toHex(runner.world->stateHash())},
                {"us_per_body", 1e3 * narrow.median / bodies},
                {"first_over_this", summarise(first.narrowMs).median / narrow.median},
                {"step_us_per_body", 1e3 * step.median / bodies},
                {"first_step_over_this", summarise(first.stepMs).median / step.median},
                {"triangles_per_body", runner.world->trianglesPerBody()},
                {"steps", runner.narrowMs.size()}});
    return row;
}

void printMeshRow(const Json& row)
{
    std::printf("%-12s %-15s %-8s %-11s %10.2f %8.2f %10.2f %8.2f %9.1f\n",
                row["shape"].get<std::string>().c_str(), row["scene"].get<std::string>().c_str(),
                row["benchmark"].get<std::string>().substr(5).c_str(),
                row["backend"].get<std::string>().c_str(), row["us_per_body"].get<double>(),
                row["first_over_this"].get<double>(), row["step_us_per_body"].get<double>(),
                row["first_step_over_this"].get<double>(), row["triangles_per_body"].get<double>());
    std::fflush(stdout);
}

void runMeshCase(const MeshBenchCase& c, ResultFile& file)
{
    std::vector<MeshRunner> runners = makeMeshRunners(c);
    measureMeshCase(c, runners);
    // Interrupted while bodies settled.
    if (runners.front().narrowMs.empty())
        return;
    for (const MeshRunner& runner : runners)
    {
        Json row = makeMeshRow(c, runners.front(), runner);
        printMeshRow(row);
        file.addRow(std::move(row));
    }
}

const NamedMotion& motionNamed(const std::string& name)
{
    for (const NamedMotion& motion : kMotions)
    {
        if (name == motion.name)
            return motion;
    }
    return kMotions[0];
}

void runTrialWith(const MeshTrial& trial, const std::string& narrow, std::uint64_t seed, ResultFile& file)
{
    const MeshQuality quality = runTrial(trial, narrow, seed);
    Json row = meshRowHead("quality", trial.mesh, trial.shape, narrow);
    row.update({{"bodies", trial.bodies},
                {"trial", trialName(trial.kind)},
                {"speed", trial.speed},
                {"steps", trial.steps},
                {"jump", quality.jump.largest},
                {"mean_jump", quality.jump.mean},
                {"jumped", quality.jumped},
                {"slowdown", quality.slowdown.largest},
                {"mean_slowdown", quality.slowdown.mean},
                {"spin", quality.spin.largest},
                {"mean_spin", quality.spin.mean},
                {"fallen", quality.fallen}});
    std::printf("%-6s %-13s %-11s %5.0f %-11s %6.2f %6.2f %4d/%-3d %6.0f %% %6.0f %% %7.2f %5d\n",
                trialName(trial.kind), trial.shape.c_str(), trial.mesh.c_str(), trial.speed, narrow.c_str(),
                quality.jump.largest, quality.jump.mean, quality.jumped, trial.bodies,
                100 * quality.slowdown.largest, 100 * quality.slowdown.mean, quality.spin.largest,
                quality.fallen);
    std::fflush(stdout);
    file.addRow(std::move(row));
}
}  // namespace

std::vector<std::string> meshMotionNames()
{
    std::vector<std::string> names;
    for (const NamedMotion& motion : kMotions)
        names.emplace_back(motion.name);
    return names;
}

void runMeshBench(const MeshBenchOptions& options, ResultFile& file)
{
    std::printf("%-12s %-15s %-8s %-11s %10s %8s %10s %8s %9s\n", "shape", "mesh", "motion", "narrow",
                "us/body", "x first", "step us", "x first", "triangles");
    Progress progress("mesh", options.shapes.size() * options.meshes.size() * options.motions.size(),
                      options.quiet);
    for (const std::string& shape : options.shapes)
    {
        for (const std::string& mesh : options.meshes)
        {
            for (const std::string& motion : options.motions)
            {
                if (isInterrupted())
                    return;
                MeshBenchCase c = {options, motionNamed(motion), {}};
                c.meshCase.shape = shape;
                c.meshCase.mesh = mesh;
                c.meshCase.motion = c.motion.motion;
                c.meshCase.bodies = options.bodies;
                c.meshCase.seed = options.seed;
                runMeshCase(c, file);
                progress.advance();
            }
        }
    }
}

void runMeshQuality(const MeshBenchOptions& options, ResultFile& file)
{
    std::printf("%-6s %-13s %-11s %5s %-11s %6s %6s %8s %8s %8s %7s %5s\n", "trial", "shape", "mesh", "m/s",
                "narrow", "jump", "mean", "jumped", "slowdown", "mean", "spin", "fell");
    Progress progress("quality", meshTrials().size(), options.quiet);
    for (const MeshTrial& trial : meshTrials())
    {
        for (const std::string& narrow : options.narrow)
        {
            if (isInterrupted())
                return;
            runTrialWith(trial, narrow, options.seed, file);
        }
        progress.advance();
    }
}
}  // namespace CULLET_PRECISION
}  // namespace cullet
