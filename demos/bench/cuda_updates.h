// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/backend.h"
#include "demos/bench/cuda_sets.h"
#include "demos/bench/cuda_table.h"

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace cullet
{
/// What an update took on the device, stage by stage; a list of frames for each.
using StageTimes = std::map<std::string, std::vector<double>>;

/// Times update(): boxes in the CPU's memory that drift by 0.05, deltas there too.
///
/// The hash is of the changes of the same frames for every backend, however many are timed.
/// @param every one of so many boxes moves in a frame
CudaRow timeUpdates(const FreshSets& sets, const std::string& variant, std::unique_ptr<Backend> backend,
                    std::uint32_t every, int frames, StageTimes* stages = nullptr);

/// Times the CPU's grid on all cores where all boxes are new: what a row of timePairs() has to find.
CudaRow timeGridPairs(const FreshSets& sets);
}  // namespace cullet
