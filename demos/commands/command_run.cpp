// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/commands/argument_checks.h"
#include "cullet/demos/commands/commands.h"
#include "cullet/demos/commands/scene_arguments.h"
#include "cullet/demos/drop/drop_report.h"
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/machine.h"

#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>

namespace cullet
{
namespace
{
struct RunOptions
{
    DropOptions drop;
    SceneArguments scene;
    std::vector<std::string> parts;
    std::optional<std::uint32_t> check;
    std::string json;
    std::string csv;
    std::string trace;
};

/// Bodies up to which the pairs of every step are compared with the exact ones by default: that takes about as long as
/// a broad phase.
constexpr std::uint32_t kCheckEveryStep = 16384;

std::vector<std::string> namesOf(const std::vector<DropPart>& parts)
{
    std::vector<std::string> names;
    for (const DropPart part : parts)
        names.push_back(nameOf(part));
    return names;
}

/// The columns: the requested ones, else all that differ from their predecessor.
std::vector<DropPart> chooseParts(const RunOptions& options)
{
    const bool fixed = options.drop.fixedNarrow;
    std::vector<std::string> names = options.parts;
    if (names.empty())
        names = fixed ? std::vector<std::string>{"stock", "broadphase", "world"} : dropPartNames();
    if (fixed && std::find(names.begin(), names.end(), "dispatcher") != names.end())
        throw ProgramError(kExitUsage,
                           "--narrow is the narrow phase of every column; --parts dispatcher has its own");
    return dropPartsNamed(names);
}

Json toJson(const RunOptions& options)
{
    const DropOptions& drop = options.drop;
    return {{"command", "run"},
            {"scene", drop.scene},
            {"bodies", drop.world.bodies},
            {"steps", drop.steps},
            {"seed", drop.world.seed},
            {"dt", options.scene.dt},
            {"backend", drop.world.backend},
            {"narrow", drop.fixedNarrow ? drop.world.narrow : "by part"},
            {"parts", namesOf(drop.parts)},
            {"threads", drop.world.threads},
            {"precision", ownPrecision()},
            {"check", drop.auditEvery},
            {"mesh", options.scene.meshes},
            {"file", drop.world.file}};
}

int runCommand(RunOptions options)
{
    requireWorldScene(options.scene.scene);
    options.drop.parts = chooseParts(options);
    requireWritable(options.json);
    requireWritable(options.csv);
    std::printf("%s\ncommit %s\n", toLine(describeMachine()).c_str(), builtCommit());
    if (isDebugBuild())
        std::puts("note: this is a debug build; its times mean nothing");
    options.drop.scene = options.scene.scene;
    options.drop.world = resolveScene(options.scene);
    options.drop.auditEvery = options.check.value_or(options.drop.world.bodies > kCheckEveryStep ? 20 : 1);
    std::fflush(stdout);
    ResultFile file(toJson(options), options.json, options.csv);
    std::optional<TraceFile> trace;
    options.drop.trace = openTrace(trace, options.trace);
    const DropResult result = runDrop(options.drop);
    printReport(options.drop, result);
    addRows(options.drop, result, file);
    file.save();
    closeTrace(trace);
    if (!result.agrees())
        return kExitDisagreement;
    return result.interrupted ? kExitInterrupted : kExitOk;
}
}  // namespace

void addRunCommand(CLI::App& program, Action& chosen)
{
    CLI::App* command = program.add_subcommand(
        "run", "Step a scene in worlds with more and more of cullet, and print times and pairs side by side");
    command->footer(
        "Examples:\n"
        "  cullet run                                 meshes, boxes and spheres fall\n"
        "  cullet run --parts stock,world             Bullet as it is, and with all of cullet\n"
        "  cullet run --scene domino --steps 600 --backend grid\n"
        "  cullet run --mesh teapot.obj --bodies 1000 --json result.json\n");
    const auto options = std::make_shared<RunOptions>();
    DropOptions& drop = options->drop;
    addSceneArguments(*command, options->scene);
    addThreadsArgument(*command, options->scene);
    addPhaseArguments(*command, options->scene);
    CLI::Option* narrow = command->get_option("--narrow");
    narrow->description("narrow phase of every column; default: as --parts says")->default_str("");
    command
        ->add_option("--parts", options->parts,
                     "columns, each with what those before it have; stock: Bullet's own with DBVT")
        ->delimiter(',')
        ->default_str("stock,broadphase,dispatcher,world")
        ->check(CLI::IsMember(dropPartNames()));
    command->add_option("--steps", drop.steps, "steps of each world")
        ->capture_default_str()
        ->check(CLI::Range(1, 100000000));
    command
        ->add_option("--check", options->check,
                     "steps between two comparisons of the pairs; 0: none; default: 1, above " +
                         std::to_string(kCheckEveryStep) + " bodies 20")
        ->check(notNegative());
    command->add_option("--trace", options->trace,
                        "write every phase of every step to this file, for Perfetto");
    command->add_option("--json", options->json, "write results to this file");
    command->add_option("--csv", options->csv, "write results to this file");
    command->add_flag("--quiet", drop.quiet, "no progress bar");
    command->callback(
        [options, narrow, &chosen]
        {
            options->drop.fixedNarrow = narrow->count() > 0;
            chosen = [options] { return runCommand(*options); };
        });
}
}  // namespace cullet
