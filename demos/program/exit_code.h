// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <stdexcept>
#include <string>

namespace cullet
{
/// Exit codes of the program `cullet`.
enum ExitCode : int
{
    kExitOk = 0,
    kExitDisagreement = 1,  ///< two broad phases found different pairs, or a check of the result failed
    kExitUsage = 2,         ///< unknown option or name, or a value out of range
    kExitInput = 3,         ///< a mesh, world or recording file is missing, broken or useless
    kExitOutput = 4,        ///< a file cannot be written
    kExitUnavailable =
        5,  ///< no such device, no timings from a debug build, or no program of the other precision
    kExitInterrupted = 130  ///< Ctrl-C; the results so far were printed and written
};

inline constexpr const char* kExitCodeHelp =
    "Exit codes: 0 ok, 1 the pairs disagree, 2 usage, 3 input file, 4 output file, 5 not available here, "
    "130 interrupted (what was measured is printed)";

/// An error that ends the program: a one-line message and the exit code.
class ProgramError : public std::runtime_error
{
public:
    ProgramError(ExitCode code, const std::string& message) : std::runtime_error(message), m_code(code) {}
    ExitCode code() const noexcept { return m_code; }

private:
    ExitCode m_code;
};
}  // namespace cullet
