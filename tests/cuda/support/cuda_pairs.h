// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/cuda/narrow/convex_pairs.h"
#include "cullet/cuda/runtime/device_buffer.h"
#include "cullet/tests/cuda/support/convex_check.h"
#include "cullet/tests/cuda/support/convex_scene.h"

#include <cuda_runtime_api.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace cullet::test
{
/// An array of the device.
template <class T>
class DeviceArray
{
public:
    /// The copy has arrived when this returns.
    void upload(const std::vector<T>& from)
    {
        if (from.size() > m_memory.size())
            m_memory.allocate(from.size());
        ASSERT_EQ(cudaMemcpy(m_memory.data(), from.data(), from.size() * sizeof(T), cudaMemcpyHostToDevice),
                  cudaSuccess);
        ASSERT_EQ(cudaDeviceSynchronize(), cudaSuccess);
    }
    const T* data() const { return m_memory.data(); }

private:
    DeviceBuffer<T> m_memory;
};

template <class T>
std::vector<T> downloaded(const T* from, std::uint64_t count)
{
    std::vector<T> to(count);
    EXPECT_EQ(cudaMemcpy(to.data(), from, count * sizeof(T), cudaMemcpyDeviceToHost), cudaSuccess);
    return to;
}

/// Convex pairs on a device, with poses and pairs from the CPU.
class CudaPairs
{
public:
    explicit CudaPairs(const HullSet& hulls) : m_pairs(makeDeviceConvexPairs(hulls, 0, nullptr, &why)) {}

    bool isThere() const { return m_pairs != nullptr; }

    void upload(const ConvexBodies& bodies)
    {
        m_poses.upload(bodies.poses);
        m_list.upload(bodies.pairs);
    }

    /// Ok, or the error of the call that has failed.
    Status query(const ConvexBodies& bodies, ConvexAnswers& answers)
    {
        upload(bodies);
        return collect(m_pairs->enqueue(inputOf(bodies), m_list.data(), bodies.pairs.size()), answers);
    }
    /// With distances and the list of overlaps.
    Status measure(const ConvexBodies& bodies, float most, ConvexAnswers& answers)
    {
        upload(bodies);
        ConvexQuery query;
        query.maxDistance = most;
        query.listOverlaps = true;
        return collect(m_pairs->enqueue(inputOf(bodies), m_list.data(), bodies.pairs.size(), query), answers);
    }

    /// With contacts.
    Status contacts(const ConvexBodies& bodies, float margin, ConvexAnswers& answers)
    {
        upload(bodies);
        ConvexQuery query;
        query.contactMargin = margin;
        return collect(m_pairs->enqueue(inputOf(bodies), m_list.data(), bodies.pairs.size(), query), answers);
    }

    /// The contacts of the last query.
    Status copyContacts(ConvexAnswers& answers)
    {
        answers.overlaps.resize(counts.overlapping);
        answers.depths.resize(counts.overlapping);
        answers.contacts.resize(counts.overlapping);
        return m_pairs->copyContacts(answers.overlaps.data(), answers.depths.data(), answers.contacts.data(),
                                     counts.overlapping);
    }

    std::string why;
    ConvexPairCounts counts;

private:
    DeviceBodies inputOf(const ConvexBodies& bodies) const
    {
        return {m_poses.data(), static_cast<std::uint32_t>(bodies.poses.size())};
    }

    Status collect(Status status, ConvexAnswers& answers)
    {
        DevicePairAnswers found;
        if (status == Status::Ok)
            status = m_pairs->collect(found, counts);
        answers = {downloaded(found.states, found.count),
                   downloaded(found.axes, found.count),
                   downloaded(found.distances, found.distances != nullptr ? found.count : 0),
                   downloaded(found.overlaps, found.overlaps != nullptr ? counts.overlapping : 0),
                   downloaded(found.depths, found.depths != nullptr ? counts.overlapping : 0),
                   downloaded(found.contacts, found.contacts != nullptr ? counts.overlapping : 0)};
        if (found.depths != nullptr)
        {
            EXPECT_GE(found.room, counts.overlapping);
        }
        if (found.overlapCount != nullptr)
        {
            EXPECT_EQ(downloaded(found.overlapCount, 1)[0], counts.overlapping);
        }
        return status;
    }

    std::unique_ptr<DeviceConvexPairs> m_pairs;
    DeviceArray<BodyPose> m_poses;
    DeviceArray<RowPair> m_list;
};
}  // namespace cullet::test
