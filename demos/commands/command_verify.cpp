// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/commands/command_bench.h"
#include "cullet/demos/commands/commands.h"
#include "cullet/demos/commands/replay_arguments.h"
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/recording/replay.h"

#include <cstdio>
#include <memory>

namespace cullet
{
namespace
{
int verifyCommand(const ReplayOptions& options, const FileOptions& files)
{
    ResultFile file(toJson("verify", options), files.json, files.csv);
    printHead();
    RecordingFile recording(options.path);
    const RecordingSummary summary = recording.summarise();
    printSummary(options.path, summary);
    const auto players = makePlayers(options.backends, options.threads, summary);
    std::optional<TraceFile> trace;
    const ReplayResult result = runVerify(options, recording, players, file, openTrace(trace, options.trace));
    file.save();
    closeTrace(trace);
    if (!result.difference.empty())
    {
        std::printf("%s\n", result.difference.c_str());
        return kExitDisagreement;
    }
    std::printf("%llu frames%s: the same pairs in each, hash %s\n",
                static_cast<unsigned long long>(result.frames), isInterrupted() ? " (interrupted)" : "",
                file.rows().front()["hash"].get<std::string>().c_str());
    return isInterrupted() ? kExitInterrupted : kExitOk;
}
}  // namespace

void addVerifyCommand(CLI::App& program, Action& chosen)
{
    CLI::App* command =
        program.add_subcommand("verify", "Compare the pairs of broad phases on a recording, frame by frame");
    command->footer(
        "Compared are the pairs whose boxes overlap and whose filter words agree; a margin may keep more.\n"
        "'exact' is the referee: a sort and sweep of its own. Exit code 1 at the first difference, which is "
        "printed with its frame, pair and boxes.\n"
        "Examples:\n"
        "  cullet verify pour.cbx\n"
        "  cullet verify pour.cbx --backend dbvt,cuda --precision double\n");
    const auto options = std::make_shared<ReplayOptions>();
    const auto files = std::make_shared<FileOptions>();
    options->backends = {"exact", "grid", "dbvt"};
    addReplayArguments(*command, *options);
    addFileOptions(*command, *files);
    command->callback([=, &chosen] { chosen = [=] { return verifyCommand(*options, *files); }; });
}
}  // namespace cullet
