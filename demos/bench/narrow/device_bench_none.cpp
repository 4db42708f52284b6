// SPDX-FileCopyrightText: the cullet authors
// SPDX-License-Identifier: Zlib

// Replaces device_bench.cpp in a build without CUDA.

#include "cullet/demos/bench/narrow/device_bench.h"
#include "cullet/demos/program/exit_code.h"

namespace cullet
{
void runDeviceNarrowBench(const DeviceNarrowOptions&, ResultFile&)
{
    throw ProgramError(kExitUnavailable, "built without CUDA");
}
}  // namespace cullet
