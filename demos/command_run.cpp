// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "demos/commands.h"
#include "demos/drop/drop_report.h"
#include "demos/program/exit_code.h"
#include "demos/program/machine.h"
#include "demos/scene_arguments.h"

#include <cstdio>
#include <memory>

namespace cullet
{
namespace
{
struct RunOptions
{
    DropOptions drop;
    SceneArguments scene;
    std::string json;
    std::string csv;
    std::string trace;
};

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
            {"narrow", drop.world.narrow},
            {"threads", drop.world.threads},
            {"precision", ownPrecision()},
            {"check", drop.auditEvery},
            {"mesh", options.scene.meshes},
            {"file", drop.world.file}};
}

int runCommand(RunOptions options)
{
    requireWorldScene(options.scene.scene);
    requireWritable(options.json);
    requireWritable(options.csv);
    std::printf("%s\ncommit %s\n", toLine(describeMachine()).c_str(), builtCommit());
    if (isDebugBuild())
        std::puts("note: this is a debug build; its times mean nothing");
    options.drop.scene = options.scene.scene;
    options.drop.world = resolveScene(options.scene);
    std::fflush(stdout);
    ResultFile file(toJson(options), options.json, options.csv);
    std::optional<TraceFile> trace;
    options.drop.trace = openTrace(trace, options.trace);
    const DropResult result = runDrop(options.drop);
    printReport(options.drop, result);
    addRows(options.drop, result, file);
    file.save();
    closeTrace(trace);
    if (!result.audits.agrees())
        return kExitDisagreement;
    return result.interrupted ? kExitInterrupted : kExitOk;
}
}  // namespace

void addRunCommand(CLI::App& program, Action& chosen)
{
    CLI::App* command = program.add_subcommand(
        "run", "Step a scene in two worlds, cullet's and DBVT's, and print times and pairs side by side");
    command->footer(
        "Examples:\n"
        "  cullet run                                 meshes, boxes and spheres fall\n"
        "  cullet run --scene domino --steps 600 --backend grid\n"
        "  cullet run --mesh teapot.obj --bodies 1000 --json result.json\n");
    const auto options = std::make_shared<RunOptions>();
    DropOptions& drop = options->drop;
    addSceneArguments(*command, options->scene);
    addPhaseArguments(*command, options->scene);
    command->add_option("--steps", drop.steps, "steps of each world")
        ->capture_default_str()
        ->check(CLI::Range(1, 100000000));
    command->add_option("--check", drop.auditEvery, "steps between two comparisons of the pairs; 0: none")
        ->capture_default_str()
        ->check(notNegative());
    command->add_option("--trace", options->trace,
                        "write every phase of every step to this file, for Perfetto");
    command->add_option("--json", options->json, "write results to this file");
    command->add_option("--csv", options->csv, "write results to this file");
    command->add_flag("--quiet", drop.quiet, "no progress bar");
    command->callback([options, &chosen] { chosen = [options] { return runCommand(*options); }; });
}
}  // namespace cullet
