// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/compounds/compound_bench.h"
#include "cullet/demos/commands/command_bench.h"
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/interrupt.h"

#include <memory>
#include <string>
#include <vector>

namespace cullet
{
namespace
{
struct CompoundCommand
{
    CompoundBenchOptions options;
    FileOptions files;
};

int benchCompounds(const CompoundCommand& command)
{
    const CompoundBenchOptions& options = command.options;
    requireReleaseBuild();
    ResultFile file({{"command", "bench compounds"},
                     {"child", options.children},
                     {"other", options.others},
                     {"motion", options.motions},
                     {"children", options.counts},
                     {"narrow", options.narrow},
                     {"rounds", options.rounds},
                     {"seed", options.seed},
                     {"precision", ownPrecision()}},
                    command.files.json, command.files.csv);
    printHead();
    runCompoundBench(options, file);
    file.save();
    return isInterrupted() ? kExitInterrupted : kExitOk;
}
}  // namespace

void addCompoundBench(CLI::App& bench, Action& chosen)
{
    CLI::App* command = bench.add_subcommand(
        "compounds", "Compounds on other shapes: the dispatch of the same poses, per body");
    command->footer(
        "Example:\n"
        "  cullet bench compounds --child hull16 --other compound,mesh --motion rest --children 8,64\n");
    const auto options = std::make_shared<CompoundCommand>();
    CompoundBenchOptions& compounds = options->options;
    addList(*command, "--child", compounds.children, "shapes of the children, one or several",
            compoundChildNames());
    addList(*command, "--other", compounds.others, "what bodies meet, one or several", compoundOtherNames());
    addList(*command, "--motion", compounds.motions, "one or several", compoundMotionNames());
    addList(*command, "--narrow", compounds.narrow, "narrow phases; others are compared with the first",
            narrowPhaseNames());
    command->add_option("--children", compounds.counts, "of a body, one or several numbers")
        ->delimiter(',')
        ->capture_default_str()
        ->check(CLI::Range(2, 10000));
    command->add_option("--rounds", compounds.rounds, "measured rounds of all poses")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000000));
    command->add_option("--seed", compounds.seed, "of the places")
        ->capture_default_str()
        ->check(notNegative());
    command->add_flag("--quiet", compounds.quiet, "no progress bar");
    addFileOptions(*command, options->files);
    command->callback([options, &chosen] { chosen = [options] { return benchCompounds(*options); }; });
}
}  // namespace cullet
