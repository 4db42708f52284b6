// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/broad/backend.h"
#include "cullet/comparison/backends.h"
#include "cullet/demos/bench/cuda/cuda_sets.h"
#include "cullet/demos/bench/cuda/support/cuda_table.h"

#include <string>

namespace cullet
{
/// Times a DevicePairFinder: the complete pair set of boxes in device memory, new ones in every frame.
CudaRow timePairs(const FreshSets& sets, const std::string& variant, const PsapOptions& options, int frames);

/// The same with the thesis's search.
CudaRow timeThesisPairs(const FreshSets& sets, const std::string& variant, const ThesisOptions& options,
                        int frames);
}  // namespace cullet
