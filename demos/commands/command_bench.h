// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/commands/argument_checks.h"
#include "cullet/demos/commands/commands.h"
#include "cullet/demos/program/precision.h"

#include <string>
#include <vector>

// Functions shared by the subcommands of `cullet bench`.
namespace cullet
{
struct FileOptions
{
    std::string precision = ownPrecision();
    std::string json;
    std::string csv;
};

void addFileOptions(CLI::App& command, FileOptions& files);

/// An option of one or several names, separated by commas.
CLI::Option* addList(CLI::App& command, const std::string& name, std::vector<std::string>& values,
                     const std::string& help, const std::vector<std::string>& known);

/// Throws ProgramError (kExitUnavailable) in a debug build.
void requireReleaseBuild();

/// Prints the machine, the commit and the precision.
void printHead();

/// Adds `bench world`.
void addWorldBench(CLI::App& bench, Action& chosen);

/// Adds `bench mesh`.
void addMeshBench(CLI::App& bench, Action& chosen);

/// Adds `bench compounds`.
void addCompoundBench(CLI::App& bench, Action& chosen);

/// Adds `bench losses`.
void addLossBench(CLI::App& bench, Action& chosen);

/// Adds `bench narrow`.
void addNarrowBench(CLI::App& bench, Action& chosen);

/// Adds `bench cuda`.
void addCudaBench(CLI::App& bench, Action& chosen);
}  // namespace cullet
