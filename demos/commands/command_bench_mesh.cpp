// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/mesh/mesh_bench.h"
#include "cullet/demos/commands/command_bench.h"
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/scenes/meshes/mesh_world.h"

#include <memory>
#include <string>
#include <vector>

namespace cullet
{
namespace
{
struct MeshCommand
{
    MeshBenchOptions options;
    FileOptions files;
    bool isQuality = false;
};

int benchMesh(const MeshCommand& command)
{
    const MeshBenchOptions& options = command.options;
    requireReleaseBuild();
    ResultFile file({{"command", "bench mesh"},
                     {"quality", command.isQuality},
                     {"shape", options.shapes},
                     {"mesh", options.meshes},
                     {"motion", options.motions},
                     {"narrow", options.narrow},
                     {"bodies", options.bodies},
                     {"steps", options.steps},
                     {"seed", options.seed},
                     {"precision", ownPrecision()}},
                    command.files.json, command.files.csv);
    printHead();
    if (command.isQuality)
        runMeshQuality(options, file);
    else
        runMeshBench(options, file);
    file.save();
    return isInterrupted() ? kExitInterrupted : kExitOk;
}
}  // namespace

void addMeshBench(CLI::App& bench, Action& chosen)
{
    CLI::App* command = bench.add_subcommand("mesh", "Bodies on triangle meshes: the narrow phase per body");
    command->footer(
        "Examples:\n"
        "  cullet bench mesh --shape hull64,box --mesh 0.5m --motion rest,sliding\n"
        "  cullet bench mesh --quality --csv quality.csv\n");
    const auto options = std::make_shared<MeshCommand>();
    MeshBenchOptions& mesh = options->options;
    addList(*command, "--shape", mesh.shapes, "of the bodies, one or several", meshShapeNames());
    addList(*command, "--mesh", mesh.meshes, "one or several", meshNames());
    addList(*command, "--motion", mesh.motions, "one or several", meshMotionNames());
    addList(*command, "--narrow", mesh.narrow, "narrow phases; others are compared with the first",
            narrowPhaseNames());
    command->add_option("--bodies", mesh.bodies, "of each world")
        ->capture_default_str()
        ->check(CLI::Range(1, 200));
    command->add_option("--steps", mesh.steps, "measured steps of each world")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000000));
    command->add_option("--seed", mesh.seed, "of the places")->capture_default_str()->check(notNegative());
    command->add_flag("--quality", options->isQuality,
                      "instead of times: ghost collisions, tunnelling and spin; takes --narrow and --seed");
    command->add_flag("--quiet", mesh.quiet, "no progress bar");
    addFileOptions(*command, options->files);
    command->callback([options, &chosen] { chosen = [options] { return benchMesh(*options); }; });
}
}  // namespace cullet
