// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/cuda/cuda_bench.h"
#include "cullet/demos/bench/cuda/support/cuda_table.h"

namespace cullet
{
/// A million boxes where sweep and prune is weak: all at one coordinate of an axis, also swept along that axis; all on
/// one line; one box that covers all others.
void timeExtremes(const CudaBenchOptions& options, CudaTable& table);
}  // namespace cullet
