// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/cuda/cuda_bench.h"
#include "cullet/demos/bench/cuda/support/cuda_table.h"

namespace cullet
{
/// Times every order of the fast search and the automatic choice ("rows"), at sizes between 16k and 1M, to check the
/// choice. Three rounds, of which the median counts.
void timeOrders(const CudaBenchOptions& options, CudaTable& table);
}  // namespace cullet
