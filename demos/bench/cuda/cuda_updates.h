// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/demos/bench/cuda/cuda_floor.h"
#include "cullet/demos/bench/cuda/cuda_sets.h"
#include "cullet/demos/bench/cuda/support/cuda_table.h"

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace cullet
{
/// The stages of update() on the device.
struct StageSamples
{
    std::map<std::string, std::vector<double>> times;  ///< by stage, of each frame
    UpdateWork work;                                   ///< of the last frame
};

/// Numbers of frames; hashes need eleven in total.
struct UpdateFrames
{
    int warmUps, timed;
};

/// Mean times of update(): boxes in CPU memory that drift by SteadyDrift, deltas in CPU memory.
///
/// The hash is over the changes of the same frames for every backend, independent of the number of timed frames.
/// @param every one of so many boxes moves in a frame
CudaRow timeUpdates(const FreshSets& sets, const std::string& variant, std::unique_ptr<Backend> backend,
                    std::uint32_t every, UpdateFrames frames, StageSamples* stages = nullptr);

/// Times the CPU's grid on all cores with all boxes new: the reference for rows of timePairs().
CudaRow timeGridPairs(const FreshSets& sets);
}  // namespace cullet
