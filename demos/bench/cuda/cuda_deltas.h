// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/cuda/cuda_sets.h"
#include "cullet/demos/bench/cuda/support/cuda_table.h"

#include <string>

namespace cullet
{
/// Each box drifts with its own velocity, up to 0.05 per frame along each axis.
inline constexpr const char* kDriftingDeltas = "rows-deltas";
/// Drifting boxes, with a search in every frame.
inline constexpr const char* kSearchedDeltas = "rows-deltas-searched";
/// New boxes in every frame, so that all pairs change.
inline constexpr const char* kFreshDeltas = "rows-deltas-fresh";

/// Times a DeviceDeltaFinder: all pairs, entering and leaving ones, of boxes in device memory, by CUDA events. Reports
/// means, since only some frames need a search.
///
/// @param variant kDriftingDeltas, kSearchedDeltas or kFreshDeltas
CudaRow timeDeltas(const FreshSets& sets, const std::string& variant, int frames);
}  // namespace cullet
