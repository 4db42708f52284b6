// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// cullet_device_contacts [BODIES]: which hulls of a simulation on the GPU touch.
//
// Hulls tumble through a box on the device. In every frame one kernel moves them, DeviceContactFinder finds the pairs that
// are near each other and those that overlap, and another kernel counts how many hulls each one touches. The CPU fetches
// results and waits only in every tenth frame, to print; a finder that remembers nothing then answers the same poses, as
// a check.

#include "cullet/cuda/contacts/contact_finder.h"
#include "cullet/cuda/narrow/hull_set.h"
#include "cullet/demos/device_balls.cuh"
#include "cullet/demos/device_hulls.h"

#include <cmath>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{
using namespace cullet;

constexpr int kFrames = 100;
constexpr std::uint32_t kHulls = 16;
constexpr int kPoints = 42;
constexpr unsigned kBlocks = 1024;  // the number of pairs is unknown to the CPU: grid-stride loop

/// Moves hulls back and forth between the walls, and turns each about an axis of its own.
__global__ void __launch_bounds__(kThreads)
    tumble(std::uint32_t count, float side, float time, BodyPose* poses)
{
    const std::uint32_t body = blockIdx.x * kThreads + threadIdx.x;
    if (body >= count)
        return;
    BodyPose pose = {};
    pose.hull = body % kHulls;
    float length2 = 1e-6f;
    for (std::uint32_t axis = 0; axis < 3; ++axis)
    {
        const float way = side * fractionOf(body, axis) + time * (fractionOf(body, axis + 3) - 0.5f);
        const float folded = fabsf(fmodf(way, 2 * side));
        pose.position[axis] = folded < side ? folded : 2 * side - folded;
        pose.rotation[axis] = fractionOf(body, axis + 6) - 0.5f;
        length2 += pose.rotation[axis] * pose.rotation[axis];
    }
    const float angle = 0.2f * time + 3.0f * fractionOf(body, 9);
    for (std::uint32_t axis = 0; axis < 3; ++axis)
        pose.rotation[axis] *= sinf(angle) * rsqrtf(length2);
    pose.rotation[3] = cosf(angle);
    poses[body] = pose;
}

/// @param missed [out] whether a list was too short, so that only collect() has the answers
__global__ void __launch_bounds__(kThreads)
    countTouching(DeviceContactsAhead found, unsigned* touching, unsigned* missed)
{
    const std::uint64_t count = *found.count;
    if (count == ~std::uint64_t{0})
    {
        *missed = 1;
        return;
    }
    for (std::uint64_t i = std::uint64_t{blockIdx.x} * kThreads + threadIdx.x; i < count;
         i += kBlocks * kThreads)
    {
        if (found.contacts.answers.states[i] != PairState::Overlapping)
            continue;
        atomicAdd(&touching[found.contacts.pairs[i].a], 1u);
        atomicAdd(&touching[found.contacts.pairs[i].b], 1u);
    }
}

template <class T>
std::vector<T> fetch(const T* from, std::uint64_t count, cudaStream_t stream)
{
    std::vector<T> there(count);
    checkCuda(cudaMemcpyAsync(there.data(), from, count * sizeof(T), cudaMemcpyDeviceToHost, stream));
    checkCuda(cudaStreamSynchronize(stream));
    return there;
}

std::unique_ptr<DeviceContactFinder> makeFinder(const HullSet& hulls, cudaStream_t stream)
{
    std::string why;
    auto finder = makeDeviceContactFinder(hulls, {}, stream, &why);
    if (!finder)
        throw std::runtime_error(why);
    return finder;
}

/// Contacts of tumbling hulls.
class Tumbling
{
public:
    Tumbling(std::uint32_t bodies, cudaStream_t stream)
        : m_bodies(bodies),
          m_stream(stream),
          m_side(std::cbrt(24.0f * static_cast<float>(bodies))),
          m_poses(allocate<BodyPose>(bodies)),
          m_touching(allocate<unsigned>(bodies)),
          m_missed(allocate<unsigned>(1))
    {
        const HullSet hulls = hullsOnSphere(kHulls, kPoints);
        m_finder = makeFinder(hulls, stream);
        m_check = makeFinder(hulls, stream);
        checkCuda(cudaMemsetAsync(m_missed, 0, sizeof(unsigned), stream));
    }
    Tumbling(const Tumbling&) = delete;
    Tumbling& operator=(const Tumbling&) = delete;
    ~Tumbling()
    {
        cudaFree(m_poses);
        cudaFree(m_touching);
        cudaFree(m_missed);
    }

    void step(int frame)
    {
        tumble<<<blocksFor(m_bodies), kThreads, 0, m_stream>>>(m_bodies, m_side,
                                                               0.1f * static_cast<float>(frame), m_poses);
        checkCuda(cudaGetLastError());
        requireOk(m_finder->enqueue({m_poses, m_bodies}, {}));
        checkCuda(cudaMemsetAsync(m_touching, 0, m_bodies * sizeof(unsigned), m_stream));
        countTouching<<<kBlocks, kThreads, 0, m_stream>>>(m_finder->ahead(), m_touching, m_missed);
        checkCuda(cudaGetLastError());
    }

    void print(int frame)
    {
        DeviceContacts found;
        ContactCounts counts;
        requireOk(m_finder->collect(found, counts));
        const bool wasShort = fetch(m_missed, 1, m_stream)[0] != 0;
        checkCuda(cudaMemsetAsync(m_missed, 0, sizeof(unsigned), m_stream));
        check(found);
        std::uint64_t touching = 0;
        for (const unsigned count : fetch(m_touching, m_bodies, m_stream))
            touching += count;
        if (!wasShort && touching != 2 * std::uint64_t{counts.pairs.overlapping})
            throw std::runtime_error("a hull touches another number of hulls");
        std::printf("frame %d: %llu pairs, %llu entered, %llu left, %u overlap, %u searched%s\n", frame,
                    static_cast<unsigned long long>(counts.changes.pairs()),
                    static_cast<unsigned long long>(counts.changes.added),
                    static_cast<unsigned long long>(counts.changes.removed), counts.pairs.overlapping,
                    counts.pairs.failed + counts.pairs.remembered, wasShort ? "; lists have grown" : "");
    }

private:
    /// Compares with a finder that remembers nothing.
    void check(const DeviceContacts& found)
    {
        DeviceContacts anew;
        ContactCounts counts;
        m_check->forget();
        requireOk(m_check->enqueue({m_poses, m_bodies}, {}));
        requireOk(m_check->collect(anew, counts));
        const std::uint64_t count = found.answers.count;
        if (anew.answers.count != count ||
            fetch(found.answers.states, count, m_stream) != fetch(anew.answers.states, count, m_stream))
            throw std::runtime_error("the answers depend on what is remembered");
    }

    std::uint32_t m_bodies;
    cudaStream_t m_stream;
    float m_side;
    BodyPose* m_poses;
    unsigned* m_touching;
    unsigned* m_missed;
    std::unique_ptr<DeviceContactFinder> m_finder, m_check;
};

void run(std::uint32_t bodies)
{
    cudaStream_t stream = nullptr;
    checkCuda(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
    Tumbling tumbling(bodies, stream);
    cudaEvent_t begin = nullptr, end = nullptr;
    checkCuda(cudaEventCreate(&begin));
    checkCuda(cudaEventCreate(&end));
    float milliseconds = 0;
    for (int frame = 0; frame < kFrames; ++frame)
    {
        if (frame % 10 == 0)
            checkCuda(cudaEventRecord(begin, stream));
        tumbling.step(frame);
        if (frame % 10 != 9)
            continue;
        checkCuda(cudaEventRecord(end, stream));
        checkCuda(cudaEventSynchronize(end));
        checkCuda(cudaEventElapsedTime(&milliseconds, begin, end));
        tumbling.print(frame);
    }
    std::printf("%.3f ms a frame of the last ten, from poses to answers\n",
                static_cast<double>(milliseconds) / 10);
    checkCuda(cudaEventDestroy(begin));
    checkCuda(cudaEventDestroy(end));
}
}  // namespace

int main(int argc, char** argv)
{
    return mainWithBalls("cullet_device_contacts", argc, argv, run);
}
