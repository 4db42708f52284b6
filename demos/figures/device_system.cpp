// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/figures/device_system.h"

#include "cullet/cuda/contacts/contact_finder.h"
#include "cullet/demos/bench/cuda/support/cuda_timing.h"
#include "cullet/demos/program/stopwatch.h"

#include <algorithm>
#include <utility>

namespace cullet
{
namespace
{
/// An array of the device and one in pinned memory of the CPU, between which copies take the least time.
template <class T>
class MirroredArray
{
public:
    explicit MirroredArray(std::size_t count)
    {
        checkCuda(cudaMalloc(reinterpret_cast<void**>(&m_device), count * sizeof(T)));
        checkCuda(cudaMallocHost(reinterpret_cast<void**>(&m_host), count * sizeof(T)));
    }
    MirroredArray(const MirroredArray&) = delete;
    MirroredArray& operator=(const MirroredArray&) = delete;
    ~MirroredArray()
    {
        cudaFree(m_device);
        cudaFreeHost(m_host);
    }
    T* device() const { return m_device; }
    T* host() const { return m_host; }

private:
    T *m_device = nullptr, *m_host = nullptr;
};

class CudaSystem final : public DeviceSystem
{
public:
    explicit CudaSystem(const HullSet& hulls)
        : m_finder(makeDeviceContactFinder(hulls, {}, m_stream.get(), nullptr))
    {
    }

    bool isThere() const { return m_finder != nullptr; }

    double step(const std::vector<BodyPose>& poses) override
    {
        makeRoom(m_poses, m_bodies, poses.size());
        std::copy(poses.begin(), poses.end(), m_poses->host());
        const Stopwatch watch;
        checkCuda(cudaMemcpyAsync(m_poses->device(), m_poses->host(), poses.size() * sizeof(BodyPose),
                                  cudaMemcpyHostToDevice, m_stream.get()));
        ContactQuery query;
        query.pairs.listOverlaps = true;
        requireOk(m_finder->enqueue({m_poses->device(), static_cast<std::uint32_t>(poses.size())}, query));
        requireOk(m_finder->collect(m_found, m_counts));
        makeRoom(m_overlaps, m_room, m_counts.pairs.overlapping);
        download(m_overlaps->host(), m_found.answers.overlaps, m_counts.pairs.overlapping);
        return watch.wallMs();
    }

    std::uint64_t pairCount() const override { return m_found.answers.count; }

    std::vector<RowPair> overlaps() const override
    {
        std::vector<RowPair> pairs(pairCount()), touching;
        download(pairs.data(), m_found.pairs, pairs.size());
        for (std::uint32_t i = 0; i < m_counts.pairs.overlapping; ++i)
            touching.push_back(pairs[m_overlaps->host()[i]]);
        return touching;
    }

private:
    template <class T>
    static void makeRoom(std::unique_ptr<MirroredArray<T>>& array, std::size_t& room, std::size_t count)
    {
        if (array != nullptr && count <= room)
            return;
        room = count + count / 4 + 1;
        array = std::make_unique<MirroredArray<T>>(room);
    }

    template <class T>
    void download(T* to, const T* from, std::size_t count) const
    {
        checkCuda(cudaMemcpyAsync(to, from, count * sizeof(T), cudaMemcpyDeviceToHost, m_stream.get()));
        checkCuda(cudaStreamSynchronize(m_stream.get()));
    }

    Stream m_stream;
    std::unique_ptr<DeviceContactFinder> m_finder;
    std::unique_ptr<MirroredArray<BodyPose>> m_poses;
    std::unique_ptr<MirroredArray<std::uint32_t>> m_overlaps;
    std::size_t m_bodies = 0, m_room = 0;
    DeviceContacts m_found;
    ContactCounts m_counts;
};
}  // namespace

std::unique_ptr<DeviceSystem> makeDeviceSystem(const HullSet& hulls)
{
    if (makeDeviceContactFinder(HullSet(), {}, nullptr, nullptr) == nullptr)
        return nullptr;
    auto system = std::make_unique<CudaSystem>(hulls);
    return system->isThere() ? std::move(system) : nullptr;
}
}  // namespace cullet
