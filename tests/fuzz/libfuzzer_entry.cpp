// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// What libFuzzer calls in place of fuzz_driver.cpp.

#include "cullet/tests/fuzz/fuzz_target.h"

#include <cstdio>
#include <cstdlib>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    const std::string fault = cullet::test::runFuzzInput(data, size);
    if (!fault.empty())
    {
        std::fprintf(stderr, "%s: %s\n", cullet::test::kFuzzTargetName, fault.c_str());
        std::abort();
    }
    return 0;
}
