// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Skips every test where no CUDA device answers, or, with CULLET_REQUIRE_GPU=1 in the environment, fails instead: a
// machine that promises a GPU must not be green because nothing ran.

#include "cuda/cuda_device.h"

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
        if (cullet::cudaDeviceUsable(&why))
            return;
        const char* required = std::getenv("CULLET_REQUIRE_GPU");
        if (required != nullptr && std::strcmp(required, "0") != 0)
            FAIL() << "CULLET_REQUIRE_GPU is set, but " << why;
        GTEST_SKIP() << why;
    }
};
}  // namespace

int main(int argc, char** argv)
{
    testing::InitGoogleTest(&argc, argv);
    testing::AddGlobalTestEnvironment(new NeedsDevice);
    return RUN_ALL_TESTS();
}
