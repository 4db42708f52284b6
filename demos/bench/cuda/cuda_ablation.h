// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/bench/cuda/cuda_sets.h"
#include "cullet/demos/bench/cuda/support/cuda_table.h"

namespace cullet
{
/// Measures each part of the design: a row for each option of the CUDA backend, complete pair set.
///
/// "rows-...": the fast search. "literal-...": the thesis's count, scan, fill, 64-bit radix sort and sweep, along the
/// axis of the largest variance and in automatic cells unless the name says otherwise. "shifted-...": "literal" with
/// the thesis's shift in float. "...-thesis-cells": one cell for 64,000 boxes, rounded up.
/// @param frames of rows that are not slow
void timeAblation(const FreshSets& sets, int frames, CudaTable& table);

/// Widths of cells and lengths of bins of the fast search.
void timeScales(const FreshSets& sets, CudaTable& table);
}  // namespace cullet
