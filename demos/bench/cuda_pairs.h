// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "broad/backend.h"
#include "demos/bench/cuda_table.h"
#include "demos/scenes/fresh_boxes.h"

#include <string>

namespace cullet
{
/// Times a DevicePairFinder: the complete pair set of boxes in device memory, other ones in every frame (three sets in turn).
CudaRow timePairs(const FreshScene& scene, const std::string& variant, const PsapOptions& options,
                  int frames);
}  // namespace cullet
