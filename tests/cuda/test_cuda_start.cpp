// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Whatever fails while a backend or a finder is made: there is none, the reason is told in words, and the next attempt
// succeeds.

#include "cuda/device_pairs.h"
#include "tests/cuda/failing_calls.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <string>

namespace
{
/// Allocations of this thread before one fails; negative: none does.
thread_local int allocationsLeft = -1;
}  // namespace

// Not inline: the compiler would take free() for what does not belong to the new of others.
[[gnu::noinline]] void* operator new(std::size_t size)
{
    if (allocationsLeft >= 0 && allocationsLeft-- == 0)
        throw std::bad_alloc();
    if (void* memory = std::malloc(size != 0 ? size : 1))
        return memory;
    throw std::bad_alloc();
}

[[gnu::noinline]] void operator delete(void* memory) noexcept
{
    std::free(memory);
}

[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept
{
    std::free(memory);
}

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

TEST_P(CudaStart, AnyCallMayFail)
{
    for (const CudaFault fault : {CudaFault::OutOfMemory, CudaFault::DeviceLost})
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

TEST_P(CudaStart, AnyAllocationMayFail)
{
    int allocation = 0;
    bool hasFailed = true;
    for (; hasFailed; ++allocation)
    {
        SCOPED_TRACE("allocation " + std::to_string(allocation));
        std::string why;
        allocationsLeft = allocation;
        bool isMade = false;
        EXPECT_NO_THROW(isMade = GetParam()(0, &why));
        hasFailed = allocationsLeft < 0;
        allocationsLeft = -1;
        EXPECT_EQ(isMade, !hasFailed) << why;
        EXPECT_EQ(isMade, why.empty()) << why;
    }
    EXPECT_GT(allocation, 1);
}

TEST_P(CudaStart, ADeviceThatIsNotThereIsToldByItsNumber)
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
