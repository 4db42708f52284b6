// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <string>

namespace cullet
{
/// Description of the machine, on which timings depend.
struct Machine
{
    std::string cpu;
    std::string instructions;  ///< widest that cullet's kernels use here: AVX-512, AVX2 or baseline
    int cores = 0;             ///< logical ones that this process may use
    double memoryGib = 0.0;
    std::string gpu;  ///< model, or empty when the NVIDIA driver shows none
    std::string system;
    std::string compiler;
    std::string buildType;
};

Machine describeMachine();

/// The description in one line.
std::string toLine(const Machine& machine);

/// Git commit of the built sources, with the suffix "-dirty" if tracked files differed from it; "unknown" outside a git
/// checkout.
const char* builtCommit() noexcept;

/// True with assertions compiled in, which makes timings meaningless.
bool isDebugBuild() noexcept;
}  // namespace cullet
