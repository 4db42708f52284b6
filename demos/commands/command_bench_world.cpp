// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/world_bench.h"
#include "cullet/demos/commands/command_bench.h"
#include "cullet/demos/commands/scene_arguments.h"
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/interrupt.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace cullet
{
namespace
{
const std::vector<std::string> kWindowNames = {"falling", "settled", "sleeping", "all"};

/// The options of `cullet bench world` before parsing.
struct WorldCommand
{
    SceneArguments scene;
    WorldOptions options;
    std::vector<std::string> parts;  ///< empty: backends, narrow and updates say it
    std::vector<std::string> backends, narrow = {"bullet"}, updates = {"bullet"};
    std::vector<std::string> solvers = {"bullet"};
    std::vector<double> reuse = {0};
    std::uint32_t steps = 200;
    std::vector<std::string> windows = {"falling", "settled"};
    std::string falling, settled, sleeping;  ///< "FIRST:END"; empty: by the number of steps
    std::string json, csv, trace;
};

/// "20:30" as a window of steps.
StepWindow parseWindow(const std::string& name, const std::string& text)
{
    StepWindow window = {name, 0, 0};
    char colon = '\0';
    std::istringstream stream(text);
    stream >> window.first >> colon >> window.end;
    if (!stream || colon != ':' || !stream.eof() || window.first >= window.end)
        throw ProgramError(kExitUsage, "--" + name + " '" + text + "': FIRST:END with FIRST < END expected");
    return window;
}

bool has(const std::vector<std::string>& names, const std::string& name)
{
    return std::find(names.begin(), names.end(), name) != names.end();
}

std::string windowText(std::uint32_t first, std::uint32_t end)
{
    return std::to_string(first) + ":" + std::to_string(end);
}

void setWindows(WorldCommand& command)
{
    const std::uint32_t steps = command.steps;
    if (!command.sleeping.empty() && !has(command.windows, "sleeping"))
        throw ProgramError(kExitUsage, "--sleeping: 'sleeping' is not among --windows");
    if (command.falling.empty())
        command.falling = windowText(steps / 10, std::max(steps / 10 + 1, steps * 3 / 20));
    for (std::string* last : {&command.settled, &command.sleeping})
    {
        if (last->empty())
            *last = windowText(steps * 9 / 10, steps);
    }
    const std::string texts[] = {command.falling, command.settled, command.sleeping, windowText(0, steps)};
    for (std::size_t i = 0; i < kWindowNames.size(); ++i)
    {
        if (!has(command.windows, kWindowNames[i]))
            continue;
        command.options.windows.push_back(parseWindow(kWindowNames[i], texts[i]));
        command.options.windows.back().mayRest = kWindowNames[i] == "sleeping";
    }
}

void setParts(WorldCommand& command)
{
    std::vector<std::string>& backends = command.backends;
    if (!command.parts.empty())
    {
        if (backends.size() > 1)
            throw ProgramError(kExitUsage, "--parts takes one --backend: the broad phase of 'broadphase'");
        command.options.parts = partsNamed(command.parts, backends.empty() ? "auto" : backends.front());
        return;
    }
    if (backends.empty())
        backends = {"auto", "dbvt"};
    command.options.parts = allCombinations(backends, command.narrow, command.updates);
}

/// The scenes of a comma-separated list; "whole-step" stands for those that docs/results.md compares.
std::vector<std::string> scenesOf(const std::string& list)
{
    const std::string known =
        list != "whole-step" ? list : "boxes,hulls,free-hulls,pyramid,wall,ragdolls,terrain,statics";
    std::vector<std::string> scenes;
    std::istringstream stream(known);
    for (std::string scene; std::getline(stream, scene, ',');)
        scenes.push_back(requireWorldScene(scene).name);
    return scenes;
}

Json toJson(const WorldCommand& command)
{
    const WorldSceneOptions& world = command.scene.world;
    return {{"command", "bench world"},
            {"scene", command.scene.scene},
            {"bodies", world.bodies},
            {"steps", command.steps},
            {"windows", command.windows},
            {"falling", command.falling},
            {"settled", command.settled},
            {"sleeping", command.sleeping},
            {"parts", command.parts},
            {"backend", command.backends},
            {"narrow", command.narrow},
            {"update", command.updates},
            {"solver", command.solvers},
            {"reuse", command.reuse},
            {"prepare", command.scene.world.prepares},
            {"threads", command.options.threads},
            {"seed", world.seed},
            {"dt", command.scene.dt},
            {"mesh", command.scene.meshes},
            {"file", world.file},
            {"hull_points", world.hullPoints},
            {"precision", ownPrecision()}};
}

void runScenes(const WorldCommand& command, const std::vector<std::string>& scenes, ResultFile& file)
{
    WorldOptions options = command.options;
    SceneArguments arguments = command.scene;
    for (const std::string& scene : scenes)
    {
        if (isInterrupted())
            return;
        options.scene = arguments.scene = scene;
        options.world = resolveScene(arguments);
        runWorldBench(options, file);
        file.save();
    }
}

int benchWorld(WorldCommand command)
{
    requireReleaseBuild();
    const std::vector<std::string> scenes = scenesOf(command.scene.scene);
    setWindows(command);
    setParts(command);
    command.options.parts = withReuse(withSolvers(command.options.parts, command.solvers), command.reuse);
    ResultFile file(toJson(command), command.json, command.csv);
    std::optional<TraceFile> trace;
    command.options.trace = openTrace(trace, command.trace);
    printHead();
    runScenes(command, scenes, file);
    closeTrace(trace);
    return isInterrupted() ? kExitInterrupted : kExitOk;
}

void addPartOptions(CLI::App& command, WorldCommand& options)
{
    CLI::Option* parts =
        command
            .add_option(
                "--parts", options.parts,
                "one or several worlds: stock Bullet; cullet's broadphase, dispatcher or world alone, or "
                "joined by +; all of cullet; mt: Bullet's btDiscreteDynamicsWorldMt")
            ->delimiter(',');
    command
        .add_option("--backend", options.backends,
                    "one or several broad phases ('cullet list'); default auto,dbvt; with --parts: "
                    "that of 'broadphase', default auto")
        ->delimiter(',');
    command.add_option("--narrow", options.narrow, "one or several narrow phases")
        ->delimiter(',')
        ->capture_default_str()
        ->check(CLI::IsMember(narrowPhaseNames()))
        ->excludes(parts);
    command.add_option("--update", options.updates, "of the boxes, one or both")
        ->delimiter(',')
        ->capture_default_str()
        ->check(CLI::IsMember(boxUpdateNames()))
        ->excludes(parts);
    command.add_option("--solver", options.solvers, "of constraints, one or several; each with each world")
        ->delimiter(',')
        ->capture_default_str()
        ->check(CLI::IsMember(solverNames()));
    command
        .add_option("--reuse", options.reuse,
                    "metres that a pair may move until its contacts are computed again, one or several; each "
                    "with each world whose narrow phase is cullet's; 0: none")
        ->delimiter(',')
        ->capture_default_str()
        ->check(CLI::Range(0.0, 1.0));
    command.add_flag("--prepare", options.scene.world.prepares,
                     "declare meshes constant, so that their triangles are not read to keep contacts");
    command.add_option("--threads", options.options.threads, "one or several numbers; 0: all cores")
        ->delimiter(',')
        ->capture_default_str()
        ->check(CLI::Range(0, 4096));
}

void addWindowOptions(CLI::App& command, WorldCommand& options)
{
    command.add_option("--steps", options.steps, "steps of each world")
        ->capture_default_str()
        ->check(CLI::Range(10, 100000000));
    command
        .add_option("--windows", options.windows,
                    "what is measured; sleeping: worlds whose bodies may fall asleep; all: every step")
        ->delimiter(',')
        ->capture_default_str()
        ->check(CLI::IsMember(kWindowNames));
    command.add_option("--falling", options.falling,
                       "steps FIRST:END that count as falling; default: the third twentieth");
    command.add_option("--settled", options.settled,
                       "steps FIRST:END that count as settled; default: the last tenth");
    command.add_option("--sleeping", options.sleeping,
                       "steps FIRST:END that count as sleeping; default: the last tenth");
}
}  // namespace

void addWorldBench(CLI::App& bench, Action& chosen)
{
    CLI::App* command = bench.add_subcommand("world", "Whole steps of a Bullet world, phase by phase");
    command->footer(
        "--scene takes several names, and whole-step for those that docs/results.md compares.\n"
        "Examples:\n"
        "  cullet bench world --scene hulls --bodies 4000 --backend grid,dbvt\n"
        "  cullet bench world --scene whole-step --parts stock,broadphase,dispatcher,world,all --threads "
        "1,2\n"
        "  cullet bench world --scene hulls --backend grid --narrow bullet,isa-gjk,dispatcher\n"
        "  cullet bench world --scene pour --steps 400 --trace pour.json\n");
    const auto options = std::make_shared<WorldCommand>();
    options->scene.scene = options->options.scene;
    addSceneArguments(*command, options->scene);
    addPartOptions(*command, *options);
    addWindowOptions(*command, *options);
    command->add_option("--hull-points", options->scene.world.hullPoints, "vertices of a hull, scene hulls")
        ->capture_default_str()
        ->check(CLI::Range(4, 10000));
    command->add_option("--trace", options->trace,
                        "write every phase of every step to this file, for Perfetto");
    command->add_option("--json", options->json, "write results to this file");
    command->add_option("--csv", options->csv, "write results to this file");
    command->add_flag("--quiet", options->options.quiet, "no progress bar");
    command->callback([options, &chosen] { chosen = [options] { return benchWorld(*options); }; });
}
}  // namespace cullet
