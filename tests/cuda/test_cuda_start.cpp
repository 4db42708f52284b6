// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// If any call fails while a backend or a finder is created, none is returned, the reason is a readable text, and the
// next attempt succeeds.

#include "cullet/cuda/device_pairs.h"
#include "cullet/tests/cuda/support/failing_calls.h"
#include "cullet/tests/support/process/failing_new.h"

#include <gtest/gtest.h>

#include <string>

namespace cullet::test
{
namespace
{
bool makesBackend(int device, std::string* why)
{
    PsapOptions options;
    options.device = device;
    return makeCudaPsapBackend(options, why) != nullptr;
}

bool makesFinder(int device, std::string* why)
{
    PsapOptions options;
    options.device = device;
    return makeDevicePairFinder(options, nullptr, why) != nullptr;
}

bool makesDeltaFinder(int device, std::string* why)
{
    PsapOptions options;
    options.device = device;
    return makeDeviceDeltaFinder(options, nullptr, why) != nullptr;
}

using Make = bool (*)(int device, std::string* why);
class CudaStart : public testing::TestWithParam<Make>
{
};

TEST_P(CudaStart, ReportsReasonWhenAnyCallFailsAndSucceedsLater)
{
    for (const FaultInjection fault : {FaultInjection::OutOfMemory, FaultInjection::DeviceLost})
    {
        const std::uint64_t calls = failEachCall(fault,
                                                 [&](const FaultPlan& plan)
                                                 {
                                                     std::string why;
                                                     plan.begin();
                                                     const bool isMade = GetParam()(0, &why);
                                                     EXPECT_EQ(isMade, !hasCudaFaultHappened()) << why;
                                                     EXPECT_EQ(isMade, why.empty()) << why;
                                                 });
        EXPECT_GT(calls, 5u) << "the probe, and the start";
    }
    std::string why;
    EXPECT_TRUE(GetParam()(0, &why)) << why << ": a failed start must leave no trace";
}

TEST_P(CudaStart, ReportsReasonWhenAnyAllocationFails)
{
    std::uint64_t allocation = 0;
    bool hasFailed = true;
    for (; hasFailed; ++allocation)
    {
        SCOPED_TRACE("allocation " + std::to_string(allocation));
        std::string why;
        bool isMade = false;
        {
            const OneNewFails failure(allocation);
            EXPECT_NO_THROW(isMade = GetParam()(0, &why));
            hasFailed = failure.hasHappened();
        }
        EXPECT_EQ(isMade, !hasFailed) << why;
        EXPECT_EQ(isMade, why.empty()) << why;
    }
    EXPECT_GT(allocation, 1u);
}

TEST_P(CudaStart, NamesMissingDeviceByItsNumber)
{
    for (const int device : {-1, 1000})
    {
        std::string why;
        EXPECT_FALSE(GetParam()(device, &why));
        EXPECT_EQ(why.find("there is no CUDA device " + std::to_string(device)), 0u) << why;
        EXPECT_FALSE(GetParam()(device, nullptr));
    }
}

std::string nameOfMake(const testing::TestParamInfo<Make>& made)
{
    const char* const names[] = {"Backend", "PairFinder", "DeltaFinder"};
    return names[made.index];
}
INSTANTIATE_TEST_SUITE_P(Cuda, CudaStart, testing::Values(&makesBackend, &makesFinder, &makesDeltaFinder),
                         nameOfMake);
}  // namespace
}  // namespace cullet::test
