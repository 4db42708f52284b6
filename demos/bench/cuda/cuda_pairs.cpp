// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/cuda/cuda_pairs.h"

#include "cullet/comparison/device_finders.h"
#include "cullet/cuda/device_pairs.h"
#include "cullet/demos/bench/cuda/support/cuda_frame_clock.h"
#include "cullet/demos/bench/cuda/support/cuda_timing.h"

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace cullet
{
namespace
{
using MadeFinder = std::unique_ptr<DevicePairFinder>;

template <class Options>
CudaRow timeFinder(MadeFinder (*make)(const Options&, CUstream_st*, std::string*), const FreshSets& sets,
                   const std::string& variant, const Options& options, int frames)
{
    const Stream stream;
    std::string why;
    const auto finder = make(options, stream.get(), &why);
    if (!finder)
        throw std::runtime_error(why);
    FrameClock<DevicePairFinder, DevicePairs> clock(*finder, stream.get());
    const std::uint32_t bodies = sets.scene().bodies;
    const DeviceBoxes current(bodies);
    CudaRow row = rowFor(sets.scene(), variant, kFreshPairs);
    // The last frame of the first set: its launches were recorded in earlier frames.
    const int hashedFrame = (kWarmUps + frames - 1) / FreshSets::kCount * FreshSets::kCount;
    DevicePairs found;
    std::vector<double> times;
    for (int frame = 0; frame < kWarmUps + frames; ++frame)
    {
        // One address with new content, like an engine that integrates on the device.
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
}  // namespace

CudaRow timePairs(const FreshSets& sets, const std::string& variant, const PsapOptions& options, int frames)
{
    return timeFinder(makeDevicePairFinder, sets, variant, options, frames);
}

CudaRow timeThesisPairs(const FreshSets& sets, const std::string& variant, const ThesisOptions& options,
                        int frames)
{
    return timeFinder(makeThesisPairFinder, sets, variant, options, frames);
}
}  // namespace cullet
