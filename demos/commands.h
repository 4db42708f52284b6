// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace cullet
{
/// What the chosen subcommand does; returns an ExitCode.
using Action = std::function<int()>;

// Each adds one subcommand to the program and sets `chosen` when the user asks for it.

void addRunCommand(CLI::App& program, Action& chosen);
void addBenchCommand(CLI::App& program, Action& chosen);
void addFigureCommand(CLI::App& program, Action& chosen);
void addRecordCommand(CLI::App& program, Action& chosen);
void addReplayCommand(CLI::App& program, Action& chosen);
void addVerifyCommand(CLI::App& program, Action& chosen);
void addListCommand(CLI::App& program, Action& chosen);
void addRenderCommand(CLI::App& program, Action& chosen);
}  // namespace cullet
