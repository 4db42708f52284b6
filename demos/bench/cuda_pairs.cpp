// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "demos/bench/cuda_pairs.h"

#include "cuda/device_pairs.h"
#include "demos/bench/cuda_timing.h"

#include <cstdint>
#include <stdexcept>
#include <vector>

namespace cullet
{
namespace
{
// A CPU that wakes up late takes no longer.
constexpr double kLateMs = 0.02;

/// Times the frames of a finder.
class FrameClock
{
public:
    FrameClock(DevicePairFinder& finder, cudaStream_t stream)
        : m_finder(finder), m_search(stream), m_collect(stream), m_collectAgain(stream)
    {
    }

    /// Milliseconds of the device. Where a bin was full or the list too short, collect() searches again: it takes longer by
    /// that than a second one, which has nothing to do.
    double time(const Aabb* boxes, std::uint64_t bodies, DevicePairs& found)
    {
        m_search.begin();
        requireOk(m_finder.enqueue(boxes, bodies));
        m_search.end();
        m_collect.begin();
        requireOk(m_finder.collect(found));
        m_collect.end();
        m_collectAgain.begin();
        requireOk(m_finder.collect(found));
        m_collectAgain.end();
        const double again = m_collectAgain.milliseconds();
        const double late = m_collect.milliseconds() - again;
        m_isLate = late > kLateMs;
        return m_search.milliseconds() + (m_isLate ? late : 0);
    }

    /// Whether the last frame was searched twice.
    bool isLate() const { return m_isLate; }

private:
    DevicePairFinder& m_finder;
    StreamTimer m_search, m_collect, m_collectAgain;
    bool m_isLate = false;
};
}  // namespace

CudaRow timePairs(const FreshSets& sets, const std::string& variant, const PsapOptions& options, int frames)
{
    const Stream stream;
    std::string why;
    const auto finder = makeDevicePairFinder(options, stream.get(), &why);
    if (!finder)
        throw std::runtime_error(why);
    FrameClock clock(*finder, stream.get());
    const std::uint32_t bodies = sets.scene().bodies;
    const DeviceBoxes current(bodies);
    CudaRow row = rowFor(sets.scene(), variant, kFreshPairs);
    // The last of the first set: what is launched then was recorded in earlier frames.
    const int hashedFrame = (kWarmUps + frames - 1) / FreshSets::kCount * FreshSets::kCount;
    DevicePairs found;
    std::vector<double> times;
    for (int frame = 0; frame < kWarmUps + frames; ++frame)
    {
        // One address, new content: as an engine that integrates on the device would have it.
        checkCuda(cudaMemcpyAsync(current.data(), sets.ofFrame(frame).data(), bodies * sizeof(Aabb),
                                  cudaMemcpyDeviceToDevice, stream.get()));
        checkCuda(cudaStreamSynchronize(stream.get()));
        const double passed = clock.time(current.data(), bodies, found);
        if (frame >= kWarmUps)
            times.push_back(passed);
        if (frame >= kWarmUps && clock.isLate())
            ++row.lateFrames;
        if (frame == hashedFrame)
        {
            row.pairs = found.count;
            row.hash = hashOfDevicePairs(found.pairs, found.count);
        }
    }
    setTimes(row, &CudaRow::gpuMs, times);
    row.bytes = finder->bytes();
    row.moved = leastForPairs(bodies, row.pairs);
    return row;
}
}  // namespace cullet
