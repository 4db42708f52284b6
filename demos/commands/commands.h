// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <functional>
#include <vector>

// A forward declaration, since CLI11 takes seconds to compile.
namespace CLI
{
class App;
}

namespace cullet
{
/// The action of the chosen subcommand; returns an ExitCode.
using Action = std::function<int()>;

/// Adds one subcommand to the program; sets `chosen` if the user selects it.
using AddCommand = void (*)(CLI::App& program, Action& chosen);

void addRunCommand(CLI::App& program, Action& chosen);
void addBenchCommand(CLI::App& program, Action& chosen);
void addFigureCommand(CLI::App& program, Action& chosen);
void addRecordCommand(CLI::App& program, Action& chosen);
void addReplayCommand(CLI::App& program, Action& chosen);
void addVerifyCommand(CLI::App& program, Action& chosen);
void addListCommand(CLI::App& program, Action& chosen);
void addRenderCommand(CLI::App& program, Action& chosen);

/// The body of main() of a program with these subcommands; returns an ExitCode, and writes errors to stderr.
///
/// @param examples lines of the help, each with its line break
int runCommandLine(int argc, char** argv, const std::vector<AddCommand>& commands, const char* examples);
}  // namespace cullet
