// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <filesystem>
#include <string>
#include <vector>

/// What the program asks of the operating system: system_posix.cpp, or system_windows.cpp, and nothing else of the program does.
namespace cullet
{
/// Where the file of the running program is; empty if the system does not tell.
std::filesystem::path pathOfThisProgram();

enum class ChildOutput
{
    Shown,
    Discarded
};

/// Runs a program, found as the shell finds it, and waits for its end.
///
/// @param words its name and arguments
/// @return exit code; 127 if it cannot be started, 128 and more if a signal has ended it
int runProgram(const std::vector<std::string>& words, ChildOutput output);

/// Lets another program go on with the arguments of this one, and ends with its exit code. Returns only if it cannot be
/// started, with the reason in errno.
void becomeProgram(const std::filesystem::path& program, char** arguments);

/// Calls a function at Ctrl-C (SIGINT) and at SIGTERM, which do not interrupt each other. It may call what is allowed in a
/// handler of signals.
void onInterruptSignals(void (*handler)(int));

int usableCores();
double memoryGib();
/// Name and version.
std::string nameOfSystem();
}  // namespace cullet
