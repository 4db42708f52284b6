// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/commands/commands.h"
#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/interrupt.h"
#include "cullet/demos/program/precision.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>
#include <vector>

namespace cullet
{
namespace
{
/// Appends the exit codes to the help of a command and of its subcommands.
void explainExitCodes(CLI::App& command)
{
    const std::string footer = command.get_footer();
    command.footer(footer + (footer.empty() || footer.back() == '\n' ? "" : "\n") + kExitCodeHelp);
    for (CLI::App* inner : command.get_subcommands(nullptr))
        explainExitCodes(*inner);
}

/// Throws for an unknown command, listing the known ones; CLI11 would only report that a command is missing.
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
    throw ProgramError(kExitUsage, "unknown command '" + std::string(argv[at]) + "'; known: " + names);
}

int parseAndRun(int argc, char** argv, const std::vector<AddCommand>& commands, const char* examples)
{
    switchPrecision(argc, argv);
    CLI::App program("cullet: broad phase for Bullet, against Bullet's own", "cullet");
    program.require_subcommand(1);
    program.footer(std::string("Examples:\n") + examples + "  cullet COMMAND --help\n");
    program.fallthrough();
    Action chosen;
    for (const AddCommand add : commands)
        add(program, chosen);
    explainExitCodes(program);
    requireKnownCommand(program, argc, argv, 1);
    try
    {
        program.parse(argc, argv);
    }
    catch (const CLI::ParseError& error)
    {
        return program.exit(error) == 0 ? kExitOk : kExitUsage;
    }
    catchInterrupts();
    return chosen();
}
}  // namespace

int runCommandLine(int argc, char** argv, const std::vector<AddCommand>& commands, const char* examples)
{
    try
    {
        return parseAndRun(argc, argv, commands, examples);
    }
    catch (const ProgramError& error)
    {
        std::fprintf(stderr, "cullet: %s\n", error.what());
        return error.code();
    }
    catch (const std::invalid_argument& error)
    {
        std::fprintf(stderr, "cullet: %s\n", error.what());
        return kExitUsage;
    }
    catch (const std::exception& error)
    {
        std::fprintf(stderr, "cullet: %s\n", error.what());
        return kExitUnavailable;
    }
}
}  // namespace cullet
