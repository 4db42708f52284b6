// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/commands/command_bench.h"
#include "cullet/demos/commands/commands.h"
#include "cullet/demos/commands/scene_arguments.h"
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/files/result_file.h"
#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/program/progress.h"
#include "cullet/plugin/recording_broadphase.h"

#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>

namespace cullet
{
namespace
{
struct RecordOptions
{
    SceneArguments scene;
    std::uint32_t steps = 180;
    std::string out = "scene.cbx";
    bool quiet = false;
    std::string json;
    std::string csv;
    std::string trace;
};

void requireGood(const RecordingBroadphase& recorder)
{
    if (!recorder.error().empty())
        throw ProgramError(kExitOutput, recorder.error());
}

/// Steps the scene and returns the row of the recording.
Json record(const RecordOptions& options, const WorldSceneOptions& world, TraceFile* trace)
{
    NamedBroadphase inner = makeNamedBroadphase(requestForScene(options.scene.scene, world));
    auto owned = std::make_unique<RecordingBroadphase>(*inner.broadphase, options.out);
    RecordingBroadphase& recorder = *owned;
    requireGood(recorder);
    NamedBroadphase wrapped = {inner.name, std::move(owned), inner.cullet, inner.margin, inner.threads};
    const auto scene = makeWorldScene(options.scene.scene, world, std::move(wrapped));
    scene->setTrace({trace, inner.name});
    {
        Progress progress("recording", options.steps, options.quiet);
        for (std::uint32_t step = 0; step < options.steps && !isInterrupted(); ++step)
        {
            scene->step();
            requireGood(recorder);
            progress.show(step + 1);
        }
    }
    // Finishes before the world is destroyed.
    recorder.finish();
    requireGood(recorder);
    return {{"benchmark", "record"},       {"scene", options.scene.scene},
            {"backend", inner.name},       {"precision", ownPrecision()},
            {"threads", inner.threads},    {"bodies", world.bodies},
            {"pairs", scene->pairCount()}, {"hash", toHex(scene->stateHash())},
            {"frames", recorder.frames()}, {"bytes", std::filesystem::file_size(options.out)}};
}

int recordCommand(const RecordOptions& options)
{
    requireWorldScene(options.scene.scene);
    ResultFile file({{"command", "record"},
                     {"scene", options.scene.scene},
                     {"bodies", options.scene.world.bodies},
                     {"steps", options.steps},
                     {"seed", options.scene.world.seed},
                     {"dt", options.scene.dt},
                     {"backend", options.scene.world.backend},
                     {"precision", ownPrecision()},
                     {"out", options.out}},
                    options.json, options.csv);
    printHead();
    std::optional<TraceFile> trace;
    const Json row = record(options, resolveScene(options.scene), openTrace(trace, options.trace));
    std::printf("%s: %u bodies, %llu frames, %llu bytes, state hash %s%s\n", options.out.c_str(),
                row["bodies"].get<unsigned>(), row["frames"].get<unsigned long long>(),
                row["bytes"].get<unsigned long long>(), row["hash"].get<std::string>().c_str(),
                isInterrupted() ? " (interrupted)" : "");
    file.addRow(row);
    file.save();
    closeTrace(trace);
    return isInterrupted() ? kExitInterrupted : kExitOk;
}
}  // namespace

void addRecordCommand(CLI::App& program, Action& chosen)
{
    CLI::App* command = program.add_subcommand(
        "record", "Record what the broad phase of a scene is told, for replay and verify");
    command->footer(
        "Examples:\n"
        "  cullet record --scene pour --steps 300 --out pour.cbx\n"
        "  cullet record --scene W1 --bodies 65536 --steps 20 --out w1.cbx\n"
        "A world of your own is recorded by cullet::RecordingBroadphase; docs/recording-format.md describes "
        "the "
        "file.\n");
    const auto options = std::make_shared<RecordOptions>();
    addSceneArguments(*command, options->scene);
    addThreadsArgument(*command, options->scene);
    addPhaseArguments(*command, options->scene);
    command->add_option("--steps", options->steps, "steps to record")
        ->capture_default_str()
        ->check(CLI::Range(1, 100000000));
    command->add_option("--out", options->out, "file of the recording")->capture_default_str();
    command->add_option("--trace", options->trace,
                        "write every phase of every step to this file, for Perfetto");
    command->add_option("--json", options->json, "write results to this file");
    command->add_option("--csv", options->csv, "write results to this file");
    command->add_flag("--quiet", options->quiet, "no progress bar");
    command->callback([options, &chosen] { chosen = [options] { return recordCommand(*options); }; });
}
}  // namespace cullet
