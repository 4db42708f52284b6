// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// cullet_device_deltas [BODIES]: pair changes of a simulation on the GPU.
//
// Balls fly through a box on the device, and the number of neighbours of each is stored. In every frame one kernel
// moves them, DeviceDeltaFinder finds the entering and leaving pairs, and another kernel adds and subtracts those. The
// CPU fetches results and waits only in every tenth frame, to print; then all neighbours are counted again as a check.

#include "cullet/cuda/device_pairs.h"
#include "cullet/demos/device_balls.cuh"

#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <vector>

namespace
{
using namespace cullet;

constexpr int kFrames = 100;
constexpr unsigned kBlocks = 256;  // the number of pairs is unknown to the CPU: grid-stride loop

__device__ std::uint64_t globalThread()
{
    return static_cast<std::uint64_t>(blockIdx.x) * kThreads + threadIdx.x;
}

__device__ void add(unsigned* neighbours, RowPair pair, unsigned what)
{
    atomicAdd(&neighbours[pair.a], what);
    atomicAdd(&neighbours[pair.b], what);
}

/// @param missed [out] whether the list was too short for all changes, so that only collect() returns them
__global__ void __launch_bounds__(kThreads)
    follow(DeviceDeltasAhead found, unsigned* neighbours, unsigned* missed)
{
    const DeltaCounts counts = *found.counts;
    if (counts.added > found.addedRoom)
    {
        *missed = 1;
        return;
    }
    for (std::uint64_t i = globalThread(); i < counts.added; i += kBlocks * kThreads)
        add(neighbours, found.added[i], 1u);
    for (std::uint64_t i = globalThread(); i < counts.removed; i += kBlocks * kThreads)
        add(neighbours, found.removed[i], ~0u);
}

__global__ void __launch_bounds__(kThreads)
    count(const RowPair* pairs, std::uint64_t pairCount, unsigned* neighbours)
{
    for (std::uint64_t i = globalThread(); i < pairCount; i += kBlocks * kThreads)
        add(neighbours, pairs[i], 1u);
}

/// The number of neighbours of each ball.
class Neighbours
{
public:
    Neighbours(std::uint32_t balls, cudaStream_t stream)
        : m_balls(balls),
          m_stream(stream),
          m_followed(allocate<unsigned>(balls)),
          m_counted(allocate<unsigned>(balls)),
          m_missed(allocate<unsigned>(1))
    {
        checkCuda(cudaMemsetAsync(m_followed, 0, balls * sizeof(unsigned), stream));
        checkCuda(cudaMemsetAsync(m_missed, 0, sizeof(unsigned), stream));
    }
    Neighbours(const Neighbours&) = delete;
    Neighbours& operator=(const Neighbours&) = delete;
    ~Neighbours()
    {
        for (unsigned* memory : {m_followed, m_counted, m_missed})
            cudaFree(memory);
    }

    void follow(const DeviceDeltasAhead& found)
    {
        ::follow<<<kBlocks, kThreads, 0, m_stream>>>(found, m_followed, m_missed);
        checkCuda(cudaGetLastError());
    }

    /// Counts the neighbours from scratch and compares; if a list was too short, adopts the new counts.
    ///
    /// @return whether a list was too short
    bool compare(const DeviceDeltas& found)
    {
        checkCuda(cudaMemsetAsync(m_counted, 0, m_balls * sizeof(unsigned), m_stream));
        count<<<kBlocks, kThreads, 0, m_stream>>>(found.kept, found.keptCount, m_counted);
        count<<<kBlocks, kThreads, 0, m_stream>>>(found.added, found.addedCount, m_counted);
        checkCuda(cudaGetLastError());
        const bool isMissing = fetch(m_missed, 1)[0] != 0;
        if (isMissing)
        {
            checkCuda(cudaMemcpyAsync(m_followed, m_counted, m_balls * sizeof(unsigned),
                                      cudaMemcpyDeviceToDevice, m_stream));
            checkCuda(cudaMemsetAsync(m_missed, 0, sizeof(unsigned), m_stream));
        }
        else if (fetch(m_followed, m_balls) != fetch(m_counted, m_balls))
            throw std::runtime_error("the changes do not make up the pairs");
        return isMissing;
    }

private:
    std::vector<unsigned> fetch(const unsigned* from, std::uint32_t size)
    {
        std::vector<unsigned> there(size);
        checkCuda(
            cudaMemcpyAsync(there.data(), from, size * sizeof(unsigned), cudaMemcpyDeviceToHost, m_stream));
        checkCuda(cudaStreamSynchronize(m_stream));
        return there;
    }

    std::uint32_t m_balls;
    cudaStream_t m_stream;
    unsigned* m_followed;
    unsigned* m_counted;
    unsigned* m_missed;
};

void run(std::uint32_t balls)
{
    cudaStream_t stream = nullptr;
    checkCuda(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
    std::string why;
    const auto finder = makeDeviceDeltaFinder({}, stream, &why);
    if (!finder)
        throw std::runtime_error(why);
    Aabb* boxes = allocate<Aabb>(balls);
    Neighbours neighbours(balls, stream);
    const float side = std::cbrt(32.0f * static_cast<float>(balls));
    for (int frame = 0; frame < kFrames; ++frame)
    {
        fly<<<blocksFor(balls), kThreads, 0, stream>>>(balls, side, 0.1f * static_cast<float>(frame), boxes);
        checkCuda(cudaGetLastError());
        if (finder->enqueue(boxes, balls) != Status::Ok)
            throw std::runtime_error("the search failed");
        neighbours.follow(finder->ahead());
        if (frame % 10 != 9)
            continue;
        DeviceDeltas found;
        if (finder->collect(found) != Status::Ok)
            throw std::runtime_error("the search failed");
        const bool wasShort = neighbours.compare(found);
        std::printf("frame %d: %llu pairs, %llu entered, %llu left%s\n", frame,
                    static_cast<unsigned long long>(found.keptCount + found.addedCount),
                    static_cast<unsigned long long>(found.addedCount),
                    static_cast<unsigned long long>(found.removedCount),
                    wasShort ? "; lists have grown" : "");
    }
    checkCuda(cudaStreamSynchronize(stream));
    checkCuda(cudaFree(boxes));
}
}  // namespace

int main(int argc, char** argv)
{
    return mainWithBalls("cullet_device_deltas", argc, argv, run);
}
