// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// The readable reasons for a missing CUDA backend. Needs no device.

#include "cullet/cuda/runtime/cuda_device.h"
#include "cullet/cuda/runtime/device_status.h"

#include <gtest/gtest.h>

#include <string>

namespace cullet::test
{
namespace
{
TEST(DeviceWords, ExplainMissingDriverOrDevice)
{
    EXPECT_EQ(whyNoDevice(cudaErrorInsufficientDriver, 0, 13000), "no NVIDIA driver is installed");
    EXPECT_EQ(whyNoDevice(cudaErrorInsufficientDriver, 11040, 13000),
              "the NVIDIA driver supports CUDA 11.4, this build needs CUDA 13.0");
    EXPECT_EQ(whyNoDevice(cudaErrorNoDevice, 13000, 13000),
              "no CUDA device is visible (none in the machine, or CUDA_VISIBLE_DEVICES hides it)");
    EXPECT_EQ(whyNoDevice(cudaErrorSystemNotReady, 13000, 13000).find("the CUDA runtime does not start: "),
              0u);
}

TEST(DeviceWords, ExplainWhyDeviceIsRefused)
{
    EXPECT_EQ(whyRefused(1, {61, cudaComputeModeDefault}, 75),
              "CUDA device 1 has compute capability 6.1; this build has code for 7.5 and newer");
    EXPECT_EQ(whyRefused(0, {90, cudaComputeModeProhibited}, 75),
              "CUDA device 0 is in compute mode Prohibited");
    EXPECT_EQ(whyRefused(0, {75, cudaComputeModeDefault}, 75), "");
    EXPECT_EQ(whyRefused(0, {120, cudaComputeModeExclusiveProcess}, 75), "")
        << "another process may have it, which only a start can tell";
}

TEST(DeviceWords, ExplainWhyDeviceDoesNotStart)
{
    EXPECT_EQ(whyNotStarted(2, cudaComputeModeExclusiveProcess, "cudaSetDevice: busy"),
              "CUDA device 2 does not start: cudaSetDevice: busy (its compute mode lets one process at a "
              "time use it)");
    EXPECT_EQ(whyNotStarted(0, cudaComputeModeDefault, "cudaSetDevice: busy"),
              "CUDA device 0 does not start: cudaSetDevice: busy");
}

TEST(DeviceWords, GiveReasonForEveryUnusableDevice)
{
    for (const int device : {-1, 0, 1000})
    {
        std::string why;
        if (!cudaDeviceUsable(device, &why))
            EXPECT_FALSE(why.empty()) << device;
        else
            EXPECT_EQ(device, 0);
    }
}
}  // namespace
}  // namespace cullet::test
