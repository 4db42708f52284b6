// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Changes between sets of boxes on the device, reported there, against brute force.

#include "cullet/cuda/device_pairs.h"
#include "cullet/cuda/runtime/device_buffer.h"
#include "cullet/tests/cuda/support/failing_calls.h"
#include "cullet/tests/support/delta_oracle.h"

#include <cuda_runtime_api.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

namespace cullet::test
{
namespace
{
template <class T>
std::vector<T> fetch(const T* from, std::uint64_t count)
{
    std::vector<T> there(count);
    EXPECT_EQ(cudaMemcpy(there.data(), from, count * sizeof(T), cudaMemcpyDeviceToHost), cudaSuccess);
    return there;
}

/// A program with boxes on the device and its own stream.
class DeviceProgram
{
public:
    explicit DeviceProgram(const PsapOptions& options)
    {
        EXPECT_EQ(cudaStreamCreateWithFlags(&m_stream, cudaStreamNonBlocking), cudaSuccess);
        std::string why;
        finder = makeDeviceDeltaFinder(options, m_stream, &why);
        EXPECT_NE(finder, nullptr) << why;
        m_boxes.allocate(kMostBoxes);
    }
    DeviceProgram(const DeviceProgram&) = delete;
    DeviceProgram& operator=(const DeviceProgram&) = delete;
    ~DeviceProgram()
    {
        finder.reset();
        cudaStreamDestroy(m_stream);
    }

    Status enqueue(const std::vector<Aabb>& boxes)
    {
        EXPECT_LE(boxes.size(), kMostBoxes);
        EXPECT_EQ(cudaStreamSynchronize(m_stream), cudaSuccess);
        EXPECT_EQ(cudaMemcpy(m_boxes.data(), boxes.data(), boxes.size() * sizeof(Aabb), cudaMemcpyDefault),
                  cudaSuccess);
        EXPECT_EQ(cudaDeviceSynchronize(), cudaSuccess);
        const Status status = finder->enqueue(m_boxes.data(), boxes.size());
        // The program reuses the memory immediately.
        EXPECT_EQ(cudaMemsetAsync(m_boxes.data(), 0, kMostBoxes * sizeof(Aabb), m_stream), cudaSuccess);
        return status;
    }

    FoundDeltas collect()
    {
        DeviceDeltas found;
        EXPECT_EQ(finder->collect(found), Status::Ok);
        return fetchAll(found);
    }

    static FoundDeltas fetchAll(const DeviceDeltas& found)
    {
        return {fetch(found.kept, found.keptCount), fetch(found.added, found.addedCount),
                fetch(found.removed, found.removedCount)};
    }

    FoundDeltas operator()(const std::vector<Aabb>& boxes)
    {
        EXPECT_EQ(enqueue(boxes), Status::Ok);
        return collect();
    }

    /// The results on the device after the enqueued work, complete or truncated.
    FoundDeltas whatIsAhead(bool& isWhole)
    {
        EXPECT_EQ(cudaStreamSynchronize(m_stream), cudaSuccess);
        const DeviceDeltasAhead ahead = finder->ahead();
        const DeltaCounts counts = fetch(ahead.counts, 1)[0];
        isWhole = counts.added <= ahead.addedRoom;
        if (!isWhole)
            return {};
        return {fetch(ahead.kept, counts.kept), fetch(ahead.added, counts.added),
                fetch(ahead.removed, counts.removed)};
    }

    std::unique_ptr<DeviceDeltaFinder> finder;

private:
    static constexpr std::uint64_t kMostBoxes = 4096;

    cudaStream_t m_stream = nullptr;
    DeviceBuffer<Aabb> m_boxes;
};

/// Options that use neighbour lists for few boxes, too.
PsapOptions ordered(PsapOrder order, std::uint32_t capacity = PsapOptions{}.initialCapacity)
{
    PsapOptions options;
    options.order = order;
    options.initialCapacity = capacity;
    options.nearPairs = PsapNearPairs::Always;
    return options;
}

PsapOptions keeping(PsapNearPairs nearPairs)
{
    PsapOptions options;
    options.nearPairs = nearPairs;
    options.initialCapacity = 1;
    return options;
}

std::vector<PsapOptions> everyWay()
{
    std::vector<PsapOptions> ways;
    for (const PsapOrder order :
         {PsapOrder::Automatic, PsapOrder::Counting, PsapOrder::Bins, PsapOrder::Tiles})
    {
        ways.push_back(ordered(order));
        ways.push_back(ordered(order, 1));
    }
    for (const PsapNearPairs nearPairs : {PsapNearPairs::Never, PsapNearPairs::Automatic})
        ways.push_back(keeping(nearPairs));
    return ways;
}

TEST(CudaDeltas, EqualBruteForceDeltasWithEveryOption)
{
    const auto sets = changingBoxes(1500, 21);
    for (const PsapOptions& options : everyWay())
    {
        SCOPED_TRACE(std::to_string(static_cast<int>(options.order)) + " " +
                     std::to_string(options.initialCapacity));
        DeviceProgram program(options);
        expectChanges(sets, [&](const std::vector<Aabb>& boxes) { return program(boxes); });
    }
}

TEST(CudaDeltas, EqualBruteForceDeltasWhenLaunchesAreReplayed)
{
    // More frames than a plan lives.
    BoxScene scene(SceneKind::Pile, 2000, 22);
    DeviceProgram program(ordered(PsapOrder::Automatic));
    DeltaOracle oracle;
    for (int frame = 0; frame < 80; ++frame, scene.step())
        oracle.expect(scene.boxes(), program(scene.boxes()));
    EXPECT_GT(oracle.added(), 5000u);
    EXPECT_GT(oracle.removed(), 3000u);
}

TEST(CudaDeltas, AreCompleteOnStreamBeforeCollectWhenBuffersSuffice)
{
    const auto sets = changingBoxes(1000, 23);
    for (const std::uint32_t capacity : {1u, 1u << 16})
    {
        DeviceProgram program(ordered(PsapOrder::Automatic, capacity));
        DeltaOracle oracle;
        int wholeOnes = 0;
        for (std::size_t set = 0; set < sets.size(); ++set)
        {
            ASSERT_EQ(program.enqueue(sets[set]), Status::Ok);
            bool isWhole = false;
            FoundDeltas found = program.whatIsAhead(isWhole);
            wholeOnes += isWhole ? 1 : 0;
            // Results that were invalid are nevertheless reported by the next call; the last sets are collected without
            // reading them on the device.
            if (!isWhole)
                found = program.collect();
            oracle.expect(sets[set], found);
        }
        EXPECT_GT(wholeOnes, static_cast<int>(sets.size() / (capacity == 1 ? 8 : 2)));
        EXPECT_LT(wholeOnes, static_cast<int>(sets.size()));  // many boxes at one point do not fit in a bin
    }
}

TEST(CudaDeltas, ReferToPreviousSetAfterUncollectedSets)
{
    const auto sets = changingBoxes(1000, 24);
    for (const std::size_t last : {7u, 10u, 14u, 21u, 23u})
    {
        SCOPED_TRACE(last);
        DeviceProgram program(ordered(PsapOrder::Automatic, 1));
        for (std::size_t set = 0; set < last; ++set)
            ASSERT_EQ(program.enqueue(sets[set]), Status::Ok);
        ASSERT_EQ(program.enqueue(sets[last]), Status::Ok);
        const FoundDeltas found = program.collect();
        DeltaOracle oracle(everyPair(sets[last - 1]));
        oracle.expect(sets[last], found);
    }
}

TEST(CudaDeltas, AddAllPairsAgainAfterForgetWithoutGrowingMemory)
{
    const auto sets = changingBoxes(500, 25);
    DeviceProgram program(ordered(PsapOrder::Automatic));
    DeltaOracle oracle;
    std::uint64_t bytes = 0;
    for (int round = 0; round < 12; ++round)
    {
        for (int set = 0; set < 6; ++set)
            oracle.expect(sets[set], program(sets[set]));
        // The first neighbour list begins once sizes are known.
        EXPECT_TRUE(round < 8 || program.finder->bytes() == bytes) << "memory grows";
        bytes = program.finder->bytes();
        program.finder->forget();
        oracle.forget();
    }
}

/// Runs all sets while a CUDA call fails; after the failure everything enters again.
void runFailing(const PsapOptions& options, const std::vector<std::vector<Aabb>>& sets, const FaultPlan& plan)
{
    DeviceProgram program(options);
    DeltaOracle oracle;
    plan.begin();
    bool hasFailed = false;
    for (const std::vector<Aabb>& boxes : sets)
    {
        Status status = program.enqueue(boxes);
        DeviceDeltas found;
        if (status == Status::Ok)
            status = program.finder->collect(found);
        if (status != Status::Ok)
        {
            EXPECT_EQ(status, statusOf(plan.fault));
            EXPECT_EQ(found.addedCount, 0u);
            EXPECT_FALSE(hasFailed);
            hasFailed = true;
            setCudaFault(FaultInjection::None, 0);
            oracle.forget();
            EXPECT_EQ(program.enqueue(boxes), Status::Ok);
            EXPECT_EQ(program.finder->collect(found), Status::Ok);
        }
        oracle.expect(boxes, DeviceProgram::fetchAll(found));
    }
}

TEST(CudaDeltas, AddAllPairsAgainAfterAnyCallFails)
{
    // Neighbour lists are used from the fifth set on; the ninth is another scene.
    std::vector<std::vector<Aabb>> sets = changingBoxes(200, 26);
    sets.resize(11);
    for (const PsapOptions& options : {ordered(PsapOrder::Automatic, 1), ordered(PsapOrder::Tiles, 1),
                                       ordered(PsapOrder::Counting), keeping(PsapNearPairs::Never)})
    {
        for (const FaultInjection fault : {FaultInjection::OutOfMemory, FaultInjection::DeviceLost})
        {
            const std::uint64_t calls =
                failEachCall(fault, [&](const FaultPlan& plan) { runFailing(options, sets, plan); });
            EXPECT_GT(calls, 50u);
        }
    }
}
}  // namespace
}  // namespace cullet::test
