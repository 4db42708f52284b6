// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/commands/command_bench.h"
#include "cullet/demos/commands/commands.h"
#include "cullet/demos/commands/replay_arguments.h"
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/program/machine.h"
#include "cullet/demos/recording/replay.h"

#include <cstdio>
#include <memory>

namespace cullet
{
namespace
{
int replayCommand(const ReplayOptions& options, const FileOptions& files)
{
    ResultFile file(toJson("replay", options), files.json, files.csv);
    printHead();
    if (isDebugBuild())
        std::puts("note: this is a debug build; its times mean nothing");
    std::optional<TraceFile> trace;
    const ReplayResult result = runReplay(options, file, openTrace(trace, options.trace));
    file.save();
    closeTrace(trace);
    if (!result.difference.empty())
    {
        std::printf("DISAGREE: %s\n", result.difference.c_str());
        return kExitDisagreement;
    }
    std::printf("%llu frames, the same pairs in each\n", static_cast<unsigned long long>(result.frames));
    return isInterrupted() ? kExitInterrupted : kExitOk;
}
}  // namespace

void addReplayCommand(CLI::App& program, Action& chosen)
{
    CLI::App* command = program.add_subcommand("replay", "Measure broad phases on a recording, in turns");
    command->footer(
        "Examples:\n"
        "  cullet replay pour.cbx --backend grid,dbvt --threads 1\n"
        "  cullet replay pour.cbx --backend grid,psap,sap,axissweep --json replay.json\n");
    const auto options = std::make_shared<ReplayOptions>();
    const auto files = std::make_shared<FileOptions>();
    options->backends = {"grid", "dbvt"};
    addReplayArguments(*command, *options);
    addFileOptions(*command, *files);
    command->callback([=, &chosen] { chosen = [=] { return replayCommand(*options, *files); }; });
}
}  // namespace cullet
