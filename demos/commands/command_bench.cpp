// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/commands/command_bench.h"

#include "cullet/demos/bench/events/event_scenes.h"
#include "cullet/demos/bench/frames_bench.h"
#include "cullet/demos/bench/named_backends.h"
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/program/machine.h"
#include "cullet/demos/program/precision.h"
#include "cullet/demos/rivals/rival.h"
#include "cullet/demos/scenes/box_scene.h"

#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>

namespace cullet
{
void addFileOptions(CLI::App& command, FileOptions& files)
{
    command.add_option("--precision", files.precision, "of Bullet")
        ->capture_default_str()
        ->check(CLI::IsMember({"float", "double"}));
    command.add_option("--json", files.json, "write results to this file");
    command.add_option("--csv", files.csv, "write results to this file");
}

CLI::Option* addList(CLI::App& command, const std::string& name, std::vector<std::string>& values,
                     const std::string& help, const std::vector<std::string>& known)
{
    return command.add_option(name, values, help)
        ->delimiter(',')
        ->capture_default_str()
        ->check(CLI::IsMember(known));
}

void requireReleaseBuild()
{
    if (isDebugBuild())
        throw ProgramError(kExitUnavailable,
                           "this is a debug build, its times mean nothing; build Release or RelWithDebInfo");
}

void printHead()
{
    std::printf("%s\ncommit %s, %s precision\n", toLine(describeMachine()).c_str(), builtCommit(),
                ownPrecision().c_str());
}

namespace
{
void requireKnownScene(const std::string& name)
{
    if (findBoxScene(name) != nullptr || findEventScene(name) != nullptr)
        return;
    std::string known;
    for (const BoxSceneInfo& scene : boxScenes())
        known += std::string(scene.name) + ", ";
    for (const EventSceneInfo& scene : eventScenes())
        known += std::string(scene.name) + ", ";
    known.resize(known.size() - 2);
    throw ProgramError(kExitUsage, "unknown scene '" + name + "'; known: " + known);
}

/// Throws for an unknown backend and for one that cannot run here, before any measurement.
void requireBackends(const BroadOptions& options)
{
    const BroadCase smallest = {options, "", 1, false};
    for (const std::string& name : options.backends)
        makeSubject(requestFor(smallest, name, {{-1, -1, -1}, {1, 1, 1}}));
}

struct BroadFiles : FileOptions
{
    std::string trace;
};

Json toJson(const BroadOptions& options, bool hasBodies)
{
    return {{"command", "bench broad"},
            {"scene", options.scenes},
            {"bodies", hasBodies ? Json(options.bodies) : Json("default")},
            {"backend", options.backends},
            {"ids", options.ids},
            {"through", options.through},
            {"threads", options.threads},
            {"margin", options.margin},
            {"frames", options.frames},
            {"warmup", options.warmup},
            {"budget", options.budget},
            {"seed", options.seed},
            {"resend", options.resend},
            {"per_frame", options.perFrame},
            {"queries", options.queries},
            {"precision", ownPrecision()}};
}

void runCase(const BroadCase& benchCase, ResultFile& file)
{
    const EventSceneInfo* event = findEventScene(benchCase.scene);
    if (event != nullptr)
        event->run(benchCase, file);
    else
        runFramesBench(benchCase, file);
}

void runCases(const BroadOptions& options, bool hasBodies, ResultFile& file)
{
    for (const std::string& scene : options.scenes)
    {
        const EventSceneInfo* event = findEventScene(scene);
        const std::vector<std::uint32_t> sizes =
            event != nullptr && !hasBodies ? std::vector<std::uint32_t>{event->bodies} : options.bodies;
        for (const std::uint32_t bodies : sizes)
        {
            for (const std::string& ids : options.ids)
            {
                if (isInterrupted())
                    return;
                runCase({options, scene, bodies, ids == "sorted"}, file);
            }
        }
    }
}

/// Replaces `word` by the names that it stands for.
void expandWord(std::vector<std::string>& names, const std::string& word, const std::vector<std::string>& all)
{
    const auto found = std::find(names.begin(), names.end(), word);
    if (found == names.end())
        return;
    names.insert(names.erase(found), all.begin(), all.end());
}

void expandRivals(std::vector<std::string>& names)
{
    if (std::find(names.begin(), names.end(), "rivals") == names.end())
        return;
    expandWord(names, "rivals", builtRivals());
    for (const RivalInfo& rival : rivals())
    {
        if (rival.make == nullptr)
            std::fprintf(stderr, "cullet: without %s: install %s and build again\n", rival.name,
                         rival.package);
    }
}

int benchBroad(BroadOptions options, bool hasBodies, const BroadFiles& files)
{
    requireReleaseBuild();
    expandWord(options.backends, "ablation", ablationNames());
    expandWord(options.backends, "choices", choiceNames());
    expandRivals(options.backends);
    for (const std::string& scene : options.scenes)
        requireKnownScene(scene);
    requireBackends(options);
    ResultFile file(toJson(options, hasBodies), files.json, files.csv);
    std::optional<TraceFile> trace;
    options.trace = openTrace(trace, files.trace);
    printHead();
    try
    {
        runCases(options, hasBodies, file);
    }
    catch (const ProgramError&)
    {
        file.save();
        throw;
    }
    file.save();
    closeTrace(trace);
    return isInterrupted() ? kExitInterrupted : kExitOk;
}

void addBroad(CLI::App& bench, Action& chosen)
{
    CLI::App* command =
        bench.add_subcommand("broad", "Broad phases alone, all on the same boxes ('cullet list')");
    command->footer(
        "Examples:\n"
        "  cullet bench broad --scene W1 --bodies 65536 --backend grid,dbvt\n"
        "  cullet bench broad --scene W1,W5 --bodies 4000 --backend grid,rivals --json rivals.json\n"
        "  cullet bench broad --scene W2 --bodies 16000 --backend ablation --csv ablation.csv\n");
    const auto options = std::make_shared<BroadOptions>();
    const auto files = std::make_shared<BroadFiles>();
    command->add_option("--scene", options->scenes, "one or several")->delimiter(',')->capture_default_str();
    CLI::Option* bodies = command->add_option("--bodies", options->bodies, "one or several numbers")
                              ->delimiter(',')
                              ->check(CLI::Range(1, 100000000));
    command
        ->add_option("--backend", options->backends,
                     "one or several; ablation: every CPU backend and option; "
                     "choices: the grid, and with its choices fixed; rivals: every other library")
        ->delimiter(',')
        ->capture_default_str();
    command->add_option("--ids", options->ids, "order of the ids at the start: random, sorted")
        ->delimiter(',')
        ->capture_default_str()
        ->check(CLI::IsMember({"random", "sorted"}));
    command->add_option("--through", options->through, "interface of cullet's backends: backend or bullet")
        ->capture_default_str()
        ->check(CLI::IsMember({"backend", "bullet"}));
    command->add_option("--threads", options->threads, "0: all cores")
        ->capture_default_str()
        ->check(CLI::Range(0, 4096));
    command->add_option("--margin", options->margin, "of pairs that are held, without Bullet; 0: exact pairs")
        ->capture_default_str()
        ->check(numberIn(0.0, 1e6));
    command->add_option("--frames,--steps", options->frames, "timed frames; 0: 10 or 12")
        ->check(CLI::Range(0, 1000000));
    command->add_option("--warmup", options->warmup, "frames before; default 4 or 12")
        ->check(CLI::Range(0, 1000000));
    command->add_option("--budget", options->budget, "seconds per backend and case")
        ->capture_default_str()
        ->check(numberIn(0.0, 1e9));
    command->add_option("--seed", options->seed, "of the scene")->capture_default_str()->check(notNegative());
    command->add_option("--resend", options->resend, "1: hand over unmoved boxes too")->capture_default_str();
    command->add_option("--queries", options->queries,
                        "per frame, scene 'queries'; default 1, 100 and 100,000");
    command->add_flag("--per-frame", options->perFrame, "a row for each timed frame too");
    command->add_option("--trace", files->trace,
                        "write both phases of every frame to this file, for Perfetto");
    command->add_flag("--quiet", options->quiet, "no progress bar");
    addFileOptions(*command, *files);
    command->callback([=, &chosen]
                      { chosen = [=] { return benchBroad(*options, bodies->count() > 0, *files); }; });
}
}  // namespace

void addBenchCommand(CLI::App& program, Action& chosen)
{
    CLI::App* command = program.add_subcommand("bench", "Measure against Bullet and other libraries");
    command->require_subcommand(1);
    command->footer("Example:\n  cullet bench world --scene hulls --bodies 4000 --backend grid,dbvt\n");
    addBroad(*command, chosen);
    addWorldBench(*command, chosen);
    addMeshBench(*command, chosen);
    addCompoundBench(*command, chosen);
    addNarrowBench(*command, chosen);
    addCudaBench(*command, chosen);
    addLossBench(*command, chosen);
}
}  // namespace cullet
