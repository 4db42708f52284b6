// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/losses/loss_bench.h"
#include "cullet/demos/commands/command_bench.h"
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/interrupt.h"

#include <memory>

namespace cullet
{
namespace
{
Json toJson(const LossOptions& options)
{
    return {{"command", "bench losses"}, {"case", options.cases},      {"rounds", options.rounds},
            {"budget", options.budget},  {"scale", options.scale},     {"threads", options.threads},
            {"seed", options.seed},      {"precision", ownPrecision()}};
}

int benchLosses(const LossOptions& options, const FileOptions& files)
{
    requireReleaseBuild();
    ResultFile file(toJson(options), files.json, files.csv);
    printHead();
    runLossBench(options, file);
    file.save();
    return isInterrupted() ? kExitInterrupted : kExitOk;
}

std::string describeCases()
{
    std::string text = "Cases:\n";
    for (const LossCase& lossCase : lossCases())
        text += std::string("  ") + lossCase.name + ": " + lossCase.summary + "\n";
    return text;
}
}  // namespace

void addLossBench(CLI::App& bench, Action& chosen)
{
    CLI::App* command = bench.add_subcommand(
        "losses", "Cases in which cullet was slower or larger than what it replaces, each with its target");
    command->footer(describeCases() +
                    "Examples:\n"
                    "  cullet bench losses --csv losses.csv\n"
                    "  cullet bench losses --precision double --case far,planning\n"
                    "  cullet bench losses --scale 0.1 --rounds 5 --budget 5\n");
    const auto options = std::make_shared<LossOptions>();
    const auto files = std::make_shared<FileOptions>();
    command->add_option("--case", options->cases, "one or several; default: all")->delimiter(',');
    command->add_option("--rounds", options->rounds, "runs of each side")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000000));
    command
        ->add_option("--budget", options->budget,
                     "seconds after which a case gets no further round, once it has had five")
        ->capture_default_str()
        ->check(numberIn(0.0, 1e9));
    command->add_option("--scale", options->scale, "share of the bodies of each case; targets are for 1")
        ->capture_default_str()
        ->check(numberIn(1e-6, 1.0));
    command->add_option("--threads", options->threads, "of cullet; 0: all cores")
        ->capture_default_str()
        ->check(CLI::Range(0, 4096));
    command->add_option("--seed", options->seed, "of the cases")->capture_default_str()->check(notNegative());
    command->add_flag("--quiet", options->quiet, "no progress bar");
    addFileOptions(*command, *files);
    command->callback([=, &chosen] { chosen = [=] { return benchLosses(*options, *files); }; });
}
}  // namespace cullet
