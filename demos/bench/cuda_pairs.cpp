// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "demos/bench/cuda_pairs.h"

#include "cuda/device_pairs.h"
#include "demos/bench/cuda_timing.h"
#include "demos/program/statistics.h"

#include <memory>
#include <stdexcept>
#include <vector>

namespace cullet
{
namespace
{
constexpr int kSets = 3;
}  // namespace

CudaRow timePairs(const FreshScene& scene, const std::string& variant, const PsapOptions& options, int frames)
{
    const Stream stream;
    StreamTimer timer(stream.get());
    std::string why;
    const auto finder = makeDevicePairFinder(options, stream.get(), &why);
    if (!finder)
        throw std::runtime_error(why);
    std::vector<std::unique_ptr<DeviceBoxes>> sets;
    for (int set = 0; set < kSets; ++set)
        sets.push_back(std::make_unique<DeviceBoxes>(scene.make(scene.bodies, kFirstSeed + set)));
    const DeviceBoxes current(scene.bodies);
    CudaRow row = rowFor(scene, variant);
    DevicePairs found;
    std::vector<double> times;
    for (int frame = 0; frame < kWarmUps + frames; ++frame)
    {
        // One address, new content: as an engine that integrates on the device would have it.
        checkCuda(cudaMemcpyAsync(current.data(), sets[frame % kSets]->data(), scene.bodies * sizeof(Aabb),
                                  cudaMemcpyDeviceToDevice, stream.get()));
        checkCuda(cudaStreamSynchronize(stream.get()));
        timer.begin();
        requireOk(finder->enqueue(current.data(), scene.bodies));
        timer.end();
        requireOk(finder->collect(found));
        if (frame >= kWarmUps)
            times.push_back(timer.milliseconds());
        if (frame == kWarmUps)
        {
            row.pairs = found.count;
            row.hash = hashOfDevicePairs(found.pairs, found.count);
        }
    }
    row.gpuMs = summarise(times).median;
    row.bytes = finder->bytes();
    return row;
}
}  // namespace cullet
