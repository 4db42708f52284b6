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

/// Numbers of frames; hashes want eleven in all.
struct UpdateFrames
{
    int warmUps, timed;
};

/// Times update(), means: boxes in the CPU's memory that drift as SteadyDrift has it, deltas there too.
///
/// The hash is of the changes of the same frames for every backend, however many are timed.
/// @param every one of so many boxes moves in a frame
CudaRow timeUpdates(const FreshSets& sets, const std::string& variant, std::unique_ptr<Backend> backend,
                    std::uint32_t every, UpdateFrames frames, StageSamples* stages = nullptr);

/// Times the CPU's grid on all cores where all boxes are new: what a row of timePairs() has to find.
CudaRow timeGridPairs(const FreshSets& sets);
}  // namespace cullet
