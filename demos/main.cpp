// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "demos/commands.h"
#include "demos/program/exit_code.h"
#include "demos/program/interrupt.h"
#include "demos/program/precision.h"

#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{
/// Ends the help of a command and of its own commands with the exit codes.
void explainExitCodes(CLI::App& command)
{
    const std::string footer = command.get_footer();
    command.footer(footer + (footer.empty() || footer.back() == '\n' ? "" : "\n") + cullet::kExitCodeHelp);
    for (CLI::App* inner : command.get_subcommands(nullptr))
        explainExitCodes(*inner);
}

/// Throws for a command that there is not, listing those that there are; CLI11 would only say that one is missing.
void requireKnownCommand(const CLI::App& app, int argc, char** argv, int at)
{
    const std::vector<const CLI::App*> known = app.get_subcommands(nullptr);
    if (known.empty() || at >= argc || argv[at][0] == '-')
        return;
    std::string names;
    for (const CLI::App* command : known)
    {
        if (command->check_name(argv[at]))
            return requireKnownCommand(*command, argc, argv, at + 1);
        names += (names.empty() ? "" : ", ") + command->get_name();
    }
    throw cullet::ProgramError(cullet::kExitUsage,
                               "unknown command '" + std::string(argv[at]) + "'; known: " + names);
}

int parseAndRun(int argc, char** argv)
{
    cullet::switchPrecision(argc, argv);
    CLI::App program("cullet: broad phase for Bullet, against Bullet's own", "cullet");
    program.require_subcommand(1);
    program.footer(
        "Examples:\n"
        "  cullet list\n"
        "  cullet run --scene domino\n"
        "  cullet COMMAND --help\n");
    program.fallthrough();
    cullet::Action chosen;
    cullet::addRunCommand(program, chosen);
    cullet::addBenchCommand(program, chosen);
    cullet::addFigureCommand(program, chosen);
    cullet::addRecordCommand(program, chosen);
    cullet::addReplayCommand(program, chosen);
    cullet::addVerifyCommand(program, chosen);
    cullet::addListCommand(program, chosen);
    cullet::addRenderCommand(program, chosen);
    explainExitCodes(program);
    requireKnownCommand(program, argc, argv, 1);
    try
    {
        program.parse(argc, argv);
    }
    catch (const CLI::ParseError& error)
    {
        return program.exit(error) == 0 ? cullet::kExitOk : cullet::kExitUsage;
    }
    cullet::catchInterrupts();
    return chosen();
}
}  // namespace

int main(int argc, char** argv)
{
    try
    {
        return parseAndRun(argc, argv);
    }
    catch (const cullet::ProgramError& error)
    {
        std::fprintf(stderr, "cullet: %s\n", error.what());
        return error.code();
    }
    catch (const std::invalid_argument& error)
    {
        std::fprintf(stderr, "cullet: %s\n", error.what());
        return cullet::kExitUsage;
    }
    catch (const std::exception& error)
    {
        std::fprintf(stderr, "cullet: %s\n", error.what());
        return cullet::kExitUnavailable;
    }
}
