// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "demos/bench/cuda_sets.h"
#include "demos/bench/cuda_table.h"

namespace cullet
{
/// Times a DeviceDeltaFinder: all pairs, those that enter and those that leave, of boxes in device memory, by CUDA events.
///
/// Means: some frames search, and those behind them need not.
///
/// @param isFresh other boxes in every frame, so that all pairs change; else each goes on with a velocity of its own, up to
///     0.05 a frame along each axis
CudaRow timeDeltas(const FreshSets& sets, bool isFresh, int frames);
}  // namespace cullet
