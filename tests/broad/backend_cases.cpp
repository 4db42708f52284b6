// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "tests/broad/backend_cases.h"

namespace cullet::test
{
const std::vector<BackendCase>& backendCases()
{
    static const std::vector<BackendCase> cases = {
        {"Brute", [] { return makeBruteForceBackend(); }},
    };
    return cases;
}
}  // namespace cullet::test
