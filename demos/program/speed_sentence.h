// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <cstdint>
#include <string>

namespace cullet
{
/// "A step takes 18 ms instead of 68: 3.8 times as fast", "1.3 times as long" or "as long, within 5 %"; empty if one of
/// the times is not positive.
///
/// Two significant digits, and up to four where the two times would look equal.
std::string compareSteps(double milliseconds, double insteadOf);

/// "1 body", "2 bodies".
std::string countOf(std::uint64_t count, const char* one, const char* many);
}  // namespace cullet
