// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/narrow/device_bench.h"
#include "cullet/demos/bench/narrow/narrow_bench.h"
#include "cullet/demos/commands/command_bench.h"
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/interrupt.h"

#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace cullet
{
namespace
{
/// Removes the libraries that this program was built without, with a message.
///
/// @throws ProgramError (kExitUnavailable) if none remains
void removeMissing(std::vector<std::string>& algorithms)
{
    std::string missing;
    for (const NarrowSubjectInfo& info : narrowSubjects())
    {
        const auto kept = std::remove(algorithms.begin(), algorithms.end(),
                                      info.make == nullptr ? std::string(info.name) : std::string());
        if (kept == algorithms.end())
            continue;
        algorithms.erase(kept, algorithms.end());
        missing += (missing.empty() ? "" : "; ") + std::string(info.name) + ": " + info.summary;
    }
    if (algorithms.empty())
        throw ProgramError(kExitUnavailable, missing);
    if (!missing.empty())
        std::fprintf(stderr, "left out: %s\n", missing.c_str());
}

int benchNarrow(NarrowOptions options, const FileOptions& files)
{
    requireReleaseBuild();
    removeMissing(options.algorithms);
    ResultFile file({{"command", "bench narrow"},
                     {"shape", options.shapes},
                     {"regime", options.regimes},
                     {"query", options.queries},
                     {"algorithm", options.algorithms},
                     {"temperature", options.temperatures},
                     {"support", options.supports},
                     {"repetitions", options.repetitions},
                     {"seed", options.seed},
                     {"precision", ownPrecision()}},
                    files.json, files.csv);
    printHead();
    runNarrowBench(options, file);
    file.save();
    return isInterrupted() ? kExitInterrupted : kExitOk;
}

int benchOnDevice(const DeviceNarrowOptions& options, const FileOptions& files)
{
    requireReleaseBuild();
    ResultFile file({{"command", "bench narrow --device"},
                     {"most_pairs", options.mostPairs},
                     {"repetitions", options.repetitions},
                     {"seed", options.seed}},
                    files.json, files.csv);
    runDeviceNarrowBench(options, file);
    file.save();
    return isInterrupted() ? kExitInterrupted : kExitOk;
}
}  // namespace

void addNarrowBench(CLI::App& bench, Action& chosen)
{
    CLI::App* command =
        bench.add_subcommand("narrow", "Queries on pairs of convex hulls, against other libraries");
    command->footer(
        "Examples:\n"
        "  cullet bench narrow --shape ico42 --regime separated,near --query boolean,distance\n"
        "  cullet bench narrow --query algorithm --algorithm cullet,bullet --csv contacts.csv\n"
        "  cullet bench narrow --device --most-pairs 1000000 --csv narrow_device.csv\n");
    const auto options = std::make_shared<NarrowOptions>();
    const auto files = std::make_shared<FileOptions>();
    addList(*command, "--shape", options->shapes, "one or several", narrowShapeNames());
    addList(*command, "--regime", options->regimes, "how far apart", namesOf(narrowRegimes()));
    addList(*command, "--query", options->queries, "what is asked", narrowQueryNames());
    addList(*command, "--algorithm", options->algorithms, "libraries", namesOf(narrowSubjects()));
    addList(*command, "--temperature", options->temperatures, "with and without the memory of a pair",
            {"warm", "cold"});
    addList(*command, "--support", options->supports, "support search of cullet", narrowSupportNames());
    command->add_option("--repetitions", options->repetitions, "interleaved, of each case")
        ->capture_default_str()
        ->check(CLI::Range(1, 100000));
    command->add_option("--seed", options->seed, "of the trajectories")->capture_default_str();
    command->add_flag("--quiet", options->quiet, "no progress bar");
    addFileOptions(*command, *files);
    const auto device = std::make_shared<DeviceNarrowOptions>();
    const auto isOnDevice = std::make_shared<bool>(false);
    command->add_flag(
        "--device", *isOnDevice,
        "boolean queries of pairs in the memory of an NVIDIA GPU instead; other options do not count");
    command->add_option("--most-pairs", device->mostPairs, "with --device: no longer lists")
        ->capture_default_str();
    command->callback(
        [=, &chosen] {
            chosen = [=]
            { return *isOnDevice ? benchOnDevice(*device, *files) : benchNarrow(*options, *files); };
        });
}
}  // namespace cullet
