// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/cuda/cuda_sets.h"
#include "cullet/demos/bench/cuda/support/cuda_table.h"

#include <string>

namespace cullet
{
/// Each box goes on with a velocity of its own, up to 0.05 a frame along each axis.
inline constexpr const char* kDriftingDeltas = "rows-deltas";
/// The same, and every frame is searched.
inline constexpr const char* kSearchedDeltas = "rows-deltas-searched";
/// Other boxes in every frame, so that all pairs change.
inline constexpr const char* kFreshDeltas = "rows-deltas-fresh";

/// Times a DeviceDeltaFinder: all pairs, those that enter and those that leave, of boxes in device memory, by CUDA events.
/// Means: some frames search, and those behind them need not.
///
/// @param variant one of those above
CudaRow timeDeltas(const FreshSets& sets, const std::string& variant, int frames);
}  // namespace cullet
