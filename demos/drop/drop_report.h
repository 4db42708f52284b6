// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
#pragma once

#include "cullet/demos/drop/drop_run.h"

namespace cullet
{
inline namespace CULLET_PRECISION
{
/// Prints the worlds side by side, and compares the times of the last and the first one on stdout.
void printReport(const DropOptions& options, const DropResult& result);

/// Adds a row per contender and StepSample, in the form of all benchmarks.
void addRows(const DropOptions& options, const DropResult& result, ResultFile& file);
}  // namespace CULLET_PRECISION
}  // namespace cullet
