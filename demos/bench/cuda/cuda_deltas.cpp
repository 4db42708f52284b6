// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#include "cullet/demos/bench/cuda/cuda_deltas.h"

#include "cullet/cuda/device_pairs.h"
#include "cullet/demos/bench/cuda/cuda_drift.h"
#include "cullet/demos/bench/cuda/support/cuda_frame_clock.h"
#include "cullet/demos/bench/cuda/support/cuda_timing.h"
#include "cullet/demos/program/exit_code.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace cullet
{
namespace
{
/// Boxes that drift, starting from the first set.
class DriftingBoxes
{
public:
    explicit DriftingBoxes(const std::vector<Aabb>& first) : m_boxes(first), m_drift(first.size()) {}

    const std::vector<Aabb>& now() const { return m_boxes; }
    void step()
    {
        for (std::size_t body = 0; body < m_boxes.size(); ++body)
            m_drift.move(m_boxes[body], body);
    }

private:
    std::vector<Aabb> m_boxes;
    SteadyDrift m_drift;
};

std::uint64_t hashOfPairs(const DeviceDeltas& found)
{
    return hashOfDevicePairs(found.kept, found.keptCount) + hashOfDevicePairs(found.added, found.addedCount);
}

/// Accumulates the changes, so that a wrong one is detected.
class AccumulatedChanges
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

/// Compares with a search for all pairs of the boxes.
void requireAllPairs(const DeviceBoxes& boxes, std::uint64_t count, std::uint64_t hash, cudaStream_t stream)
{
    const auto finder = makeDevicePairFinder({}, stream, nullptr);
    DevicePairs found;
    requireOk(finder == nullptr ? Status::OutOfMemory : finder->enqueue(boxes.data(), count));
    requireOk(finder->collect(found));
    if (hashOfDevicePairs(found.pairs, found.count) != hash)
        throw ProgramError(kExitDisagreement, "the pairs are not those of a search");
}
}  // namespace

CudaRow timeDeltas(const FreshSets& sets, const std::string& variant, int frames)
{
    const bool isFresh = variant == kFreshDeltas;
    const Stream stream;
    std::string why;
    PsapOptions options;
    options.nearPairs = variant == kSearchedDeltas ? PsapNearPairs::Never : PsapNearPairs::Automatic;
    const auto finder = makeDeviceDeltaFinder(options, stream.get(), &why);
    if (!finder)
        throw std::runtime_error(why);
    FrameClock<DeviceDeltaFinder, DeviceDeltas> clock(*finder, stream.get());
    const std::uint32_t bodies = sets.scene().bodies;
    const DeviceBoxes current(bodies);
    DriftingBoxes drifting(isFresh ? std::vector<Aabb>() : sets.first());
    CudaRow row = rowFor(sets.scene(), variant, kFreshPairs);
    AccumulatedChanges all;
    DeviceDeltas found;
    std::vector<double> times;
    for (int frame = 0; frame < kDriftWarmUps + frames; ++frame)
    {
        checkCuda(cudaMemcpyAsync(current.data(),
                                  isFresh ? sets.ofFrame(frame).data() : drifting.now().data(),
                                  bodies * sizeof(Aabb), cudaMemcpyDefault, stream.get()));
        checkCuda(cudaStreamSynchronize(stream.get()));
        const double passed = clock.time(current.data(), bodies, found);
        if (frame >= kDriftWarmUps)
            times.push_back(passed);
        else
            all.add(found);
        if (frame >= kDriftWarmUps && clock.isLate())
            ++row.lateFrames;
        if (frame == 0)
        {
            row.pairs = found.keptCount + found.addedCount;
            row.hash = hashOfPairs(found);
        }
        drifting.step();
    }
    requireAllPairs(current, bodies, hashOfPairs(found), stream.get());
    setMeans(row, &CudaRow::gpuMs, times);
    row.bytes = finder->bytes();
    row.moved = leastForDeltas(bodies, row.pairs);
    return row;
}
}  // namespace cullet
