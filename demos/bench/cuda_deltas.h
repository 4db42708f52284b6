// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "demos/bench/cuda_sets.h"
#include "demos/bench/cuda_table.h"

namespace cullet
{
/// Times a DeviceDeltaFinder: all pairs, those that enter and those that leave, of boxes in device memory, by CUDA events.
///
/// @param isFresh other boxes in every frame, so that all pairs change; else each is up to 0.05 from where the first set has
///     it along each axis, the same as in update() rows
CudaRow timeDeltas(const FreshSets& sets, bool isFresh, int frames);
}  // namespace cullet
