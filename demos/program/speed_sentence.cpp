// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/program/speed_sentence.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace cullet
{
namespace
{
/// `value` > 0 with so many significant digits, without an exponent; digits before the point are never cut off.
std::string withDigits(double value, int digits)
{
    const int before = static_cast<int>(std::floor(std::log10(value))) + 1;
    char text[64];
    std::snprintf(text, sizeof text, "%.*f", std::clamp(digits - before, 0, 9), value);
    return text;
}
}  // namespace

std::string compareSteps(double milliseconds, double insteadOf)
{
    if (!(milliseconds > 0.0) || !(insteadOf > 0.0))
        return "";
    int digits = 2;
    while (digits < 4 && withDigits(milliseconds, digits) == withDigits(insteadOf, digits))
        ++digits;
    const double speed = insteadOf / milliseconds;
    std::string verdict = "as long, within 5 %";
    if (speed > 1.05)
        verdict = withDigits(speed, 2) + " times as fast";
    else if (speed < 1 / 1.05)
        verdict = withDigits(1 / speed, 2) + " times as long";
    return "A step takes " + withDigits(milliseconds, digits) + " ms instead of " +
           withDigits(insteadOf, digits) + ": " + verdict;
}

std::string countOf(std::uint64_t count, const char* one, const char* many)
{
    return std::to_string(count) + " " + (count == 1 ? one : many);
}
}  // namespace cullet
