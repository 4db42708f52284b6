// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace cullet
{
/// A number from `low` to `high`. CLI::Range accepts NaN, and is for whole numbers.
inline CLI::Validator numberIn(double low, double high)
{
    const auto check = [low, high](const std::string& text)
    {
        double value = 0.0;
        if (CLI::detail::lexical_cast(text, value) && value >= low && value <= high)
            return std::string();
        return "Value " + text + " not in range " + CLI::detail::to_string(low) + " to " +
               CLI::detail::to_string(high);
    };
    return CLI::Validator(check, "");
}

/// Whole numbers without a sign; CLI11 would convert -1 to a large number.
inline CLI::Validator notNegative()
{
    const auto check = [](const std::string& text)
    { return text.rfind('-', 0) == 0 ? "Value " + text + " is negative" : std::string(); };
    return CLI::Validator(check, "");
}
}  // namespace cullet
