// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/broad/conformance/psap_cases.h"

namespace cullet::test
{
namespace
{
void append(std::vector<BackendCase>& cases, const std::string& prefix, PsapExecutor executor,
            std::uint32_t seed, bool withComparators)
{
    for (BackendCase& entry : psapCases(
             prefix,
             [=](SearchOptions options)
             {
                 options.executor = executor;
                 options.seed = seed;
                 options.threads = 3;
                 return makeHostBackend(options);
             },
             withComparators))
        cases.push_back(std::move(entry));
}
}  // namespace

const std::vector<BackendCase>& backendCases()
{
    static const std::vector<BackendCase> cases = []
    {
        std::vector<BackendCase> all;
        append(all, "InOrder", PsapExecutor::InOrder, 1, false);
        append(all, "Shuffled", PsapExecutor::Shuffled, 1, true);
        append(all, "ShuffledAgain", PsapExecutor::Shuffled, 2, false);
        append(all, "Threads", PsapExecutor::Threads, 3, true);
        return all;
    }();
    return cases;
}
}  // namespace cullet::test
