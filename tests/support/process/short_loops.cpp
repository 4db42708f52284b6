// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib
//
// In a program that is linked with this, loops run on several threads however short they are.
#include "cullet/base/threads/parallel_loops.h"

namespace
{
[[maybe_unused]] const double worth = cullet::ParallelLoops::worth = 1e-9;
}  // namespace
