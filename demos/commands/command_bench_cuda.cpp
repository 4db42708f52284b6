// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/cuda/cuda_bench.h"
#include "cullet/demos/commands/command_bench.h"
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/interrupt.h"

#include <memory>

namespace cullet
{
namespace
{
int benchCuda(const CudaBenchOptions& options, const FileOptions& files)
{
    requireReleaseBuild();
    ResultFile file({{"command", "bench cuda"},
                     {"quick", options.quick},
                     {"pairs_only", options.pairsOnly},
                     {"rows_only", options.rowsOnly},
                     {"sweep", options.sweep},
                     {"crossover", options.crossover},
                     {"orders", options.orders},
                     {"only", options.only}},
                    files.json, files.csv);
    printHead();
    try
    {
        runCudaBench(options, file);
    }
    catch (const ProgramError&)
    {
        file.save();
        throw;
    }
    file.save();
    return isInterrupted() ? kExitInterrupted : kExitOk;
}
}  // namespace

void addCudaBench(CLI::App& bench, Action& chosen)
{
    CLI::App* command = bench.add_subcommand(
        "cuda", "The CUDA backend, its variants and stages, on a machine with an NVIDIA GPU");
    command->footer(
        "Examples:\n"
        "  cullet bench cuda --csv cuda.csv\n"
        "  cullet bench cuda --only W1-65536 --rows-only\n"
        "  cullet bench cuda --crossover --csv crossover.csv\n"
        "  cullet bench cuda --orders --csv cuda_orders.csv\n");
    const auto options = std::make_shared<CudaBenchOptions>();
    const auto files = std::make_shared<FileOptions>();
    command->add_flag("--quick", options->quick, "fewer frames");
    command->add_flag("--pairs-only", options->pairsOnly, "no update() with boxes of the CPU");
    command->add_flag("--rows-only", options->rowsOnly, "no other variants");
    command->add_flag("--sweep", options->sweep, "widths of cells and lengths of bins too");
    command->add_flag("--crossover", options->crossover, "update() on small worlds instead, beside the grid");
    command->add_flag("--orders", options->orders,
                      "every order of the fast search beside what it chooses, 16k to 1M bodies, instead");
    command->add_option("--only", options->only, "scenes whose name, as W1-65536, contains this");
    addFileOptions(*command, *files);
    command->callback([=, &chosen] { chosen = [=] { return benchCuda(*options, *files); }; });
}
}  // namespace cullet
