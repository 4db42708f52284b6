// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <string>

namespace cullet
{
/// What a timing depends on, for people and for result files.
struct Machine
{
    std::string cpu;
    std::string instructions;  ///< widest that cullet's kernels find here: AVX-512, AVX2 or baseline
    int cores = 0;             ///< logical ones that this process may use
    double memoryGib = 0.0;
    std::string gpu;  ///< model, or empty when the NVIDIA driver shows none
    std::string system;
    std::string compiler;
    std::string buildType;
};

Machine describeMachine();

/// One line of text.
std::string toLine(const Machine& machine);

/// Git commit of the sources that were built; "-dirty" follows when tracked files differed from it, and it is
/// "unknown" outside a git checkout.
const char* builtCommit() noexcept;

/// True when assertions are compiled in, so that timings mean nothing.
bool isDebugBuild() noexcept;
}  // namespace cullet
