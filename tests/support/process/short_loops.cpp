// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// In a program that links this file, loops of any length run on several threads.
#include "cullet/base/threads/parallel_loops.h"

namespace
{
[[maybe_unused]] const double workPerThread = cullet::ParallelLoops::workPerThread = 1e-9;
}  // namespace
