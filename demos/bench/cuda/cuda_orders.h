// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/cuda/cuda_bench.h"
#include "cullet/demos/bench/cuda/support/cuda_table.h"

namespace cullet
{
/// Every order of the fast search beside what it chooses by itself ("rows"), in sizes between 16k and 1M: whether the choice is
/// right. Three rounds, of which the middle one counts.
void timeOrders(const CudaBenchOptions& options, CudaTable& table);
}  // namespace cullet
