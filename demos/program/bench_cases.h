// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/program/files/result_file.h"

#include <functional>
#include <string>
#include <vector>

namespace cullet
{
/// A case of a long bench.
struct BenchCase
{
    std::string name;               ///< for the message of a failure
    std::function<void()> measure;  ///< adds its rows to the file, or throws
};

/// Measures cases one after another until the user stops them, and saves the file after each. A case that throws prints its
/// message and the others go on.
///
/// @throws ProgramError: kExitDisagreement at last, with the messages, if a case threw; kExitOutput at once
void measureCases(const std::vector<BenchCase>& cases, const ResultFile& file);
}  // namespace cullet
