// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Skips every test where no CUDA device answers, or, with CULLET_REQUIRE_GPU=1 in the environment, fails instead: on a
// machine with a GPU, skipped tests must not count as passed.

#include "cullet/cuda/runtime/cuda_device.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

namespace
{
class NeedsDevice final : public testing::Environment
{
public:
    void SetUp() override
    {
        std::string why;
        if (!cullet::cudaDeviceUsable(&why))
            GTEST_SKIP() << why;
    }
};

bool isDeviceRequired()
{
    const char* required = std::getenv("CULLET_REQUIRE_GPU");
    return required != nullptr && std::strcmp(required, "0") != 0;
}
}  // namespace

int main(int argc, char** argv)
{
    testing::InitGoogleTest(&argc, argv);
    std::string why;
    // Runs before any test, since ctest reports a test that GoogleTest skips as skipped for any exit status.
    if (isDeviceRequired() && !GTEST_FLAG_GET(list_tests) && !cullet::cudaDeviceUsable(&why))
    {
        std::fprintf(stderr, "CULLET_REQUIRE_GPU is set, but %s\n", why.c_str());
        return EXIT_FAILURE;
    }
    testing::AddGlobalTestEnvironment(new NeedsDevice);
    return RUN_ALL_TESTS();
}
