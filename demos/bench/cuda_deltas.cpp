// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "demos/bench/cuda_deltas.h"

#include "cuda/device_pairs.h"
#include "demos/bench/cuda_frame_clock.h"
#include "demos/bench/cuda_timing.h"
#include "demos/program/exit_code.h"

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace cullet
{
namespace
{
/// Boxes around where they are in the first set, in three frames.
class DriftingSets
{
public:
    explicit DriftingSets(const FreshSets& sets)
    {
        for (std::unique_ptr<DeviceBoxes>& there : m_onDevice)
        {
            std::vector<Aabb> boxes = sets.first();
            for (Aabb& box : boxes)
                drift(box);
            there = std::make_unique<DeviceBoxes>(boxes);
        }
    }

    /// Of a frame that is not one of the first set.
    const DeviceBoxes& ofFrame(int frame) const { return *m_onDevice[frame % FreshSets::kCount - 1]; }

private:
    void drift(Aabb& box)
    {
        for (int axis = 0; axis < 3; ++axis)
        {
            const float way = m_random.uniform(-0.05f, 0.05f);
            box.min[axis] += way;
            box.max[axis] += way;
        }
    }

    SplitMix64 m_random{8};
    std::unique_ptr<DeviceBoxes> m_onDevice[FreshSets::kCount - 1];
};

std::uint64_t hashOfPairs(const DeviceDeltas& found)
{
    return hashOfDevicePairs(found.kept, found.keptCount) + hashOfDevicePairs(found.added, found.addedCount);
}

/// Adds the changes up, so that a wrong one is seen.
class AddedUp
{
public:
    void add(const DeviceDeltas& found)
    {
        m_hash += hashOfDevicePairs(found.added, found.addedCount);
        m_hash -= hashOfDevicePairs(found.removed, found.removedCount);
        if (m_hash != hashOfPairs(found))
            throw ProgramError(kExitDisagreement, "the changes do not make up the pairs");
    }

private:
    std::uint64_t m_hash = 0;
};
}  // namespace

CudaRow timeDeltas(const FreshSets& sets, bool isFresh, int frames)
{
    const Stream stream;
    std::string why;
    const auto finder = makeDeviceDeltaFinder({}, stream.get(), &why);
    if (!finder)
        throw std::runtime_error(why);
    FrameClock<DeviceDeltaFinder, DeviceDeltas> clock(*finder, stream.get());
    const std::uint32_t bodies = sets.scene().bodies;
    const DeviceBoxes current(bodies);
    const std::unique_ptr<DriftingSets> drifting = isFresh ? nullptr : std::make_unique<DriftingSets>(sets);
    CudaRow row = rowFor(sets.scene(), isFresh ? "rows-deltas-fresh" : "rows-deltas", kFreshPairs);
    const int hashedFrame = (kWarmUps + frames - 1) / FreshSets::kCount * FreshSets::kCount;
    AddedUp all;
    DeviceDeltas found;
    std::vector<double> times;
    for (int frame = 0; frame < kWarmUps + frames; ++frame)
    {
        const bool isFirst = isFresh || frame % FreshSets::kCount == 0;
        checkCuda(cudaMemcpyAsync(current.data(),
                                  isFirst ? sets.ofFrame(frame).data() : drifting->ofFrame(frame).data(),
                                  bodies * sizeof(Aabb), cudaMemcpyDeviceToDevice, stream.get()));
        checkCuda(cudaStreamSynchronize(stream.get()));
        const double passed = clock.time(current.data(), bodies, found);
        if (frame >= kWarmUps)
            times.push_back(passed);
        else
            all.add(found);
        if (frame >= kWarmUps && clock.isLate())
            ++row.lateFrames;
        if (frame == hashedFrame)
        {
            row.pairs = found.keptCount + found.addedCount;
            row.hash = hashOfPairs(found);
        }
    }
    setTimes(row, &CudaRow::gpuMs, times);
    row.bytes = finder->bytes();
    row.moved = leastForDeltas(bodies, row.pairs);
    return row;
}
}  // namespace cullet
