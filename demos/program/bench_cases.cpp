// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/program/bench_cases.h"

#include "cullet/demos/program/exit_code.h"
#include "cullet/demos/program/interrupt.h"

#include <cstdio>
#include <exception>

namespace cullet
{
namespace
{
/// @return the message of the failure; empty: none
std::string failureOf(const BenchCase& one)
{
    try
    {
        one.measure();
        return {};
    }
    catch (const std::exception& error)
    {
        return one.name + ": " + error.what();
    }
}
}  // namespace

void measureCases(const std::vector<BenchCase>& cases, const ResultFile& file)
{
    std::string failures;
    for (const BenchCase& one : cases)
    {
        if (isInterrupted())
            break;
        const std::string failure = failureOf(one);
        file.save();
        if (failure.empty())
            continue;
        std::fprintf(stderr, "%s\n", failure.c_str());
        failures += (failures.empty() ? "" : "; ") + failure;
    }
    if (!failures.empty())
        throw ProgramError(kExitDisagreement, failures);
}
}  // namespace cullet
