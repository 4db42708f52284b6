// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace cullet::test
{
/// Runs one input against the oracle of the target; each fuzz program defines its own.
///
/// Depends on nothing but the input. May end the process, which counts as a finding.
///
/// @return what is wrong, or an empty string
std::string runFuzzInput(const std::uint8_t* data, std::size_t size);

/// As in fuzz_<name>.
extern const char* const kFuzzTargetName;
}  // namespace cullet::test
