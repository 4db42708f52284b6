// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/tests/broad/conformance/psap_cases.h"

namespace cullet::test
{
const std::vector<BackendCase>& backendCases()
{
    // main() has checked that a device answers.
    static const std::vector<BackendCase> cases = psapCases("Cuda", makeCudaBackend);
    return cases;
}
}  // namespace cullet::test
