// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Replaces cuda_bench.cpp in a build without CUDA.

#include "cullet/demos/bench/cuda/cuda_bench.h"
#include "cullet/demos/program/exit_code.h"

namespace cullet
{
void runCudaBench(const CudaBenchOptions&, ResultFile&)
{
    throw ProgramError(kExitUnavailable, "built without CUDA");
}
}  // namespace cullet
